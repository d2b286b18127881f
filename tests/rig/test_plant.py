"""Friction and hysteretic springs in a plant's equation, against exact solutions and scipy's integrator.

Red when friction or a hysteretic spring departs from the exact motion.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig import linear, solved
from focgen.rig.changeable import fits_in, is_damped
from focgen.rig.dynamics import Bend, Dynamics, Friction, Rise, Spring
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.files import read_rig, write_rig
from focgen.rig.kernels import BALANCED
from focgen.rig.modes import respond as lag
from focgen.rig.placed import Placed
from focgen.rig.plant import Plant, _levels, plant_of, respond
from focgen.rig.replay import replay
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H = 0.02


def rest(*lengths):
    return Run.of(lengths, [0.0] * len(lengths), H).rest


def transfer(gain, *den):
    """gain/(den[0] s^n + … + den[n])."""
    return TransferFunction([(gain, 0.0)], [(c, len(den) - 1 - i) for i, c in enumerate(den) if c])


@pytest.mark.parametrize("den", [(0.5, 0.3, 4.0), (0.5, 0.3, 0.0), (0.7, 1.0), (0.7, 0.0), (1e-4, 1.0, 1.0)])
@pytest.mark.parametrize("between", list(Between))
def test_without_friction_it_is_the_transfer_function(den, between):
    x = np.cumsum(np.random.default_rng(1).normal(size=600))
    plant = plant_of(transfer(2.0, *den))
    made = respond(plant, x, rest(350, 250), H, between=between)
    exact = linear.run(transfer(2.0, *den), x, rest(350, 250), H, 7.0, between)
    np.testing.assert_allclose(made, exact, atol=2e-7 * np.max(np.abs(exact)))


@pytest.mark.parametrize("other", [((1.0, 0.0),), ((1.0, 3.0), (1.0, 0.0)), ((1.0, 0.5), (1.0, 0.0))])
def test_what_is_no_such_plant(other):
    assert plant_of(TransferFunction([(1.0, 0.0)], other)) is None
    assert plant_of(TransferFunction([(1.0, 1.0)], [(1.0, 2.0), (1.0, 0.0)])) is None  # a zero
    assert plant_of(TransferFunction([(1.0, 0.0)], [(1.0, 1.0), (-1.0, 0.0)])) is None  # it grows


def test_a_mass_that_comes_to_rest_between_springs():
    """m y'' + k y = −F sgn y' after a blow: each half swing is F/k·2 shorter than the one before, in closed
    form; it stops for good where the spring can no longer pull it."""
    m, k, F, u0 = 0.25, 9.0, 1.0, 7.4
    x = np.r_[np.zeros(2), np.full(60, u0), np.zeros(400)]
    y = respond(Plant(2, m, 0.0, k), x, rest(len(x)), H, Dynamics(drag=Friction(F, F)), between=Between.HELD)
    w, d = np.sqrt(k / m), F / k
    t = H * np.arange(60)
    halves, phase = np.divmod(w * t, np.pi)
    turned = [0.0]  # extremes while u0 is held, about (u0 ∓ F)/k
    for n in range(8):
        centre = (u0 - F * (-1) ** n) / k
        moves = abs(u0 - k * turned[-1]) > F
        turned.append(2 * centre - turned[-1] if moves else turned[-1])
    exact = []
    for n, p in zip(halves.astype(int), phase):
        centre = (u0 - F * (-1) ** n) / k
        still = turned[n + 1] == turned[n]
        exact.append(turned[n] if still else centre + (turned[n] - centre) * np.cos(p))
    np.testing.assert_allclose(y[2:62], exact, atol=1e-6)
    assert np.ptp(y[-50:]) == 0.0 and abs(y[-1]) <= d


def test_first_order_follows_within_its_band_as_a_play_does():
    """Without inertia or viscosity to speak of, friction against a spring is a play of half width F/k."""
    t = H * np.arange(1500)
    x = 2.0 * np.sin(0.4 * t) + 0.8 * np.sin(1.3 * t)
    y = respond(Plant(1, 1e-5, 0.0, 2.0), x, rest(len(x)), H, Dynamics(drag=Friction(0.5, 0.5)))
    now, play = 0.0, []
    for value in x / 2.0:
        now = min(max(now, value - 0.25), value + 0.25)
        play.append(now)
    np.testing.assert_allclose(y, play, atol=2e-5)


def test_an_axis_under_a_staircase_of_forces_breaks_away_and_coasts_to_rest():
    """m y'' = u − c y' − F: held by the breakaway force up to 0.9, then exponentials in closed form."""
    m, c, F, more = 0.5, 0.3, 0.6, 0.3
    x = np.repeat([0.0, 0.85, 0.95, 0.2], [10, 50, 100, 300])
    y = respond(
        Plant(2, m, c, 0.0), x, rest(len(x)), H, Dynamics(drag=Friction(F, F + more)), between=Between.HELD
    )
    assert np.all(y[:61] == 0.0)
    t, tau, end = H * np.arange(101), m / c, (0.95 - F) / c
    np.testing.assert_allclose(y[60:161], end * (t - tau * (1 - np.exp(-t / tau))), atol=1e-7)
    v, brake = end * (1 - np.exp(-t[-1] / tau)), (0.2 - F) / c
    stops = tau * np.log((v - brake) / -brake)  # v decays towards `brake` and meets 0 there
    assert y[-1] == pytest.approx(
        y[160] + brake * stops + (v - brake) * tau * (1 - np.exp(-stops / tau)), abs=1e-6
    )
    assert np.ptp(y[160 + int(stops / H) + 2 :]) == 0.0


