"""A reading that depends on the direction of the strain, Prandtl–Ishlinskii and Bouc–Wen."""

from focgen.rig.effects import _loops
from focgen.rig.effects._effect import Effect
from focgen.rig.effects._sizes import WIDEST_LOOP

EFFECT = Effect(
    name="sensor_hysteresis",
    stage="sensor",
    meaning="the reading depends on the direction of the strain",
    reveals="slow cycles with the curvature logged beside the reading",
    confused_with=("hysteresis", "valve_stiction", "sensor_relaxation", "sensor_nonlinearity"),
    needs=lambda e: None if e.reversals or e.unloads else "the input never turns round",
    remembers=True,
    sizes=(WIDEST_LOOP,),
    forms=_loops.forms("strain"),
)
