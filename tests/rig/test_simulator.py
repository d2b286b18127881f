"""The compiled chain against independent truth: Laplace inversion, scipy, and hand-made loops.

Red when the compiled chain departs from the exact response.
"""

from dataclasses import replace
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import lsim

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import kernels, lags, linear
from focgen.rig.changeable import fits_in
from focgen.rig.dynamics import Dynamics
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.modes import respond
from focgen.rig.placed import Placed
from focgen.rig.replay import effect_tables, placed_in
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals


def rest(*lengths):
    return Run.of(lengths, [0.0] * len(lengths), 1.0).rest


def ramp_response(transfer, t, h, degree=24):
    """The exact response at t to a step that takes the time h to rise, by inversion of its Laplace
    transform; what rings on for long needs a higher ``degree``.
    """
    f = lambda s: transfer(s) / s**2 * (1 - mpmath.exp(-s * h)) / h
    return float(mpmath.invertlaplace(f, t, method="talbot", degree=degree))


@pytest.mark.parametrize(
    "T, alpha", [(1.32, 0.6), (1.0, 0.3), (2.0, 0.9), (2.0, 1.0), (2.0, 1.04), (1.0, 1.6), (50.0, 0.5)]
)
def test_fractional_lag_from_the_first_sample_to_the_last(T, alpha):
    h, n = 0.02, 20_000
    x = np.r_[0.0, np.ones(n)]
    y = respond(x, rest(n + 1), h, T, alpha, n * h)
    for k in (5, 50, 500, 20_000):
        exact = ramp_response(lambda s: 1 / (T * s**alpha + 1), k * h, h) if k < 500 else None
        if exact is None:  # the rise no longer matters: a step half a sample earlier, to h²
            exact = float(
                mpmath.invertlaplace(lambda s: 1 / (s * (T * s**alpha + 1)), (k - 0.5) * h, method="talbot")
            )
        assert abs(y[k] - exact) < 3e-5


def test_initial_rest_leaves_no_trace():
    y = respond(np.r_[np.zeros(5000), np.ones(5000)], rest(10_000), 0.01, 1.32, 0.6, 100.0)
    z = respond(np.r_[0.0, np.ones(4999)], rest(5000), 0.01, 1.32, 0.6, 100.0)
    np.testing.assert_array_equal(y[:5000], 0.0)
    np.testing.assert_allclose(y[4999:9999], z, atol=1e-12)


@pytest.mark.parametrize(
    "num, den",
    [([3.0], [0.2, 1.0]), ([152.48], [1, 53.39, 1528]), ([1, 2], [1, 2, 1]), ([2, 1, 3], [1, 2, 5])],
)
def test_whole_orders_agree_with_scipy(num, den):
    h, n = 0.03, 400
    x = np.random.default_rng(3).normal(size=n)
    x[0] = 0.0
    transfer = TransferFunction(
        [(c, len(num) - 1 - i) for i, c in enumerate(num)], [(c, len(den) - 1 - i) for i, c in enumerate(den)]
    )
    _, exact, _ = lsim((num, den), x, np.arange(n) * h, interp=True)
    np.testing.assert_allclose(linear.run(transfer, x, rest(n), h, n * h), exact, atol=1e-9)


def test_general_fractional_transfer_function():
    transfer = TransferFunction([(1.0, 0.0)], [(1.0, 1.5), (0.8, 0.7), (1.0, 0.0)])
    h, n = 0.05, 400
    y = linear.run(transfer, np.r_[0.0, np.ones(n)], rest(n + 1), h, n * h)
    for k in (10, 40, 200, 400):
        exact = float(
            mpmath.invertlaplace(
                lambda s: 1 / (s * (s**1.5 + 0.8 * s**0.7 + 1)), (k - 0.5) * h, method="talbot"
            )
        )
        assert abs(y[k] - exact) < 2e-3


