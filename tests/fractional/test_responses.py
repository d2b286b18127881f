"""Exact responses against 40-digit series and 50-digit inverse Laplace transforms.

Red when an exact response is off in the digits that it claims.
"""

import math

import mpmath as mp
import numpy as np
import pytest

from focgen.fractional import contour
from focgen.fractional.decomposition import step_image
from focgen.fractional.responses import mittag_leffler, ramp_response, step_response
from focgen.fractional.transfer import TransferFunction
from focgen.fractional.triangular import triangular_exponential

REGULATOR = TransferFunction([(152.48, 0)], [(1, 2), (53.39, 1), (1528, 0)])
SENSOR = TransferFunction([(10, 0)], [(1, 1), (10, 0)])
ACTUATOR = TransferFunction([(1, 0)], [(1.32, 0.6), (1, 0)])
DAMPED = TransferFunction([(1, 0.4), (2, 0)], [(0.2, 1.83), (0.3, 0.41), (1, 0)])
INTEGRATOR = TransferFunction([(1, 0)], [(1, 1)])
TIMES = np.array([0.01, 0.3, 3.0, 20.0])


def lag(pole):
    return TransferFunction([(1, 0)], [(1, 1), (pole, 0)])


CASES = {
    "actuator": ACTUATOR,
    "chain": REGULATOR * ACTUATOR * SENSOR,
    "two terms of odd orders": DAMPED,
    "double pole off the axis": DAMPED * DAMPED,
    "two double poles": REGULATOR * DAMPED * REGULATOR * DAMPED,
    "double pole on the cut": SENSOR * SENSOR * ACTUATOR,
    "integrator": ACTUATOR * INTEGRATOR,
    "integrator of order 0.6 with feedthrough": TransferFunction([(1, 0.6), (2, 0)], [(1, 0.6)]),
    "lightly damped": TransferFunction([(1, 0)], [(1, 2), (1e-3, 0.5), (1, 0)]),
    "unstable": TransferFunction([(1, 0)], [(1, 0.8), (-0.2, 0.31), (-1, 0)]),
    "double pole to the right of the cut": lag(-0.5) * lag(-0.5) * ACTUATOR,
    "whole: slow real poles": lag(1) * lag(0.01) * lag(1e-3) * TransferFunction([(1, 2), (3, 1), (1, 0)]),
    "whole: a lag next to an integrator": TransferFunction([(1, 0)], [(1, 2), (1e-8, 1)]),
    "whole: five poles nearly coincide": lag(2) * lag(2) * lag(2) * lag(2.001) * lag(2.1),
    "whole: stiff": TransferFunction([(1, 1), (1, 0)], [(1, 2), (1000.01, 1), (10, 0)]),
    "whole: regulator": REGULATOR,
    "whole: unstable": TransferFunction([(1, 1)], [(1, 2), (-0.2, 1), (4, 0)]),
}


def inverse_laplace_truth(transfer, times):
    """Talbot's contour in many digits, wide enough to hold every pole of the cases at these times."""
    with mp.workdps(60):
        num = [(mp.mpf(t.coefficient), mp.mpf(t.order)) for t in transfer.num]
        den = [(mp.mpf(t.coefficient), mp.mpf(t.order)) for t in transfer.den]

        def image(s):
            log = mp.log(s)
            top, bottom = (mp.fsum(c * mp.exp(o * log) for c, o in terms) for terms in (num, den))
            return top / bottom / s

        values = [mp.invertlaplace(image, mp.mpf(t), method="talbot", degree=120) for t in times]
        return np.array(values, dtype=float)


@pytest.mark.parametrize("name", CASES)
def test_step_response_is_exact(name):
    truth = inverse_laplace_truth(CASES[name], TIMES)
    assert np.max(np.abs(step_response(CASES[name], TIMES) - truth)) < 5e-13 * np.max(np.abs(truth))


def mittag_leffler_truth(alpha, beta, z):
    size = abs(z) ** (1 / alpha)
    with mp.workdps(30 + int(size / 2)):
        a, b, x = mp.mpf(alpha), mp.mpf(beta), mp.mpf(z)
        terms = int((size * 3 + 60) / alpha)
        return float(mp.fsum(x**k * mp.rgamma(a * k + b) for k in range(terms)))


@pytest.mark.parametrize("alpha", [0.2, 0.6, 0.95, 1.0, 1.04, 1.2, 1.7, 1.99, 2.0, 2.5])
@pytest.mark.parametrize("beta", [1.0, 0.5, 1.6])
def test_mittag_leffler_is_its_series(alpha, beta):
    z = np.array([0.0, -1e-3, -0.5, -1.0, -2.2, 1.5])
    truth = np.array([mittag_leffler_truth(alpha, beta, x) for x in z])
    assert np.max(np.abs(mittag_leffler(alpha, beta, z) - truth) / np.maximum(1, np.abs(truth))) < 1e-12