def _integrated(plant, spring, x, t):
    """Newton's and Bouc and Wen's equations by an integrator of order 8."""
    soft = spring.share * plant.k

    def slope(now, state):
        y, v, q = state
        p = q * np.sign(v)
        K = spring.loading if p > 0 else -spring.unloading
        taken = q if spring.added else q - y
        steep = 1.0 - K * abs(p) ** spring.power * spring.scale ** (1 - spring.power)
        return [v, (np.interp(now, t, x) - plant.k * y - taken * soft - plant.c * v) / plant.m, v * steep]

    how = dict(t_eval=t, method="DOP853", rtol=1e-9, atol=1e-12, max_step=H)
    return solve_ivp(slope, (0.0, t[-1]), [0.0, 0.0, 0.0], **how).y[0]


@pytest.mark.parametrize(
    "spring",
    [
        Spring(0.5, -4.0, 25.0),
        pytest.param(Spring(0.9, 6.0, 25.0), marks=pytest.mark.long),
        Spring(0.5, 4.0, 25.0, 1.5, 0.1),
        pytest.param(Spring(0.5, 1.0, 3.0, 0.8, 0.1), marks=pytest.mark.long),
        Spring(0.9, 6.0, 25.0, added=True),
    ],
)
def test_a_hysteretic_spring_against_an_integrator(spring):
    t = H * np.arange(120)
    x, plant = 2 * np.sin(3 * t) + 1.2 * np.sin(7.3 * t), Plant(2, 0.5, 0.3, 40.0)
    exact = _integrated(plant, spring, x, t)
    made = respond(plant, x, rest(len(x)), H, Dynamics(spring=spring))
    np.testing.assert_allclose(made, exact, atol=1e-6 * np.max(np.abs(exact)))
    plain = respond(plant, x, rest(len(x)), H)
    assert np.max(np.abs(made - plain)) > 0.05 * np.max(np.abs(exact))


def test_what_stands_beside_an_added_spring_is_a_share_of_the_linear_one():
    """A spring that never lets go is linear: with it, a bend and an obstacle are those of the sum."""
    x, plant = 2 * np.sin(0.1 * np.arange(400)), Plant(2, 0.5, 0.3, 40.0)
    beside = {"bend": Bend(0.5, 0.2, 0.05), "place": 0.03, "stiffness": 2.0}
    made = respond(plant, x, rest(len(x)), H, Dynamics(spring=Spring(1.0, 0.0, 0.0, added=True), **beside))
    halved = {"bend": Bend(0.25, 0.1, 0.05), "place": 0.03, "stiffness": 1.0}
    wanted = respond(replace(plant, k=80.0), x, rest(len(x)), H, Dynamics(**halved))
    np.testing.assert_allclose(made, wanted, atol=1e-4 * np.max(np.abs(wanted)))


def test_a_plant_that_only_creeps_takes_few_steps_and_comes_as_close():
    """What its mass does dies away in 3 ms; the spring follows a lag of 0.8 s."""
    t = H * np.arange(240)
    x, plant = 2 * np.sin(3 * t) + 1.2 * np.sin(7.3 * t), Plant(2, 0.1, 32.0, 40.0)
    dynamics = Dynamics(spring=Spring(0.5, 4.0, 25.0))
    exact = _integrated(plant, dynamics.spring, x, t)
    made = respond(plant, x, rest(len(x)), H, dynamics)
    np.testing.assert_allclose(made, exact, atol=1e-5 * np.max(np.abs(exact)))
    assert _levels(plant, dynamics, H)[0] < _levels(Plant(2, 0.1, 0.3, 40.0), dynamics, H)[0]


