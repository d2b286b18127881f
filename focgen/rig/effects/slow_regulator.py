"""A regulator whose bandwidth is lower than nominal, filling and venting alike."""

from dataclasses import replace

from focgen.rig.effects import _lags
from focgen.rig.effects._effect import Effect
from focgen.rig.effects._sizes import LATER

EFFECT = Effect(
    name="slow_regulator",
    stage="regulator",
    meaning="a linear bandwidth lower than nominal, up and down alike",
    reveals="steps in both directions: the same extra lag at every size of step",
    confused_with=("transport_delay", "valve_asymmetry", "flow_limit", "sensor_lag"),
    needs=lambda e: None if e.fastest < 1.0 else "no change of the input is fast beside the rig's response",
    sizes=(LATER,),
    forms=[replace(form, leads=True) for form in _lags.slower_forms("supply")],
)