def test_mittag_leffler_far_out():
    """E_{1/2}(−z) = exp(z²) erfc(z), and the algebraic decay 1/(z Γ(β−α)) where series are hopeless."""
    with mp.workdps(30):
        truth = [float(mp.exp(mp.mpf(z) ** 2) * mp.erfc(z)) for z in (3, 30, 1000)]
    assert mittag_leffler(0.5, 1.0, [-3.0, -30.0, -1000.0]) == pytest.approx(truth, rel=1e-11)
    assert mittag_leffler(1.0, 1.0, -3.0) == pytest.approx(math.exp(-3), rel=1e-11)
    assert mittag_leffler(2.0, 1.0, -9e4) == pytest.approx(math.cos(300), abs=1e-11)


def test_step_response_of_the_paper_is_mittag_leffler():
    t = np.geomspace(1e-4, 1e4, 60)
    truth = 1 - mittag_leffler(0.6, 1.0, -(t**0.6) / 1.32)
    assert np.max(np.abs(step_response(ACTUATOR, t) - truth)) < 1e-12


def test_ramp_response_integrates_the_step_response():
    gauss, weights = np.polynomial.legendre.leggauss(60)
    edges = np.concatenate([[0.0], np.geomspace(1e-12, 3.0, 40)])
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    times = middle[:, None] + half[:, None] * gauss
    integral = np.sum(half[:, None] * weights * step_response(DAMPED, times.ravel()).reshape(times.shape))
    assert float(ramp_response(DAMPED, 3.0)) == pytest.approx(integral, rel=1e-11)


def test_before_and_at_the_step():
    lead = TransferFunction([(3, 0.6), (1, 0)], [(2, 0.6), (1, 0)])
    assert step_response(lead, [-1.0, 0.0]).tolist() == [0.0, 1.5]
    assert step_response(TransferFunction([]), [0.0, 1.0]).tolist() == [0.0, 0.0]
    assert step_response(TransferFunction([(2.5, 0)]), [0.0, 1.0, 9.0]) == pytest.approx([2.5] * 3, rel=1e-14)


def test_common_powers_of_s_cancel():
    derivative_free = TransferFunction([(1, 1.6)], [(1.32, 2.2), (1, 1.6)])
    t = np.geomspace(0.01, 20, 9)
    assert step_response(derivative_free, t) == pytest.approx(step_response(ACTUATOR, t), rel=1e-12)


def test_improper_is_refused():
    with pytest.raises(ValueError, match="numerator has order 1.2, its denominator 0.6"):
        step_response(TransferFunction([(1, 1.2)], [(1, 0.6), (1, 0)]), [1.0])


@pytest.mark.parametrize("node", [0, 3, 8, 12])
@pytest.mark.parametrize("nodes", [contour._MIDDLE, contour._SHIFTED])
def test_a_removed_pole_on_the_contour_does_no_harm(nodes, node):
    """What is left of 1/(s − p)² + 1/(s + 1) without its double pole, p·t next to a point of the contour."""
    pole = nodes[0][node] * (1 + 1e-6j)
    removed = np.array([pole, pole.conjugate()])

    def double(s):
        return 1 / (s - pole) ** 2 + 1 / (s - pole.conjugate()) ** 2

    left = contour.inverse_laplace(lambda s: (double(s) + 1 / (s + 1)) - double(s), np.ones(1), removed)
    assert left[0] == pytest.approx(math.exp(-1), abs=2e-12)


def test_poles_that_meet_share_a_chain():
    chains = step_image(DAMPED * DAMPED, 20.0).chains
    assert [len(chain.poles) for chain in chains] == [2]


@pytest.mark.parametrize("gap", [0.0, 1e-10, 1e-6, 1e-2, 0.5, 2.0])
@pytest.mark.parametrize("t", [0.1, 0.3, 3.0, 40.0])
def test_triangular_exponential_where_eigenvalues_nearly_meet(gap, t):
    poles = np.array([-0.77 + 2.759j, -0.77 + 2.759j + gap * (-1 + 0.5j), -0.77 + 2.759j])
    matrix = (np.diag(poles) + np.eye(3, k=1)) * t
    with mp.workdps(60):
        exact = mp.matrix(3, 3)
        for i in range(3):
            for j in range(3):
                exact[i, j] = mp.mpc(complex(matrix[i, j]))
        truth = np.array(mp.expm(exact).tolist(), dtype=complex)
    error = np.abs(triangular_exponential(matrix[None])[0] - truth)
    assert np.max(error[np.triu_indices(3)] / np.abs(truth[np.triu_indices(3)])) < 2e-13