def test_each_experiment_starts_at_rest_and_history_carries_on():
    rig = Rig("r", 0.05, Signals("t", "y", "u"), Actuator(1.0, 0.7, (2.0,)))
    u = np.r_[np.zeros(5), np.ones(100)]
    both, one = Run.of([105, 105], [0.0, 50.0], 0.05), Run.of([105], [0.0], 0.05)
    plain = Chain(rig).run(np.r_[u, u], "regulator", "sensor", both)
    np.testing.assert_allclose(plain[105:], Chain(rig).run(u, "regulator", "sensor", one), atol=1e-12)
    soft = Placed("softening", form_of("softening", "largest"), "actuator", (0.3, 2.0))
    y = Chain(rig, (soft,)).run(np.r_[u, 0.5 * u], "regulator", "sensor", both)
    fresh = Chain(rig, (soft,)).run(0.5 * u, "regulator", "sensor", one)
    assert y[-1] > 1.1 * fresh[-1]


def test_two_forms_of_one_family_carry_on_each_its_own_history():
    """A later session equals the second half of one long one, and one form's memory is not the other's."""
    rig = Rig("r", 0.05, Signals("t", "y", "u"), Actuator(1.0, 0.7, (2.0,)))
    u = np.r_[np.zeros(5), np.ones(100)]
    both, one = Run.of([105, 105], [0.0, 50.0], 0.05), Run.of([105], [0.0], 0.05)
    placed = tuple(
        Placed("softening", form_of("softening", name), "actuator", (0.3, 2.0))
        for name in ("work", "saturating")
    )
    whole = Chain(rig, placed).run(np.r_[u, 0.5 * u], "regulator", "sensor", both)
    left = []
    Chain(rig, placed).run(u, "regulator", "sensor", one, left=left)
    assert [list(memory) for memory in left] == [["work"], ["largest"]]
    rig = replace(rig, effects=effect_tables(placed, left, 50.0))
    later = Chain(rig, placed_in(rig)).run(0.5 * u, "regulator", "sensor", one)
    np.testing.assert_allclose(later, whole[105:], rtol=1e-12)


def test_a_pressed_play_against_tension_over_a_drum():
    """Capstan: what is held on the far side lies between 0.7 and 1.3 of the pull, beside an even drag."""
    x = np.abs(np.cumsum(np.random.default_rng(1).normal(size=500)))
    held, expected = 0.0, []
    for pull in x:
        held = min(max(held, 0.7 * pull - 0.2), 1.3 * pull + 0.2)
        expected.append(held)
    np.testing.assert_allclose(kernels.pressed(x, rest(500), 0.2, 0.3), expected, rtol=1e-12)
    np.testing.assert_array_equal(kernels.pressed(x, rest(500), 0.7, 0.0), kernels.play(x, rest(500), 0.7))


def test_play_against_a_loop_in_python():
    x = np.cumsum(np.random.default_rng(0).normal(size=500))
    now, expected = 0.0, []
    for value in x:
        now = min(max(now, value - 0.7), value + 0.7)
        expected.append(now)
    np.testing.assert_array_equal(kernels.play(x, rest(500), 0.7), expected)


def test_a_spline_is_what_scipy_makes_of_it_and_level_beyond():
    knots, sizes = np.linspace(0.0, 1.0, 6), np.random.default_rng(4).normal(size=6)
    of = CubicSpline(knots, sizes, bc_type="natural")
    x = np.r_[knots, np.linspace(-0.1, 1.0, 400), np.nextafter(1.0, [0.0, 2.0])]
    assert np.allclose(kernels.spline(x, of.c), of(x), rtol=0.0, atol=1e-13)
    beyond = kernels.spline(np.array([1.3, np.inf, np.nan]), of.c)
    assert np.allclose(beyond[:2], sizes[-1]) and np.isnan(beyond[2])