@pytest.mark.long
@pytest.mark.parametrize("rise", [Rise(0.4, 0.5), Rise(0.3, 0.004)])
def test_friction_that_rises_with_the_speed_against_an_integrator(rise):
    """It rises from nothing, so that nothing sticks."""
    t = H * np.arange(150)
    x, plant = 2 * np.sin(3 * t) + 1.2 * np.sin(7.3 * t), Plant(2, 0.5, 0.3, 40.0)

    def slope(now, state):
        y, v = state
        taken = np.sign(v) * rise.size * (1.0 - np.exp(-abs(v) / rise.speed))
        return [v, (np.interp(now, t, x) - plant.k * y - plant.c * v - taken) / plant.m]

    how = dict(t_eval=t, method="Radau", rtol=1e-9, atol=1e-12, max_step=H)
    exact = solve_ivp(slope, (0.0, t[-1]), [0.0, 0.0], **how).y[0]
    made = respond(plant, x, rest(len(x)), H, Dynamics(rise=rise))
    np.testing.assert_allclose(made, exact, atol=2e-5 * np.max(np.abs(exact)))
    assert np.max(np.abs(made - respond(plant, x, rest(len(x)), H))) > 0.01 * np.max(np.abs(exact))


RISES = [Rise(0.4, 0.5), Rise(0.1, 0.0015), Rise(-0.02, 0.01)]


