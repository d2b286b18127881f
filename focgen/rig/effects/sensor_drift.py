"""A sensor's offset that moves slowly with time."""

from focgen.rig.effects import _trends
from focgen.rig.effects._effect import Effect
from focgen.rig.effects._sizes import ZERO_OVER_SESSION

EFFECT = Effect(
    name="sensor_drift",
    stage="sensor",
    also=("regulator",),
    meaning="the offset moves slowly with time",
    reveals="the unloaded reading at the start and at the end, with the curvature logged",
    confused_with=("gain_drift", "creep", "sensor_relaxation"),
    needs=lambda e: None if e.duration > 10 else "the session is too short for a drift to show",
    sizes=(ZERO_OVER_SESSION,),
    forms=_trends.forms("reading", 1, lambda x, trend: x + trend),
)
