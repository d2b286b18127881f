"""Dynamics that are faster or slower when unloading."""

from focgen.rig.effects._effect import Effect
from focgen.rig.effects._lags import one_way, rising, two_paced
from focgen.rig.effects._sizes import DOWN_OVER_UP

EFFECT = Effect(
    name="unloading_asymmetry",
    stage="actuator",
    meaning="the dynamics are faster or slower when unloading",
    reveals="steps up and down between the same pressures, sines: a mean shift that grows with frequency",
    confused_with=("valve_asymmetry", "hysteresis", "sensor_hysteresis", "gain_nonlinearity"),
    needs=lambda e: None if e.unloads else "the input never falls: release it as well",
    sizes=(DOWN_OVER_UP,),
    forms=[
        two_paced("dynamics", "unloading_speed"),
        rising("rising", "dynamics", "loading_speed"),
        one_way("lag", "response"),
    ],
)
