"""Rate-independent memory of the actuator: Prandtl–Ishlinskii, Bouc–Wen, even or growing with the load."""

from focgen.rig.effects import _loops
from focgen.rig.effects._effect import Effect

EFFECT = Effect(
    name="hysteresis",
    stage="actuator",
    meaning="rate-independent memory: loops whose area does not vanish with frequency",
    reveals="a slow triangle with nested minor loops, a staircase up and down",
    confused_with=(
        "sensor_hysteresis",
        "valve_stiction",
        "unloading_asymmetry",
        "dead_zone",
        "gain_nonlinearity",
    ),
    needs=lambda e: None if e.reversals or e.unloads else "the input never turns round",
    forms=_loops.forms("drive"),
)
