"""A spring pressed against a seat, and an obstacle in the way of a mass, against exact solutions and scipy's
integrator; play and slack of what is taken along.

Red when a preload, a seat or an obstacle departs from the exact motion, or when a form of an effect is not
offered to an actuator that can have it.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig.changeable import fits_in
from focgen.rig.dynamics import Dynamics, Friction
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.modes import respond as lag
from focgen.rig.placed import Placed
from focgen.rig.plant import Plant, respond
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H, PRELOAD = 0.01, 0.3
MASS = LinearActuator(TransferFunction([(2.0, 0.0)], [(0.05, 2.0), (0.7, 1.0), (1.0, 0.0)]))


def rest(n):
    return Run.of([n], [0.0], H).rest


def test_a_lag_leaves_its_seat_and_comes_back_to_it():
    """T y' + y = u − P while y > 0: up to u − P, and back at 0 after T ln(1 + y/(P − u)), where it stays."""
    T, t = 0.7, H * np.arange(1200)
    x = np.where((t > 1.0) & (t <= 8.0), 1.0, 0.2)
    y = lag(x, rest(len(x)), H, T, 1.0, 12.0, Dynamics(preload=PRELOAD))
    up = (1.0 - PRELOAD) * -np.expm1(-(t - 1.0) / T)
    rising = (t > 1.05) & (t < 8.0)
    np.testing.assert_allclose(y[rising], up[rising], atol=0.01)  # a sample's doubt about when x rose
    back = T * np.log1p((1.0 - PRELOAD) / (PRELOAD - 0.2))
    assert abs(t[np.flatnonzero(y > 1e-6)[-1]] - 8.0 - back) < 3 * H
    assert np.all(y[t < 1.0] == 0.0) and np.all(y[t > 8.1 + back] == 0.0)


@pytest.mark.parametrize("c", [0.7, 0.05])
@pytest.mark.parametrize("side", [1, -1])
def test_a_mass_is_caught_by_its_seat(c, side):
    """m y'' + c y' + k y = u − P after a step up and one down, until it comes back to 0: there it stays."""
    n = 500
    x = np.where(np.arange(n) < 200, 1.0, 0.1)

    def slope(now, state):
        u = 1.0 if now < 199.0 * H else 1.0 - 0.9 * min(now / H - 199.0, 1.0)
        return [state[1], (u - PRELOAD - state[0] - c * state[1]) / 0.05]

    def home(now, state):
        return state[0] if now > 0.1 else 1.0

    home.terminal, home.direction = True, -1.0
    t = H * np.arange(n)
    exact = solve_ivp(slope, (0.0, t[-1]), [0, 0], t_eval=t, events=home, rtol=1e-9, atol=1e-12, max_step=H)
    made = respond(Plant(2, 0.05, c, 1.0), side * x, rest(n), H, Dynamics(preload=PRELOAD))
    until = len(exact.t)
    assert 200 < until < n
    np.testing.assert_allclose(side * made[20:until], np.interp(t[20:until], exact.t, exact.y[0]), atol=0.02)
    assert np.all(side * made >= 0.0) and np.all(made[-50:] == 0.0)


def test_a_seat_of_its_own_beside_friction_holds_both():
    x = np.full(800, 0.35)
    both = Dynamics(preload=PRELOAD, drag=Friction(0.1, 0.1))
    for y in (
        respond(Plant(2, 0.05, 0.7, 1.0), x, rest(800), H, both),
        lag(x, rest(800), H, 0.7, 0.8, 8.0, both),
    ):
        assert np.all(y == 0.0)
    x = np.full(4000, 1.0)
    y = respond(Plant(2, 0.05, 0.7, 1.0), x, rest(4000), H, both)
    np.testing.assert_allclose(y[-1], 0.6, atol=1e-3)


