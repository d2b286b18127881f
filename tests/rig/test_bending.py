"""A spring whose stiffness depends on the response, in the plant's own equation, against other solvers.

Red when a bending spring departs from another solver.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import gamma

from focgen.fractional.transfer import TransferFunction
from focgen.rig.changeable import fits_in
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H, N = 0.01, 900
RUN = Run.of([N], [0.0], H)
T = np.arange(N) * H
X = np.interp(T, [0, 1, 2, 4, 5, 9], [0.0, 0.0, 0.9, 0.2, 1.0, 0.0])
FORM = form_of("gain_nonlinearity", "bent_spring")
VALUES = (0.4, 1.5, 0.8)  # first, second, scale
FIRST = LinearActuator(TransferFunction([(2.0, 0.0)], [(0.5, 1.0), (1.0, 0.0)]))
SECOND = LinearActuator(TransferFunction([(3.0, 0.0)], [(0.02, 2.0), (0.4, 1.0), (2.0, 0.0)]))


def rig_of(actuator) -> Rig:
    return Rig("bench", H, Signals("t", "y", command="u"), actuator)


def made_by(actuator, x=X, run=RUN, values=VALUES, held=False):
    placed = (Placed("gain_nonlinearity", FORM, "actuator", values),)
    return Chain(rig_of(actuator), placed).run(x, "actuator", "actuator", run, held)


def spring(y):
    first, second, scale = VALUES
    q = np.abs(y) / scale
    return y * (1.0 + first * q + second * q**2)


def test_a_first_order_plant_solves_its_own_equation():
    for actuator in (FIRST, Actuator(0.5, 1.0, (2.0,))):
        exact = solve_ivp(
            lambda t, y: (2.0 * np.interp(t, T, X) - spring(y)) / 0.5,
            (0, T[-1]),
            [0.0],
            t_eval=T,
            max_step=H / 4,
        ).y[0]
        np.testing.assert_allclose(made_by(actuator), exact, atol=2e-4)


@pytest.mark.parametrize("power", [0.5, pytest.param(1.7, marks=pytest.mark.long)])
def test_what_goes_with_a_power_of_the_level_solves_its_own_equation(power):
    """A share of 0.7 flows out as level**power, 2 in full: from empty, to full, and to empty again."""
    x = np.interp(T, [0, 1, 2, 4, 5, 6], [0.0, 0.0, 0.9, 0.2, 1.0, 0.0])

    def slope(t, y):
        q = np.maximum(y, 0.0) / 2.0
        return (2.0 * np.interp(t, T, x) - 0.3 * y - 0.7 * 2.0 * q**power) / 0.5

    exact = solve_ivp(slope, (0, T[-1]), [0.0], t_eval=T, max_step=H / 20, rtol=1e-8, atol=1e-10).y[0]
    form = form_of("gain_nonlinearity", "power")
    placed = (Placed("gain_nonlinearity", form, "actuator", (0.7, power, 2.0)),)
    for actuator in (FIRST, Actuator(0.5, 1.0, (2.0,))):
        made = Chain(rig_of(actuator), placed).run(x, "actuator", "actuator", RUN)
        np.testing.assert_allclose(made, exact, atol=2e-3)
    assert not fits_in(form, "actuator", rig_of(SECOND))


def test_a_second_order_plant_solves_its_own_equation():
    def slope(t, s):
        return s[1], (3.0 * np.interp(t, T, X) - 0.4 * s[1] - 2.0 * spring(s[0])) / 0.02

    exact = solve_ivp(slope, (0, T[-1]), [0.0, 0.0], t_eval=T, max_step=H / 10, rtol=1e-8).y[0]
    np.testing.assert_allclose(made_by(SECOND), exact, atol=1e-3)


def test_a_fractional_plant_solves_its_own_equation():
    alpha, time, fine = 0.6, 0.7, 5
    h, n = H / fine, 500 * fine
    x = np.interp(np.arange(n) * h, T, X)
    weight = np.diff(np.arange(n + 1.0) ** (1 - alpha)) * time * h**-alpha / gamma(2 - alpha)  # L1 scheme
    y = np.zeros(n)
    for k in range(1, n):
        past = weight[k - 1] * y[0] + np.dot(weight[: k - 1] - weight[1:k], y[k - 1 : 0 : -1])
        now = y[k - 1]
        for _ in range(30):
            step = 1e-6
            miss = weight[0] * now - past + spring(now) - x[k]
            now -= miss / (weight[0] + (spring(now + step) - spring(now)) / step)
        y[k] = now
    made = made_by(Actuator(time, alpha, (1.0,)))[:500]
    np.testing.assert_allclose(made, y[::fine], atol=2e-3)


@pytest.mark.parametrize("actuator", [FIRST, SECOND, Actuator(0.5, 0.7, (2.0,))])
def test_it_settles_where_the_spring_holds_the_load_and_stays_in_equilibrium(actuator):
    rest = RUN.rest.copy()
    rest[0] = BALANCED
    held = made_by(actuator, np.full(N, 0.6), replace(RUN, rest=rest))
    gain = actuator.K(0.0) if isinstance(actuator, Actuator) else actuator.dynamics.dc_gain
    np.testing.assert_allclose(spring(held), 0.6 * gain, rtol=2e-3)
    np.testing.assert_allclose(held, held[0], rtol=1e-5)


def test_a_straight_spring_is_the_nominal_plant():
    for actuator in (FIRST, SECOND, Actuator(0.5, 0.7, (2.0,))):
        nominal = Chain(rig_of(actuator)).run(X, "actuator", "actuator", RUN, True)
        np.testing.assert_allclose(made_by(actuator, values=(0.0, 0.0, 1.0), held=True), nominal, atol=1e-9)


def test_only_what_a_spring_holds_has_one_that_bends():
    zero = LinearActuator(TransferFunction([(1.0, 1.0), (1.0, 0.0)], [(0.1, 2.0), (1.0, 1.0), (1.0, 0.0)]))
    free = LinearActuator(TransferFunction([(1.0, 0.0)], [(1.0, 2.0), (1.0, 1.0)]))
    wall = form_of("contact", "spring")
    for form in (FORM, wall, form_of("softening", "worn")):
        assert fits_in(form, "actuator", rig_of(SECOND))
        assert not fits_in(form, "actuator", rig_of(zero)) and not fits_in(form, "actuator", rig_of(free))


@pytest.mark.parametrize("actuator", [FIRST, SECOND, Actuator(0.5, 0.7, (2.0,))])
def test_a_spring_that_gives_way_does_not_run_away(actuator):
    made = made_by(actuator, 3.0 * X, values=(-0.45, -0.3, 0.8))
    assert np.all(np.isfinite(made)) and np.max(np.abs(made)) < 30.0
