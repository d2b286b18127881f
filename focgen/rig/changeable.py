"""What effects may change of each stage's own equation, and so where their forms fit in."""

from __future__ import annotations

import numpy as np

from focgen.fractional.transfer import TransferFunction
from focgen.rig import lags, linear
from focgen.rig import plant as plants
from focgen.rig.dynamics import UNCHANGED
from focgen.rig.effects import EQUATIONS, Form
from focgen.rig.rig import Actuator, LinearActuator, Rig

# what effects may change of a lag; of a mass on a spring, beside bend and drag, and run in steps
_OF_LAGS = frozenset(
    {"loading", "unloading", "place", "stiffness", "preload", "mass", "bend", "drag", "loss"}
)
IN_STEPS = frozenset({"spring", "rise", "place", "stiffness", "preload", "unloading", "mass"})


def fits_in(form: Form, stage: str, rig: Rig) -> bool:
    """Whether a form can act in a stage of this rig: what it changes of the actuator's own equation has to be
    in that equation."""
    if form.adds_up and not (stage == "regulator" and rig.integrator == "regulator"):
        return False
    if form.slot == "spring":
        return stage == "actuator" and rig.actuator is not None and _has_spring(rig.actuator)
    if form.slot not in EQUATIONS.values():
        return not form.bare or _is_bare(stage, rig)
    changed = form.act(UNCHANGED, tuple(p.starts[0] for p in form.parameters), None).changed
    made: bool = changed <= _changeable_in(stage, rig)
    return made


def _is_bare(stage: str, rig: Rig) -> bool:
    """Whether a rig takes a stage for 1, or a number: it has no dynamics."""
    if stage == "actuator":
        return rig.actuator is None or len(rig.actuator.dynamics.den) == 1
    transfer: TransferFunction = getattr(rig, stage)
    return len(transfer.den) == 1


def _changeable_in(stage: str, rig: Rig) -> frozenset[str]:
    """What effects may change of a stage's own equation."""
    if stage == "actuator":
        own = rig.actuator
        return _paced(own.dynamics) | _levered(own) | _changeable(own) if own else frozenset()
    if stage == "regulator":
        return _paced(rig.regulator) | _own_of(rig.regulator)
    return _paced(rig.sensor) | ({"loading", "unloading"} if lags.is_filled(rig.sensor) else set())


def _paced(transfer: TransferFunction) -> frozenset[str]:
    """What effects may change of any stage that has a pace."""
    return frozenset({"pace"} if linear.holds_level(transfer) else ())


def _own_of(regulator: TransferFunction) -> frozenset[str]:
    """What effects may change of a regulator's own equation: what it fills from where it has dynamics, and
    of one that is one lag after another, how fast the slowest vents and through what, its highest flow, and
    where it stops."""
    gain = regulator.dc_gain
    found = {"supply"} if len(regulator.den) > 1 and np.isfinite(gain) and gain else set()
    return frozenset(
        found
        | ({"loading", "unloading", "flow", "ceiling", "throat"} if lags.is_filled(regulator) else set())
    )


def _has_spring(actuator: Actuator | LinearActuator) -> bool:
    """Whether a spring pulls it back, and what drives it pulls at that."""
    return isinstance(actuator, Actuator) or linear.holds_level(actuator.dynamics)


def _levered(actuator: Actuator | LinearActuator) -> frozenset[str]:
    """What effects may change of any actuator that comes to rest where it is driven to."""
    return frozenset({"lever"} if _has_spring(actuator) and len(actuator.dynamics.den) > 1 else ())


def _changeable(actuator: Actuator | LinearActuator) -> frozenset[str]:
    """What effects may change of an actuator's own equation: all of a single lag's but a hysteretic spring; a
    spring that bends where there is one; dry friction on what moves, or on springs beside dampers; of a mass
    on a spring also a hysteretic one, an obstacle, a preload, its damper and its mass; of what else is a sum
    of lags, the pace each way."""
    lag = None if isinstance(actuator, Actuator) else linear.single_lag(actuator.dynamics)
    if isinstance(actuator, Actuator) or lag:
        return _OF_LAGS | ({"flow"} if lag and lag[2] == 1.0 else set())
    plant = plants.plant_of(actuator.dynamics)
    found = {"bend"} if linear.is_spring(actuator.dynamics) else set()
    if plant is None and is_damped(actuator.dynamics):
        found |= {"drag"}
    if plant is None and lags.is_sum_of_lags(actuator.dynamics):
        found |= {"loading", "unloading"}
    if plant is not None:
        found |= {"drag"} | ({"rise"} if plant.order == 2 else set())
        found |= IN_STEPS if plant.order == 2 and not plant.integrates else set()
    return frozenset(found)


def is_damped(transfer: TransferFunction) -> bool:
    """Whether it is of springs and dampers without a mass: a force moves it at once, it comes to rest at a
    level, and its poles are real, with a zero between each and the next."""
    num, den = transfer.num, transfer.den
    at_once, at_rest = den[0].order - num[0].order == 1.0, num[-1].order == den[-1].order == 0.0
    if not (transfer.is_integer and at_once and at_rest):
        return False
    poles, zeros = (np.roots(linear.coefficients(side)) for side in (den, num))
    turns = np.concatenate([poles, zeros])
    if np.any(turns.real >= 0.0) or np.any(np.abs(turns.imag) > 1e-9 * np.abs(turns)):
        return False
    slowest, between = np.sort(-poles.real), np.sort(-zeros.real)
    return bool(np.all(slowest[:-1] < between) and np.all(between < slowest[1:]))