@pytest.mark.parametrize("side", [1, -1])
def test_in_equilibrium_a_preload_is_lost(side):
    held = np.array([BALANCED, *[0] * 299], np.uint8)
    x = np.full(300, side * 1.0)
    one = respond(Plant(2, 0.05, 0.7, 1.0), x, held, H, Dynamics(preload=PRELOAD))
    other = lag(x, held, H, 0.7, 1.0, 3.0, Dynamics(preload=PRELOAD))
    np.testing.assert_allclose(one, side * 0.7, atol=1e-6)
    np.testing.assert_allclose(other, side * 0.7, atol=1e-6)


@pytest.mark.parametrize(
    ("m", "stiffness"), [(0.05, 1.0), pytest.param(0.05, 40.0, marks=pytest.mark.long), (0.003, 40.0)]
)
def test_an_obstacle_against_an_integrator(m, stiffness):
    t = H * np.arange(600)
    x, place = 0.6 - 0.6 * np.cos(2.3 * t) + 0.2 * np.sin(5.1 * t), 0.5

    def slope(now, state):
        pushed = stiffness * max(state[0] - place, 0.0)
        return [state[1], (np.interp(now, t, x) - state[0] - 0.7 * state[1] - pushed) / m]

    exact = solve_ivp(slope, (0, t[-1]), [0, 0], t_eval=t, method="LSODA", rtol=1e-9, atol=1e-12, max_step=H)
    made = respond(
        Plant(2, m, 0.7, 1.0), x, rest(600), H, Dynamics(place=place, stiffness=stiffness), Between.STRAIGHT
    )
    np.testing.assert_allclose(made, exact.y[0], atol=1e-3 * np.max(exact.y[0]))


@pytest.mark.parametrize("m", [0.05, 0.0])
def test_stops_on_both_sides_against_an_integrator(m):
    """A mass on a spring, and a lag."""
    t, place, stiffness = H * np.arange(600), 0.4, 12.0
    x = 0.9 * np.sin(2.3 * t) - 0.3 * np.sin(0.7 * t)

    def slope(now, state):
        pushed = stiffness * (state[0] - np.clip(state[0], -place, place))
        left = np.interp(now, t, x) - state[0] - pushed
        return [state[1], (left - 0.7 * state[1]) / m] if m else [left / 0.7]

    begin = [0.0, 0.0] if m else [0.0]
    exact = solve_ivp(slope, (0, t[-1]), begin, t_eval=t, method="LSODA", rtol=1e-9, atol=1e-12, max_step=H)
    stops = Dynamics(place=-place, stiffness=stiffness)
    if m:
        made = respond(Plant(2, m, 0.7, 1.0), x, rest(600), H, stops, Between.STRAIGHT)
    else:
        made = lag(x, rest(600), H, 0.7, 1.0, 6.0, stops)
    assert exact.y[0].max() > place and exact.y[0].min() < -place
    np.testing.assert_allclose(made, exact.y[0], atol=2e-3 * np.max(exact.y[0]))


@pytest.mark.parametrize(
    ("effect", "form", "value"),
    [
        ("dead_zone", "preloaded", (0.3,)),
        ("contact", "spring", (0.4, 3.0)),
        ("contact", "both_ways", (0.4, 3.0)),
    ],
)
def test_a_rig_of_either_kind_has_it(effect, form, value):
    """A lag and a mass on a spring with the same gain come to the same rest."""
    run, signals = Run.of([3000], [0.0], H), Signals("c", "y")
    placed = (Placed(effect, form_of(effect, form), "actuator", value),)
    x = np.full(3000, 0.8)
    mass = Rig("a", H, signals, MASS)
    slow = Rig("b", H, signals, LinearActuator(TransferFunction([(2.0, 0.0)], [(0.7, 1.0), (1.0, 0.0)])))
    assert fits_in(placed[0].form, "actuator", mass)
    ends = [Chain(r, placed).run(x, "regulator", "sensor", run)[-1] for r in (mass, slow)]
    assert abs(ends[0] - ends[1]) < 1e-3 and abs(ends[0] - 1.6) > 0.1
    drive = value if effect == "contact" else (2.0 * value[0],)  # of K p, as the force of friction is
    other = Rig("c", H, signals, Actuator(0.7, 1.0, (2.0,)))
    again = Chain(other, (Placed(effect, placed[0].form, "actuator", drive),)).run(
        x, "regulator", "sensor", run
    )
    assert abs(again[-1] - ends[0]) < 1e-3


