"""A sensor slower than nominal: a filter, exposure, a slow front end."""

from focgen.rig.effects import _lags
from focgen.rig.effects._effect import Effect
from focgen.rig.effects._sizes import LATER, LATER_DOWN

EFFECT = Effect(
    name="sensor_lag",
    stage="sensor",
    meaning="slower than nominal, or one way only",
    reveals="steps and fast sines with the curvature logged",
    confused_with=("slow_regulator", "transport_delay", "sensor_relaxation", "creep"),
    needs=lambda e: None if e.fastest < 1.0 else "no change of the input is fast beside the rig's response",
    sizes=(LATER, LATER_DOWN),
    forms=[
        *_lags.deep_forms("strain"),
        # a strip that recovers late, a reading that follows a peak at once
        _lags.two_paced("filter", "recovering_speed"),
        _lags.rising("rising", "filter", "rising_speed"),
        _lags.one_way("one_way", "strain", bare=True),
    ],
)
