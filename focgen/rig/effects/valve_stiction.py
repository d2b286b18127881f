"""A valve that does nothing until a change of the command has crossed a band."""

from focgen.rig import kernels
from focgen.rig.effects._effect import Effect, Form, Parameter

_BAND = Parameter("band", level=1, lower=0.0, upper=0.5, starts=(0.01, 0.04, 0.12), zero=0.0)


def _play(x, values, run):
    return kernels.play(x, run.rest, values[0])


def _stick(x, values, run):
    return kernels.stick(x, run.rest, values[0], 0.0)


def _slip(x, values, run):
    band, left = values
    return kernels.stick(x, run.rest, band, left * band)


EFFECT = Effect(
    name="valve_stiction",
    stage="regulator",
    meaning="small command changes or reversals do nothing until a band is crossed",
    reveals="slow ramps with reversals and small steps about an offset, with the pressure logged",
    confused_with=("hysteresis", "dead_zone", "valve_asymmetry", "sensor_quantization"),
    needs=lambda e: None if e.reversals else "the input never turns round above zero",
    forms=[
        Form("play", "command", (_BAND,), _play),
        Form("stick", "command", (_BAND,), _stick),
        Form(
            "stick_slip",
            "command",
            (
                _BAND,
                Parameter("left", lower=0.0, upper=0.95, starts=(0.5, 0.5, 0.5)),
            ),
            _slip,
        ),
    ],
)