@pytest.mark.parametrize(
    "rise", [Rise(0.3, 0.004), *(pytest.param(r, marks=pytest.mark.long) for r in RISES)]
)
@pytest.mark.parametrize("force", [pytest.param(0.0, marks=pytest.mark.long), 0.05])
@pytest.mark.parametrize("plant", [Plant(2, 0.05, 3.0, 20.0), Plant(2, 0.002, 0.1, 1.0)])
def test_steep_friction_on_a_light_plant_against_small_implicit_steps(plant, force, rise):
    """It stops the plant within 0.01 to 4 ms, which turns round, creeps and, with dry friction, sticks."""
    count, fine = 120, 1500
    t = H * np.arange(count)
    x = 2 * np.sin(3 * t) + 1.2 * np.sin(7.3 * t)
    # friction at the step's end, by what it is at its begin: v = (push - sign(v) (force + rise)) / (1 + ...)
    y, v, step, exact = 0.0, 0.0, H / fine, np.zeros(count)
    for i, u in enumerate(np.interp(H / fine * np.arange(1, (count - 1) * fine + 1), t, x), 1):
        left = np.exp(-abs(v) / rise.speed)
        slope = rise.size / rise.speed * left
        held = force + rise.size * (1.0 - left) - slope * abs(v)
        weight = plant.m + step * (plant.c + slope) + step * step * plant.k
        push = plant.m * v + step * (u - plant.k * y)
        v = np.sign(push) * max(0.0, abs(push) - step * held) / weight
        y += step * v
        if i % fine == 0:
            exact[i // fine] = y
    made = respond(plant, x, rest(count), H, Dynamics(drag=Friction(force, force), rise=rise))
    np.testing.assert_allclose(made, exact, atol=2e-4 * np.max(np.abs(exact)))


def test_a_spring_in_equilibrium_stays_there():
    plant, spring = Plant(2, 0.5, 0.3, 40.0), Spring(0.6, 4.0, 9.0)
    held = rest(400).copy()
    held[0] = BALANCED
    for side in (-1.0, 1.0):
        y = respond(
            plant, np.full(400, side * 3.0), held, H, Dynamics(drag=Friction(0.4, 0.4), spring=spring)
        )
        np.testing.assert_allclose(y, y[0], rtol=1e-6)
        q = (1 - np.exp(-4.0 * abs(y[0]))) / 4.0  # wound from 0 in one go
        assert 40.0 * abs(y[0]) + 24.0 * (q - abs(y[0])) == pytest.approx(2.6, rel=1e-4)


@pytest.mark.parametrize("alpha", [0.5, 0.8, 1.0])
def test_a_fractional_lag_with_friction_keeps_to_its_balance_of_forces(alpha):
    """T D^α y + y + f = x: what the response lacks of the plain one's input lies within the friction, is all
    of it against the motion, and what moves not bears any part of it."""
    t, F = H * np.arange(900), 0.3
    x = 2.0 * np.sin(0.7 * t) + 0.7 * np.sin(2.9 * t)
    n = len(x)
    y = lag(x, rest(n), H, 0.5, alpha, n * H, Dynamics(drag=Friction(F, F)))
    count = np.r_[1.0, np.cumprod(1 - (alpha + 1) / np.arange(1, n))]  # Grünwald–Letnikov: another way to D^α
    f = x - y - 0.5 * H**-alpha * np.convolve(count, y)[:n]
    way = np.diff(y, prepend=0.0)
    moves, still = np.abs(way) > 1e-3, way == 0.0
    assert still.sum() > 20 and moves.sum() > 300
    assert np.median(np.abs(f[moves] - F * np.sign(way[moves]))) < 0.02
    assert np.max(np.abs(f[still])) < F + 0.05


def test_first_order_friction_is_the_same_by_both_ways():
    t = 0.002 * np.arange(4000)
    x = 2.0 * np.sin(0.9 * t) + 0.7 * np.sin(4.1 * t)
    exact = respond(Plant(1, 0.5, 0.0, 1.0), x, rest(len(x)), 0.002, Dynamics(drag=Friction(0.3, 0.5)))
    made = lag(x, rest(len(x)), 0.002, 0.5, 1.0, 8.0, Dynamics(drag=Friction(0.3, 0.5)))
    np.testing.assert_allclose(made, exact, atol=2e-3)


@pytest.mark.parametrize("form, values", [("coulomb", (0.15,)), ("breakaway", (0.15, 0.1))])
def test_friction_of_a_spring_beside_dampers_holds_it_while_they_relax(form, values):
    """A dashpot, a spring and one more behind a dashpot of its own, in fine Euler steps of the forces."""
    D, k, soft, tau, h = 1.3, 1.0, 2.0, 1.5, 0.01
    t = np.arange(2000) * h
    u = 1.0 - np.cos(0.6 * t) + 0.3 * np.sin(3.1 * t)
    y, z, moving, made = 0.0, 0.0, False, [0.0]
    for i in range(1, len(u)):
        for j in range(100):
            push = u[i - 1] + (u[i] - u[i - 1]) * (j + 0.5) / 100 - k * y - soft * (y - z)
            speed = (
                (push - np.sign(push) * values[0]) / D
                if abs(push) > (values[0] if moving else sum(values))
                else 0.0
            )
            moving, y, z = speed != 0.0, y + h / 100 * speed, z + h / 100 * (y - z) / tau
        made.append(y)
    den = [(D * tau, 2.0), (D + k * tau + soft * tau, 1.0), (k, 0.0)]
    rig = Rig("a", h, AXIS.signals, LinearActuator(TransferFunction([(tau, 1.0), (1.0, 0.0)], den)))
    placed = (Placed("friction", form_of("friction", form), "actuator", values),)
    assert fits_in(placed[0].form, "actuator", rig)
    found = Chain(rig, placed).run(u, "regulator", "sensor", Run.of([len(u)], [0.0], h))
    np.testing.assert_allclose(found, made, atol=1e-3 * np.ptp(made))
    assert np.max(np.abs(Chain(rig).run(u, "regulator", "sensor", Run.of([len(u)], [0.0], h)) - made)) > 0.05


@pytest.mark.parametrize(
    "num, den, damped",
    [
        ((1.0, 0.5), (1.0, 3.2, 2.0), False),  # a zero slower than both poles
        ((1.0, 1.5), (1.0, 3.2, 2.0), True),
        ((1.0, 1.0), (1.0, 0.2, 1.0), False),
        ((-1.0, 1.5), (1.0, 3.2, 2.0), False),
        ((1.0, 1.5), (1.0, -3.2, 2.0), False),
        ((1.5,), (1.0, 3.2, 2.0), False),
    ],
)
def test_springs_and_dampers_have_a_zero_between_their_poles(num, den, damped):
    terms = [[(c, float(len(side) - 1 - i)) for i, c in enumerate(side)] for side in (num, den)]
    assert is_damped(TransferFunction(*terms)) == damped


def test_a_smooth_input_is_taken_as_smooth():
    """The steady response to a sine of ten samples a period is the transfer function's, to 1e-5; in straight
    lines it is 3 % off."""
    w, n = 2 * np.pi / (10 * H), 4000
    x = np.sin(w * H * np.arange(n))
    for den in ((1e-3, 0.02, 1.0), (0.05, 1.0)):
        of = transfer(1.5, *den)
        value = complex(of(np.array([1j * w]))[0])
        exact = np.imag(value * np.exp(1j * w * H * np.arange(n)))[-500:-8]
        made = linear.run(of, x, rest(n), H, n * H, Between.SMOOTH)[-500:-8]
        straight = linear.run(of, x, rest(n), H, n * H)[-500:-8]
        assert np.max(np.abs(made - exact)) < 2e-5 * abs(value)
        assert np.max(np.abs(straight - exact)) > 0.02 * abs(value)
        moved = respond(plant_of(of), x, rest(n), H, between=Between.SMOOTH)[-500:-8]
        np.testing.assert_allclose(moved, made, atol=1e-8)


def test_whole_orders_with_a_direct_path_take_a_smooth_input():
    x = np.sin(0.4 * np.arange(300)) ** 2
    of = TransferFunction([(1.0, 1.0), (2.0, 0.0)], [(0.3, 1.0), (1.0, 0.0)])
    fine = np.arange(0, 299 + 1e-9, 0.01)
    _, exact, _ = lsim(([1.0, 2.0], [0.3, 1.0]), np.sin(0.4 * fine) ** 2, fine * H, interp=True)
    made, inside = linear.run(of, x, rest(300), H, 6.0, Between.SMOOTH), slice(150, -8)  # of the log's ends
    np.testing.assert_allclose(made[inside], exact[::100][inside], atol=2e-4)


AXIS = Rig("axis", H, Signals("t", "q", "u"), LinearActuator(transfer(1.0, 0.5, 0.3, 0.0), bias=0.25))


def test_the_zero_of_the_drive_is_kept_and_used(tmp_path):
    write_rig(AXIS, tmp_path / "axis.toml")
    assert read_rig(tmp_path / "axis.toml") == AXIS
    tau, end, t = 0.5 / 0.3, 0.25 / 0.3, H * np.arange(300)
    q = end * (t - tau * (1 - np.exp(-t / tau)))  # a constant force alone moves it
    log = Experiment("drift", H, {"command": np.zeros(300), "output": q})
    found = replay(tmp_path / "axis.toml", [log])
    assert found.logs["drift"].rmse < 0.03 * q[-1]  # it comes on within the sample ahead of the first
    assert replay(Rig("axis", H, AXIS.signals, LinearActuator(AXIS.actuator.dynamics)), [log]).logs[
        "drift"
    ].rmse == pytest.approx(float(np.sqrt(np.mean(q**2))))


@pytest.mark.parametrize("way", list(Between))
def test_replay_reads_off_the_log_what_the_command_does(way):
    rng = np.random.default_rng(0)
    u = np.convolve(rng.normal(size=800), np.hanning(9), "same")
    rig = Rig("mass", H, Signals("t", "y", "u"), LinearActuator(transfer(1.0, 0.01, 0.02, 1.0)))
    y = Chain(rig).run(u, "regulator", "sensor", Run.of([800], [0.0], H), way)
    found = replay(rig, [Experiment("a", H, {"command": u, "output": y + 1e-4 * rng.normal(size=800)})])
    assert found.logs["a"].rmse < 1.2e-4


def test_what_a_plant_can_bear():
    friction, spring, speed = (
        form_of(*names)
        for names in (("friction", "coulomb"), ("hysteresis", "spring"), ("unloading_asymmetry", "speed"))
    )
    fits = {
        "axis": (True, False, False),
        "mass": (True, True, True),
        "lag": (True, False, True),
        "finger": (True, False, True),
        "third": (False, False, True),
    }
    actuators = {
        "axis": AXIS.actuator,
        "mass": LinearActuator(transfer(1.0, 0.01, 0.02, 1.0)),
        "lag": LinearActuator(transfer(1.0, 0.5, 1.0)),
        "finger": Actuator(1.3, 0.6, (0.3,)),
        "third": LinearActuator(transfer(1.0, 0.1, 0.5, 0.5, 1.0)),
    }
    for name, expected in fits.items():
        rig = Rig(name, H, AXIS.signals, actuators[name])
        assert tuple(fits_in(form, "actuator", rig) for form in (friction, spring, speed)) == expected
        assert not fits_in(friction, "sensor", rig)


def test_friction_of_a_fractional_lag_of_any_gain_is_in_the_units_of_its_input():
    """num/den of a real order: the same as the actuator with the gain ahead of the friction."""
    x = 2.0 * np.sin(0.05 * np.arange(600))
    run = Run.of([600], [0.0], H)
    given = Rig(
        "a", H, AXIS.signals, LinearActuator(TransferFunction([(4.0, 0.0)], [(0.5, 0.7), (1.0, 0.0)]))
    )
    other = Rig("b", H, AXIS.signals, Actuator(0.5, 0.7, (4.0,)))
    of = lambda force: (Placed("friction", form_of("friction", "coulomb"), "actuator", (force,)),)
    a = Chain(given, of(0.3)).run(x, "regulator", "sensor", run)
    b = Chain(other, of(1.2)).run(x, "regulator", "sensor", run)
    np.testing.assert_allclose(a, b, atol=1e-12)


def test_friction_in_a_spring_that_bends():
    """Three ways to the same: the plant's own steps, the bent filter's and the bent lag's samples."""
    h, t = 0.001, 0.001 * np.arange(6000)
    x, first = 2.0 * np.sin(3.0 * t), Run.of([6000], [0.0], 0.001).rest
    both = Dynamics(bend=Bend(0.3, 0.5, 1.0), drag=Friction(0.3, 0.4))
    of = transfer(1.0, 0.02, 0.3, 1.5)
    exact = respond(plant_of(of), x, first, h, both)
    np.testing.assert_allclose(solved.run_bent(of, x, first, h, False, both), exact, atol=3e-3)
    slow = respond(Plant(1, 0.3, 0.0, 1.0), x, first, h, both)
    np.testing.assert_allclose(lag(x, first, h, 0.3, 1.0, 6.0, both), slow, atol=3e-3)
    bent = respond(plant_of(of), x, first, h, Dynamics(bend=both.bend))
    np.testing.assert_allclose(
        solved.run_bent(of, x, first, h, False, Dynamics(bend=both.bend)), bent, atol=1e-5
    )
    assert np.max(np.abs(bent - exact)) > 0.1


def test_a_bent_spring_with_hysteresis_against_an_integrator():
    t = H * np.arange(120)
    x, plant = 2 * np.sin(3 * t) + 1.2 * np.sin(7.3 * t), Plant(2, 0.5, 0.3, 40.0)
    bend, spring = Bend(0.4, 0.6, 0.1), Spring(0.5, 4.0, 25.0)

    def slope(now, state):
        y, v, q = state
        steep = 1.0 - (4.0 if q * v > 0 else -25.0) * abs(q)
        bent = y * (bend.first * abs(y) / 0.1 + bend.second * (y / 0.1) ** 2)
        return [v, (np.interp(now, t, x) - 40 * (y + bent + 0.5 * (q - y)) - 0.3 * v) / 0.5, v * steep]

    exact = solve_ivp(
        slope, (0, t[-1]), [0, 0, 0], t_eval=t, method="DOP853", rtol=1e-9, atol=1e-12, max_step=H
    )
    made = respond(plant, x, rest(len(x)), H, Dynamics(spring=spring, bend=bend))
    assert np.max(np.abs(exact.y[0])) < 0.11  # where the spring goes on straight
    np.testing.assert_allclose(made, exact.y[0], atol=2e-6 * np.max(np.abs(exact.y[0])))


@pytest.mark.parametrize("power", [0.7, 0.97, 1.0, 1.03, 1.3, 2.0])
def test_a_rough_run_takes_longer_steps_and_comes_as_close_as_it_says(power):
    h = 5 * H
    t = h * np.arange(400)
    x, plant = 2 * np.sin(3 * t) + 1.2 * np.sin(7.3 * t), Plant(2, 0.5, 0.3, 40.0)
    dynamics = Dynamics(spring=Spring(0.5, 1.0, 3.0, power, 0.1))
    exact, rough = (respond(plant, x, rest(len(x)), h, dynamics, rough=r) for r in (False, True))
    assert 0.0 < np.max(np.abs(rough - exact)) < 1e-3 * np.max(np.abs(exact))


@pytest.mark.parametrize("speed", [2e-3, 2e-2])
def test_a_rough_run_of_friction_that_rises_steeply_is_as_close(speed):
    h = 5 * H
    t = h * np.arange(400)
    x, plant = 2 * np.sin(3 * t) + 1.2 * np.sin(7.3 * t), Plant(2, 0.05, 3.0, 20.0)
    dynamics = Dynamics(drag=Friction(0.05, 0.1), rise=Rise(0.2, speed))
    exact, rough = (respond(plant, x, rest(len(x)), h, dynamics, rough=r) for r in (False, True))
    assert np.max(np.abs(rough - exact)) < 1e-3 * np.max(np.abs(exact))
