"""A spring that gives way while it is used, against scipy's integrator.

Red when a weaker spring does not bend further and more slowly, when loops that solve for it and turns that
come to it differ, when what it has lost is lost between two sessions, or when the form is offered to a rig
without a spring.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from focgen.fractional.transfer import TransferFunction
from focgen.rig.changeable import fits_in
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H, N = 0.01, 3000
T = H * np.arange(N)
X = np.where(T % 6.0 < 3.0, 1.0, 0.2)
RUN = Run.of([N], [0.0], H)


def made(actuator, effect, form, *values, x=X):
    left: list[dict[str, float]] = []
    placed = (Placed(effect, form_of(effect, form), "actuator", values),)
    rig = Rig("a", H, Signals("c", "y"), actuator)
    assert fits_in(placed[0].form, "actuator", rig)
    return Chain(rig, placed).run(x, "regulator", "sensor", RUN, left=left), left[0]


@pytest.mark.parametrize("mass", [0.0, 0.04])
def test_a_spring_that_weakens_with_time_against_an_integrator(mass):
    """M y'' + T y' + s(t) y = 2 x, s = 1/(1 + a (1 − e^(−t/τ))): it ends 30 % further, and as much slower."""
    a, tau = 0.3, 10.0

    def slope(now, state):
        stiff = 1.0 / (1.0 - a * np.expm1(-now / tau))
        push = 2.0 * np.interp(now, T, X) - stiff * state[0]
        return [state[1], (push - 0.7 * state[1]) / mass] if mass else [push / 0.7, 0.0]

    exact = solve_ivp(
        slope, (0, T[-1]), [0.0, 0.0], t_eval=T, method="LSODA", rtol=1e-9, atol=1e-12, max_step=H
    )
    den = [(mass, 2.0), (0.7, 1.0), (1.0, 0.0)] if mass else [(0.7, 1.0), (1.0, 0.0)]
    linear = LinearActuator(TransferFunction([(2.0, 0.0)], den))
    given = [linear] if mass else [linear, Actuator(0.7, 1.0, (2.0,))]
    for actuator in given:
        y, _ = made(actuator, "gain_drift", "spring_settling", a, tau)
        np.testing.assert_allclose(y[100:], exact.y[0][100:], atol=2e-3 * np.max(exact.y[0]))
    ahead, _ = made(linear, "gain_drift", "settling", a, tau)
    assert np.max(np.abs(ahead - exact.y[0])) > 0.03  # of the drive alone: as far, but no slower


COIL = LinearActuator(TransferFunction([(2.0, 0.0)], [(0.04, 2.0), (0.2, 1.0), (1.0, 0.0)]))
WORN = [("worn", 0.4, 0.8), ("worn", 2.0, 0.5), ("pseudo_elastic", 0.5, 0.4), ("worn_by_work", 0.5, 5.0)]
SOFT = [
    Actuator(0.4, 0.7, (1.2, 0.3)),
    LinearActuator(TransferFunction([(-2.0, 0.0)], [(0.5, 0.7), (1.0, 0.0)])),
]


def further(form, growth, scale, y, most, work):
    """How many times as far a spring is bent."""
    w = {"worn": most, "pseudo_elastic": most - abs(y), "worn_by_work": work}[form]
    return 1.0 + growth * (1.0 - np.exp(-w / scale))


@pytest.mark.parametrize(
    "form, growth, scale", [*(pytest.param(*worn, marks=pytest.mark.long) for worn in WORN[:2]), *WORN[2:]]
)
def test_a_mass_on_a_spring_that_wears_in_small_steps(form, growth, scale):
    """Of 0.04 y'' + 0.2 y' + y/further = 2 x, a two-hundredth of a sample each."""
    y = v = most = work = 0.0
    x = np.where(T < 0.5, 0.0, X)
    fine, exact = 200, []
    for now, after in zip(x, [*x[1:], x[-1]]):
        exact.append(y)
        for i in range(fine):
            pull = y / further(form, growth, scale, y, most, work)
            v += H / fine * (2.0 * (now + (after - now) * i / fine) - 0.2 * v - pull) / 0.04
            before, y = abs(y), y + H / fine * v
            most, work = max(most, abs(y)), work + max(abs(y) - before, 0.0)
    found, left = made(COIL, "softening", form, growth, scale, x=x)
    new = Chain(Rig("a", H, Signals("c", "y"), COIL)).run(x, "regulator", "sensor", RUN)
    assert np.max(np.abs(found - exact)) < 0.02 * np.max(np.abs(found - new))
    assert next(iter(left.values())) == pytest.approx(work if "work" in left else most, rel=0.01)


