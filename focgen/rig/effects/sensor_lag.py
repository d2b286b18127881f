"""A sensor slower than nominal: a filter, exposure, a slow front end."""

from focgen.rig.effects import _lags
from focgen.rig.effects._effect import Effect

EFFECT = Effect(
    name="sensor_lag",
    stage="sensor",
    meaning="slower than nominal",
    reveals="steps and fast sines with the curvature logged",
    confused_with=("slow_regulator", "transport_delay", "sensor_relaxation", "creep"),
    needs=lambda e: None if e.fastest < 1.0 else "no change of the input is fast beside the rig's response",
    forms=_lags.deep_forms("strain"),
)
