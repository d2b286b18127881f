"""A gain that moves slowly with time, whatever the load: warming, drying, fatigue."""

from focgen.rig.effects import _trends
from focgen.rig.effects._effect import Effect

EFFECT = Effect(
    name="gain_drift",
    stage="actuator",
    meaning="the gain moves slowly with time, whatever the load",
    reveals="the same experiment at the start and at the end",
    confused_with=("sensor_drift", "softening", "creep", "leak", "gain_nonlinearity"),
    needs=lambda e: None if e.repeats else "no level is repeated later in the session",
    forms=_trends.forms("drive", 0, lambda x, trend: x * (1.0 + trend)),
)
