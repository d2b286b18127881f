"""A spring that gives way while it is used, against scipy's integrator.

Red when a weaker spring does not bend further and more slowly, when what it has lost is lost between two
sessions, or when the form is offered to a rig without a spring.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from focgen.fractional.transfer import TransferFunction
from focgen.rig.changeable import fits_in
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain, Placed
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H, N = 0.01, 3000
T = H * np.arange(N)
X = np.where(T % 6.0 < 3.0, 1.0, 0.2)
RUN = Run.of([N], [0.0], H)


def made(actuator, effect, form, *values):
    left: list[dict[str, float]] = []
    placed = (Placed(effect, form_of(effect, form), "actuator", values),)
    rig = Rig("a", H, Signals("c", "y"), actuator)
    assert fits_in(placed[0].form, "actuator", rig)
    return Chain(rig, placed).run(X, "regulator", "sensor", RUN, left=left), left[0]


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
