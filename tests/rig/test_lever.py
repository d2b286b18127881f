"""What drives an actuator pulls more or less strongly where that has come to.

Red when it is not what the equation makes in small steps, when loops that solve for it and turns that come to
it differ, or when a delay, a begin or a stage's gain moves where it pulls.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from focgen.fractional.transfer import TransferFunction
from focgen.rig import linear
from focgen.rig.dynamics import Lever
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H, N = 0.01, 3000
COIL = LinearActuator(TransferFunction([(700.0, 0.0)], [(1.0, 2.0), (20.0, 1.0), (400.0, 0.0)]))
POUCH = Actuator(0.4, 0.7, (1.2, 0.3))
SHELL = LinearActuator(TransferFunction([(1.5, 0.0)], [(0.1, 1.4), (0.5, 0.7), (1.0, 0.0)]))
PULLS = [(0.15, -0.2, 3.0), (-0.3, 0.1, 3.0)]


def run_of(balanced=False):
    rest = np.zeros(N, np.uint8)
    rest[[0, N // 2]] = BALANCED if balanced else 1
    return Run(H, rest, H * np.arange(N), H * N / 2)


def loads():
    t = H * np.arange(N)
    return 1.1 * np.sin(1.3 * t) + 0.5 * np.sin(7.0 * t) + 0.4


def placed(values, effect="gain_nonlinearity", form="force_factor"):
    return Placed(effect, form_of(effect, form), "actuator", values)


def made_by(actuator, effects, balanced=False, delay=0.0):
    rig = Rig("a rig", H, Signals("t", "y"), actuator)
    rig = replace(rig, delays=replace(rig.delays, actuator=delay))
    return Chain(rig, effects).run(loads(), "actuator", "actuator", run_of(balanced))


@pytest.mark.parametrize("values", [PULLS[0], pytest.param(PULLS[1], marks=pytest.mark.long)])
def test_a_coil_is_what_its_equation_makes_in_small_steps(values):
    first, second, scale = values
    made, t, x = made_by(COIL, (placed(values),))[: N // 2], H * np.arange(N // 2), loads()[: N // 2]

    def slope(now, state):
        y, v = state
        q = np.clip(y / scale, -1.1, 1.1)
        force = np.interp(now, t, x) * (1.0 + first * q + second * q * q)
        return [v, 700.0 * force - 20.0 * v - 400.0 * y]

    exact = solve_ivp(slope, (0, t[-1]), [0, 0], t_eval=t, rtol=1e-9, atol=1e-12, max_step=H)
    # x runs in lines, and so does x g: what g bends in between is left out
    from_zero = np.exp(-10.0 * t)  # the first sample's load comes from 0 there, and jumps here
    miss = np.abs(made - exact.y[0]) - 3.0 * from_zero
    assert np.max(miss) < 2e-3 * np.max(np.abs(exact.y[0]))
    assert np.max(np.abs(made - made_by(COIL, ())[: N // 2])) > 0.05


@pytest.mark.parametrize("actuator", [COIL, POUCH, SHELL], ids=["coil", "pouch", "shell"])
@pytest.mark.parametrize("balanced", [False, True], ids=["from rest", "balanced"])
@pytest.mark.parametrize("values", PULLS)
def test_the_response_is_that_to_what_it_is_driven_by_there(actuator, balanced, values):
    y, lever = made_by(actuator, (placed(values),), balanced), Lever(*values)
    drive = actuator.drive(loads()) * lever.strength(y)
    run = run_of(balanced)
    again = linear.run(actuator.dynamics, drive, run.rest, H, run.duration, False)
    # of a fractional one at rest, where a log begins, modes too slow to move are added behind the pull
    off = 3e-5 if balanced and not actuator.dynamics.is_integer else 1e-9
    np.testing.assert_allclose(y, again, atol=off * np.max(np.abs(y)))


@pytest.mark.parametrize("actuator", [COIL, POUCH], ids=["coil", "pouch"])
def test_turns_come_to_what_loops_solve_for(actuator):
    lever = placed(PULLS[0])
    far = placed((1e6, 1.0), "contact", "spring")  # an obstacle that is never met
    solved, turned = made_by(actuator, (lever,)), made_by(actuator, (lever, far))
    np.testing.assert_allclose(turned, solved, atol=3e-4 * np.max(np.abs(solved)))


def test_what_it_is_driven_by_there_comes_later_by_its_delay():
    late, prompt = (made_by(COIL, (placed(PULLS[0]),), delay=d) for d in (0.05, 0.0))
    np.testing.assert_allclose(late[5 : N // 2], prompt[: N // 2 - 5], atol=1e-12)


def test_a_pull_that_is_the_same_everywhere_is_none():
    np.testing.assert_allclose(made_by(POUCH, (placed((0.0, 0.0, 3.0)),)), made_by(POUCH, ()), atol=1e-12)


@pytest.mark.parametrize("actuator", [COIL, POUCH], ids=["mass", "springpot"])
def test_a_worn_spring_is_pulled_alike_whether_or_not_it_rubs(actuator):
    """A lever acts on what drives it, not on what the spring no longer bears."""
    both = (placed((-0.3, 0.0, 2.0)), placed((0.6, 0.8), "softening", "worn"))
    rubs = (*both, placed((1e-7,), "friction", "coulomb"))
    bare, rubbed, unworn = (made_by(actuator, effects) for effects in (both, rubs, both[:1]))
    assert np.max(np.abs(bare - rubbed)) < 2e-3 * np.max(np.abs(bare)) < 0.02 * np.max(np.abs(bare - unworn))


@pytest.mark.parametrize(
    "effect, form, values",
    [
        ("unloading_asymmetry", "rising", (0.5,)),
        ("gain_nonlinearity", "power", (0.5, 2.0, 1.0)),
        ("dead_zone", "preloaded", (0.2,)),
    ],
)
def test_what_stands_beside_a_mass_is_not_lost(effect, form, values):
    """A mass too small to matter, on a lag of order 1, changes nothing of what else does."""
    alone = placed(values, effect, form)
    tiny = placed((0.004,), "resonance", "mass")
    for actuator in (
        Actuator(0.7, 1.0, (2.0,)),
        LinearActuator(TransferFunction([(2.0, 0.0)], [(0.7, 1.0), (1.0, 0.0)])),
    ):
        without, beside, none = (made_by(actuator, e) for e in ((alone,), (tiny, alone), ()))
        assert np.max(np.abs(without - none)) > 0.1
        assert np.max(np.abs(beside - without)) < 0.02