def test_what_is_taken_along_lags_behind_by_the_play():
    run, rig = Run.of([400], [0.0], H), Rig("a", H, Signals("c", "y"), MASS)
    x = np.sin(0.5 * H * np.arange(400))
    plain = Chain(rig).run(x, "regulator", "sensor", run)
    late = Chain(rig, (Placed("hysteresis", form_of("hysteresis", "lost_motion"), "actuator", (0.1,)),))
    slack = Chain(rig, (Placed("dead_zone", form_of("dead_zone", "slack"), "actuator", (0.1,)),))
    seen, hung = (c.run(x, "regulator", "sensor", run) for c in (late, slack))
    top = int(np.argmax(plain))
    np.testing.assert_allclose(seen[:top], np.maximum(plain[:top] - 0.1, 0.0), atol=1e-9)
    np.testing.assert_allclose(hung, np.sign(plain) * np.maximum(np.abs(plain) - 0.1, 0.0), atol=1e-9)
    assert np.all(np.abs(seen - plain) < 0.1 + 1e-9)


@pytest.mark.parametrize("speed", [0.2, pytest.param(2.0, marks=pytest.mark.long)])
def test_a_damper_that_is_another_on_the_way_back(speed):
    t = H * np.arange(900)
    x, m, c = 0.6 - 0.6 * np.cos(2.3 * t) + 0.2 * np.sin(5.1 * t), 0.02, 0.7

    def slope(now, state):
        damper = c / speed if state[0] * state[1] < 0 else c
        return [state[1], (np.interp(now, t, x) - state[0] - damper * state[1]) / m]

    exact = solve_ivp(slope, (0, t[-1]), [0, 0], t_eval=t, method="LSODA", rtol=1e-9, atol=1e-12, max_step=H)
    made = respond(Plant(2, m, c, 1.0), x, rest(900), H, Dynamics(unloading=speed))
    np.testing.assert_allclose(made, exact.y[0], atol=1e-3 * np.max(exact.y[0]))
    plain = respond(Plant(2, m, c, 1.0), x, rest(900), H)
    assert np.max(np.abs(plain - made)) > 0.03


def test_a_mass_on_the_spring_of_either_kind():
    """M y'' + T y' + y = K x, whichever way the rig says T y' + y = K x, and beside a mass that it has."""
    run, period = Run.of([1500], [0.0], H), 3.0
    M, x = (period / (2.0 * np.pi)) ** 2, np.where(np.arange(1500) % 700 < 350, 1.0, 0.0)
    placed = (Placed("resonance", form_of("resonance", "mass"), "actuator", (period,)),)

    def of(*den):
        return TransferFunction([(2.0, 0.0)], [(c, len(den) - 1.0 - i) for i, c in enumerate(den)])

    given = {
        "order 1": (Actuator(0.7, 1.0, (2.0,)), of(M, 0.7, 1.0), 2e-4),
        "a lag": (LinearActuator(of(0.7, 1.0)), of(M, 0.7, 1.0), 1e-9),
        "order 2": (MASS, of(M + 0.05, 0.7, 1.0), 1e-9),
    }
    for name, (actuator, exact, apart) in given.items():
        rig = Rig(name, H, Signals("c", "y"), actuator)
        assert fits_in(placed[0].form, "actuator", rig)
        made = Chain(rig, placed).run(x, "regulator", "sensor", run)
        plain = Chain(rig).run(x, "regulator", "sensor", run)
        wanted = Chain(Rig("e", H, Signals("c", "y"), LinearActuator(exact))).run(
            x, "regulator", "sensor", run
        )
        np.testing.assert_allclose(made, wanted, atol=apart)
        assert np.max(np.abs(plain - wanted)) > 0.1