def test_bouc_wen_loop_does_not_vanish_with_frequency():
    areas = []
    for n in (400, 4000):
        x = np.sin(np.linspace(0, 6 * np.pi, n))
        z = kernels.bouc_wen(x, rest(n), 0.1)
        last = slice(2 * n // 3, n)
        areas.append(abs(np.trapezoid(z[last], x[last])))
    assert areas[0] > 2.0 and abs(areas[0] / areas[1] - 1) < 0.1


def test_bouc_wen_is_what_its_equation_makes_in_small_steps():
    x = 0.3 * np.cumsum(np.random.default_rng(1).normal(size=200))
    z, now, expected = kernels.bouc_wen(x, rest(200), 0.8), 0.0, []
    for move in np.diff(x, prepend=0.0):
        for d in [move / 0.8 / 2000] * 2000:
            now += d * (1.0 - abs(now) * (0.5 * np.sign(now * d) + 0.5))
        expected.append(now)
    np.testing.assert_allclose(z, expected, atol=1e-3)


@pytest.mark.parametrize("power", [1.05, 2.0, 5.0])
def test_power_creep_against_an_integrator(power):
    h, tau, scale = 0.05, 3.0, 1.7
    x = np.interp(np.arange(600), [3, 13, 200, 220, 500, 510], [0.0, 1.5, 1.5, 0.2, 0.2, -0.8])
    z = kernels.power_creep(x, rest(600), h, tau, scale, power)

    def rate(t, z):
        e = (np.interp(t, h * np.arange(600), x) - z) / scale
        return np.sign(e) * scale / tau * np.abs(e) ** power

    found = solve_ivp(rate, (0.0, 599 * h), [0.0], t_eval=h * np.arange(600), rtol=1e-9, max_step=h)
    np.testing.assert_allclose(z, found.y[0], atol=2e-3)
    again = kernels.power_creep(np.r_[x, x], rest(600, 600), h, tau, scale, power)
    np.testing.assert_array_equal(again[600:], z)


@pytest.mark.parametrize("alpha", [0.4, 0.7, 1.0, 1.3])
def test_an_obstacle_at_rest_makes_a_stiffer_lag(alpha):
    """T D^α y + (1 + s) y = x is a lag of T/(1 + s)."""
    rng = np.random.default_rng(3)
    x = np.convolve(np.abs(np.cumsum(rng.normal(0, 0.1, 800))), np.ones(9) / 9, "same") + 0.1
    T, s = 1.3, 2.5
    pushed = respond(x, rest(800), 0.02, T, alpha, 16.0, Dynamics(stiffness=s))
    stiff = respond(x / (1 + s), rest(800), 0.02, T / (1 + s), alpha, 16.0)
    assert np.all(stiff > 0)
    np.testing.assert_allclose(pushed, stiff, atol=2e-3 * np.max(stiff))


def test_an_obstacle_pushes_the_lag_itself():
    h, n, T, place, s = 0.005, 3000, 0.8, 0.5, 3.0
    t = h * np.arange(n)
    load = lambda t: 0.9 - 0.9 * np.cos(2 * np.pi * t / 5.0)
    slope = lambda t, y: (load(t) - y - s * max(y[0] - place, 0.0)) / T
    exact = solve_ivp(slope, (0, t[-1]), [0.0], t_eval=t, rtol=1e-9, atol=1e-9, max_step=0.02).y[0]
    made = respond(load(t), rest(n), h, T, 1.0, n * h, Dynamics(place=place, stiffness=s))
    assert exact.max() > place + 0.1 and exact.min() < place
    np.testing.assert_allclose(made, exact, atol=1e-3)


def test_unloading_speed_acts_only_when_unloading():
    x = np.r_[0.0, np.ones(200), np.zeros(200)]
    slow = respond(x, rest(401), 0.05, 1.0, 0.8, 20.0, Dynamics(unloading=0.5))
    plain = respond(x, rest(401), 0.05, 1.0, 0.8, 20.0)
    np.testing.assert_allclose(slow[:200], plain[:200], atol=1e-12)
    assert np.all(slow[205:300] > plain[205:300] + 0.01)


PARALLEL = TransferFunction([(0.5 * 0.9 + 1.5 * 0.2, 1.0), (2.0, 0.0)], [(0.18, 2.0), (1.1, 1.0), (1.0, 0.0)])


def test_chambers_side_by_side_run_at_another_pace_each_way():
    """0.5/(0.2 s + 1) + 1.5/(0.9 s + 1), all of it slower while the load falls short of the response, against
    Euler steps of a hundredth of a sample."""
    t, fine = np.arange(800) * 0.02, 100
    load = 1.0 - np.cos(2.0 * np.pi * t / 4.0) + 0.5 * (t > 8.0)
    parts, exact = [0.0, 0.0], [0.0]
    for before, after in pairwise(load):
        for i in range(fine):
            x = before + (after - before) * (i + 0.5) / fine
            speed = 0.6 if abs(x) < abs(sum(parts)) / 2.0 else 1.0
            parts = [
                y + 0.02 / fine * speed * (gain * x - y) / T
                for y, gain, T in zip(parts, (0.5, 1.5), (0.2, 0.9))
            ]
        exact.append(sum(parts))
    made = lags.run_paces(PARALLEL, load, rest(800), 0.02, (1.0, 0.6))
    even = linear.run(PARALLEL, load, rest(800), 0.02, 16.0)
    change = np.max(np.abs(even - exact))
    assert change > 0.1
    assert np.max(np.abs(made - exact)) < 0.05 * change


def test_which_plants_have_a_pace_each_way():
    speed = form_of("unloading_asymmetry", "speed")
    lead, unstable = ([(0.3, 1.0), (2.0, 0.0)], [(0.18, 2.0), (-1.1, 1.0), (1.0, 0.0)])
    swings = [(0.01, 4.0), (0.05, 3.0), (1.0, 2.0), (0.3, 1.0), (1.0, 0.0)]
    fits = lambda tf: fits_in(speed, "actuator", Rig("r", 0.02, Signals("t", "y", "u"), LinearActuator(tf)))
    assert fits(PARALLEL)
    assert not fits(TransferFunction(lead, unstable))
    assert not fits(TransferFunction(lead, swings))  # two pairs
    assert not fits(TransferFunction(lead, [(1.0, 2.0), (2.0, 1.0), (1.0, 0.0)]))  # two of one time


def test_a_fit_that_makes_two_lags_swing_finds_no_gap_there():
    """Two lags of nearly one time, and a pair that swings a little: what the parts do together is the
    same."""
    u = np.repeat([0.0, 1.0, 0.2, 0.7], 100)
    for damping in (1.001, 1.0, 0.999, 0.8):
        transfer = TransferFunction([(2.0, 0)], [(0.09, 2), (0.6 * damping, 1), (1.0, 0)])
        ahead, chamber = lags.parted(transfer)
        direct, parted = (linear.run(t, u, rest(400), 0.02, 8.0) for t in (transfer, ahead * chamber))
        np.testing.assert_allclose(parted, direct, atol=1e-6)


@pytest.mark.parametrize("T", [1e-9, 0.01, 3.0])
def test_a_throat_empties_a_chamber_to_the_last(T):
    """In samples of many lags and of a sixtieth of one, for long: nothing left is too small, or too quick."""
    u = np.r_[np.zeros(3), np.ones(50), np.zeros(6000)]
    rig = Rig(
        "valve", 0.05, Signals("u", "p"), None, regulator=TransferFunction([(1.0, 0)], [(T, 1), (1, 0)])
    )
    placed = Placed("valve_asymmetry", form_of("valve_asymmetry", "throats"), "regulator", (1.0, 0.5, 0.3))
    y = Chain(rig, (placed,)).run(u, "regulator", "regulator", Run.of([len(u)], [0.0], 0.05), Between.HELD)
    assert np.all(np.isfinite(y)) and np.all(np.diff(y[54:]) <= 0.0) and 0.0 <= y[-1] < 1e-9


def test_a_tank_gives_what_it_has_and_a_pump_refills_it():
    """As two volumes with a wide valve between them, in steps of a millisecond. The valve opens while more is
    asked for than there is, and the tank has more; it vents to what is asked for."""
    h, full, draw, refill, fine = 0.05, 2.0, 0.4, 0.15, 50
    u = np.repeat([0.0, 1.5, 2.5, 0.5, 1.9, 0.0, 2.5], 80)
    exact, p, tank = [], 0.0, full
    for asked in u:
        for _ in range(fine):
            flow = max(min(400.0 * min(asked - p, tank - p), (asked - p) * fine / h), 0.0)
            p, tank = p + flow * h / fine, min(tank + (refill - draw * flow) * h / fine, full)
            p = min(p, asked)
        exact.append(p)
    placed = Placed(
        "supply_saturation", form_of("supply_saturation", "drawn"), "regulator", (full, draw, refill)
    )
    rig, run = Rig("tank", h, Signals("u", "p"), None), Run.of([len(u)], [0.0], h)
    made = Chain(rig, (placed,)).run(u, "regulator", "regulator", run, Between.HELD)
    np.testing.assert_allclose(made, exact, atol=0.01)
    assert made[161] < 0.97 * full < made[239] <= full  # it sags, and comes back


def test_a_highest_rate_holds_beside_whatever_else_a_lag_has():
    """In its equation alone or at another pace; behind it, where friction is in the equation, too."""
    h, u = 0.05, np.repeat([0.0, 5.0, 2.0, 6.0], 100)
    lag = LinearActuator(TransferFunction([(1.0, 0)], [(0.4, 1), (1, 0)]))
    rig, run = Rig("servo", h, Signals("u", "y"), lag), Run.of([len(u)], [0.0], h)
    limit = Placed("flow_limit", form_of("flow_limit", "choked"), "actuator", (2.0,))
    pace = Placed("unloading_asymmetry", form_of("unloading_asymmetry", "speed"), "actuator", (0.3,))
    rough = Placed("friction", form_of("friction", "coulomb"), "actuator", (0.5,))
    alone, paced, rubbed = (
        Chain(rig, placed).run(u, "actuator", "actuator", run)
        for placed in ((limit,), (limit, pace), (limit, rough))
    )
    for y in (alone, paced, rubbed):
        assert np.max(np.abs(np.diff(y))) <= 2.0 * h * (1 + 1e-9)
    assert alone[199] == pytest.approx(5.0, abs=1e-3) and rubbed[199] == pytest.approx(4.5, abs=1e-3)
    assert paced[280] > alone[280] + 0.01


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_regulator_fills_from_no_more_than_its_supply(sign):
    h, order = 0.05, TransferFunction([(sign * 0.3, 0)], [(0.01, 2), (0.2, 1), (1, 0)])
    u = np.repeat([0.0, 5.0, 2.0, 6.0], 100)
    rig, run = Rig("valve", h, Signals("u", "p"), None, regulator=order), Run.of([len(u)], [0.0], h)
    placed = Placed("supply_saturation", form_of("supply_saturation", "fed"), "regulator", (0.9,))
    made = Chain(rig, (placed,)).run(sign * u, "regulator", "regulator", run)
    asked = Chain(rig).run(sign * np.minimum(u, 3.0), "regulator", "regulator", run)
    np.testing.assert_array_equal(made, asked)
    assert made.max() == pytest.approx(0.9, abs=0.02)


def test_a_curve_drawn_through_points_is_the_natural_spline():
    form = form_of("gain_nonlinearity", "spline")
    sizes, x = (0.1, -0.2, 0.3, 0.05, 0.4), np.linspace(0.0, 3.0, 61)
    spline = CubicSpline(np.linspace(0.0, 2.0, 6), [0.0, *sizes], bc_type="natural")
    exact = x * (1.0 + spline(np.minimum(x, 2.0)))
    assert form.act(x, (*sizes, 2.0), None) == pytest.approx(exact, abs=1e-12)


def test_a_curve_of_what_has_diverged_is_no_number():
    """A plant may diverge at values that a fit tries, and the trial is then worse than any."""
    made = form_of("gain_nonlinearity", "spline").act(np.array([0.5, np.nan]), (0.1,) * 5 + (1.0,), None)
    assert np.isfinite(made[0]) and np.isnan(made[1])


def test_softening_along_a_curve_keeps_to_the_largest_load():
    form = form_of("softening", "spline")
    x = np.array([0.0, 0.5, 1.0, 0.5, 1.0])
    run = Run.of([len(x)], [0.0], 1.0)
    y = form.act(x, (0.2, 0.4, 0.6, 0.8, 1.0, 1.0), run)
    assert y[3] > y[1] and y[4] == y[2] == pytest.approx(2.0)
    assert form.leaves(x, (), run) == {"largest": 1.0}
