"""The gain moves slowly with time, on the way to the spring or because the spring itself gives way."""

from dataclasses import replace

from focgen.arrays import Array
from focgen.rig.effects import _trends
from focgen.rig.effects._effect import Effect
from focgen.rig.effects._sizes import GAIN_OVER_SESSION


def _grown(x: Array, trend: Array) -> Array:
    return x * (1.0 + trend)


_DRIVE = _trends.forms("drive", 0, _grown)
# of the spring, which pulls back the more slowly the weaker it is
_SPRING = [
    replace(f, name=f"spring_{f.name}", wears="time")
    for f in _trends.forms("spring", 0, _grown)
    if not f.wanders
]

EFFECT = Effect(
    name="gain_drift",
    stage="actuator",
    also=("regulator",),
    meaning="the gain moves slowly with time, whatever the load",
    reveals="the same experiment at the start and at the end",
    confused_with=("sensor_drift", "softening", "creep", "leak", "gain_nonlinearity"),
    needs=lambda e: None if e.repeats else "no level is repeated later in the session",
    sizes=(GAIN_OVER_SESSION,),
    forms=[*_DRIVE, *_SPRING],
)