def test_what_wears_is_pulled_by_a_lever_and_rubs_at_once():
    """Of 0.04 y'' + 0.2 y' + y/further + friction = 2 x g(y): friction cannot be solved for with the others,
    and the turns are of all of them."""
    y = v = most = 0.0
    fine, exact, rub = 40, [], 0.15
    for now, after in zip(X, [*X[1:], X[-1]]):
        exact.append(y)
        for i in range(fine):
            pull = y / further("worn", 0.4, 0.8, y, most, 0.0)
            x = (now + (after - now) * i / fine) * (1.0 - 0.2 * np.clip(y / 3.0, -1.1, 1.1))
            free = 2.0 * x - 0.2 * v - pull
            drag = np.clip(free + 0.04 * v * fine / H, -2.0 * rub, 2.0 * rub)  # it stops what would turn
            v += H / fine * (free - drag) / 0.04
            y += H / fine * v
            most = max(most, abs(y))
    named = {
        "friction": ("coulomb", (rub,)),
        "softening": ("worn", (0.4, 0.8)),
        "gain_nonlinearity": ("force_factor", (-0.2, 0.0, 3.0)),
    }
    all_of_it = tuple(Placed(n, form_of(n, f), "actuator", values) for n, (f, values) in named.items())
    rig = Rig("a", H, Signals("c", "y"), COIL)
    found = Chain(rig, all_of_it).run(X, "regulator", "sensor", RUN)
    for left_out in range(3):
        fewer = Chain(rig, all_of_it[:left_out] + all_of_it[left_out + 1 :]).run(
            X, "regulator", "sensor", RUN
        )
        assert np.max(np.abs(found - exact)) < 0.1 * np.max(np.abs(found - fewer))


@pytest.mark.parametrize("actuator", [*SOFT, COIL], ids=["K(p)", "pulled", "mass"])
@pytest.mark.parametrize("form, growth, scale", WORN)
@pytest.mark.parametrize("carried", [{}, {"largest": 1.0, "work": 3.0}], ids=["new", "used"])
def test_where_a_worn_spring_was_and_comes_to_is_in_balance(actuator, form, growth, scale, carried):
    """The nominal response to x + (1 - s) y/gain is y, of logs from rest and from where the rig was held."""
    rest = np.zeros(N, np.uint8)
    rest[[0, N // 2]] = 1, BALANCED
    run, rig = replace(RUN, rest=rest), Rig("a", H, Signals("c", "y"), actuator)
    one = Placed("softening", form_of("softening", form), "actuator", (growth, scale), carried)
    y = Chain(rig, (one,)).run(X, "actuator", "actuator", run)
    nominal = Chain(
        replace(rig, actuator=actuator if actuator is COIL else LinearActuator(actuator.dynamics))
    )
    worn = one.act(y, run) / np.where(y == 0.0, 1.0, y)
    weak = np.where(y == 0.0, 1.0, 1.0 / np.maximum(worn, 1.0))
    drive = actuator.drive(X) + (1.0 - weak) * y / actuator.dynamics.dc_gain
    again = nominal.run(drive, "actuator", "actuator", run)
    # modes too slow to move do not come back to the spring of a fractional one
    np.testing.assert_allclose(y, again, atol=1e-3 * np.max(np.abs(y)))
    new = Chain(rig).run(X, "actuator", "actuator", run)
    assert np.max(np.abs(y - new)) > 0.05 * np.max(np.abs(y))


def test_a_spring_rests_where_turns_go_to_and_fro():
    """Held a little below the furthest it has been: there it is the stiffer the less it is bent, by twice."""
    rest = np.zeros(N, np.uint8)
    rest[[0, N // 2]] = 1, BALANCED
    x = np.where(np.arange(N) < N // 2, 1.0, 0.8)
    one = Placed("softening", form_of("softening", "pseudo_elastic"), "actuator", (0.5, 0.4))
    y = Chain(Rig("a", H, Signals("c", "y"), COIL), (one,)).run(
        x, "actuator", "actuator", replace(RUN, rest=rest)
    )
    most, held = np.max(y[: N // 2]), y[N // 2]
    assert held == pytest.approx(2.0 * 0.8 * further("pseudo_elastic", 0.5, 0.4, held, most, 0.0), rel=1e-6)
    np.testing.assert_allclose(y[N // 2 :], held, rtol=1e-6)


@pytest.mark.parametrize("form, growth, scale", WORN)
def test_turns_come_to_what_is_solved_for(form, growth, scale):
    placed = Placed("softening", form_of("softening", form), "actuator", (growth, scale))
    by_turns = replace(placed, form=replace(placed.form, wears=""))
    rig = Rig("a", H, Signals("c", "y"), SOFT[0])
    found, turned, new = (
        Chain(rig, p).run(X, "actuator", "actuator", RUN) for p in ((placed,), (by_turns,), ())
    )
    assert np.max(np.abs(found - turned)) < 0.02 * np.max(np.abs(found - new))  # of no more than twelve


def test_what_a_spring_has_lost_outlives_the_session():
    y, left = made(Actuator(0.7, 0.8, (2.0,)), "softening", "worn", 0.5, 1.0)
    assert left == {"largest": pytest.approx(np.max(y))}
    fresh = Chain(Rig("a", H, Signals("c", "y"), Actuator(0.7, 0.8, (2.0,))))
    assert y[290] > 1.2 * fresh.run(X, "regulator", "sensor", RUN)[290]


def test_an_axis_has_no_spring():
    axis = LinearActuator(TransferFunction([(1.0, 0.0)], [(0.5, 2.0), (0.1, 1.0)]))
    rig = Rig("a", H, Signals("c", "y"), axis)
    for effect, form in (("gain_drift", "spring_linear"), ("softening", "worn_by_work")):
        assert not fits_in(form_of(effect, form), "actuator", rig)
        assert not fits_in(form_of(effect, form), "regulator", Rig("b", H, Signals("c", "y")))
