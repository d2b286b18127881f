"""Rate-independent memory of the actuator: loops of the drive, even or growing with the load; in a plant with
a mass, of the spring that pulls it back."""

from dataclasses import replace

from focgen.arrays import Array
from focgen.rig import kernels
from focgen.rig.dynamics import Dynamics, Spring
from focgen.rig.effects import _loops
from focgen.rig.effects._effect import LARGEST, Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import WIDEST_LOOP


def _spring(x: Dynamics, values: Values, run: None) -> Dynamics:
    share, loading, unloading, scale = values
    return replace(x, spring=Spring(share, loading / scale, unloading / scale, 1.0, scale))


def _sharp_spring(x: Dynamics, values: Values, run: None) -> Dynamics:
    share, loading, unloading, power, scale = values
    return replace(x, spring=Spring(share, loading / scale, unloading / scale, power, scale))


def _added_spring(x: Dynamics, values: Values, run: None) -> Dynamics:
    added, loading, unloading, scale = values
    return replace(x, spring=Spring(added, loading / scale, unloading / scale, 1.0, scale, added=True))


def _lost_motion(x: Array, values: Values, run: Run) -> Array:
    return kernels.play(x, run.rest, values[0])


# of the stiffness: Bouc and Wen's spring takes it over, and is as stiff where a motion begins
_SHARE = Parameter("share", lower=0.0, upper=1.0, starts=(0.2, 0.5), zero=0.0)
# beside the stiffness that was found where all of it has slid
_ADDED = Parameter("added", lower=0.0, upper=3.0, starts=(0.2, 0.8), zero=0.0)
# of its stiffness: what a spring wound to the largest displacement has lost; below 0 it stiffens
_LOADING = Parameter("loading", lower=-3.0, upper=30.0, starts=(0.5, 0.0))
_UNLOADING = Parameter("unloading", lower=-3.0, upper=30.0, starts=(0.5, 1.0))
_POWER = Parameter("power", lower=0.5, upper=4.0, starts=(1.0, 1.0))
_LOST = Parameter("width", level=1, lower=0.0, upper=0.6, starts=(0.02, 0.1), zero=0.0)

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
    remembers=True,
    sizes=(WIDEST_LOOP,),
    forms=[
        *_loops.forms("drive"),
        Form("spring", "dynamics", (_SHARE, _LOADING, _UNLOADING, LARGEST), _spring),
        Form("sharp_spring", "dynamics", (_SHARE, _LOADING, _UNLOADING, _POWER, LARGEST), _sharp_spring),
        Form("added_spring", "dynamics", (_ADDED, _LOADING, _UNLOADING, LARGEST), _added_spring),
        *_loops.behind("place"),
        # what is seen is taken along with play by what moves
        Form("lost_motion", "response", (_LOST,), _lost_motion),
    ],
)
