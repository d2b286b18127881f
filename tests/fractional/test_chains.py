"""Chains of first-order lags, the contour and the grid in log t, against many digits and closed forms.

Red when a chain, a mean over a step or an inverse transform is off in the digits that it claims.
"""

import math
import tracemalloc

import mpmath as mp
import numpy as np
import pytest

from focgen.fractional import contour, loggrid
from focgen.fractional.contour import inverse_laplace
from focgen.fractional.decomposition import dense, step_image
from focgen.fractional.delay import Delayed, split_delay
from focgen.fractional.loggrid import LogGrid, log_grid
from focgen.fractional.modes import Chain, polar_part
from focgen.fractional.responses import step_response
from focgen.fractional.simulation import Convolution, _later
from focgen.fractional.transfer import Term, TransferFunction
from focgen.fractional.triangular import triangular_exponential

CHAINS = {
    "one": Chain(np.array([-0.7 + 0j]), np.array([1.3 + 0j]), 1.0),
    "one at rest": Chain(np.array([0j]), np.array([0.4 + 0j]), 1.0),
    "one and its conjugate": Chain(np.array([-0.7 + 2j]), np.array([1.3 - 0.4j]), 2.0),
    "two": Chain(np.array([-0.7, -0.70001], complex), np.array([0.3, -1.1], complex), 1.0),
    "three that meet": Chain(np.full(3, -0.2 + 0j), np.array([0.3, -1.1, 0.5], complex), 1.0),
    "two pairs": Chain(np.array([-0.1 + 3j, -0.1 + 3.0001j]), np.array([0.3 + 1j, -1.1 + 0.2j]), 2.0),
    "growing": Chain(np.array([0.3, 0.301], complex), np.array([0.3, 0.5], complex), 1.0),
}


def exactly(chain, t):
    """The time function and its integral from 0, by the matrix of the lags with one more that integrates."""
    m = len(chain.poles)
    with mp.workdps(40):
        matrix = mp.matrix(m + 1, m + 1)
        for i, pole in enumerate(chain.poles.tolist()):
            matrix[i, i] = mp.mpc(pole)
            if i + 1 < m:
                matrix[i, i + 1] = 1
            matrix[m, i] = mp.mpc(complex(chain.gammas[i]))
        whole = mp.expm(matrix * mp.mpf(t))
        value = mp.fsum(mp.mpc(complex(g)) * whole[i, m - 1] for i, g in enumerate(chain.gammas))
        return float(chain.weight * value.real), float(chain.weight * whole[m, m - 1].real)


@pytest.mark.parametrize("name", CHAINS)
def test_a_chain_is_its_matrix_exponential_at_any_time(name):
    chain, step = CHAINS[name], 0.3
    times = np.array([0.0, 1e-6, 0.1, 1.0, 7.0])
    truth = [exactly(chain, t)[0] for t in times]
    assert chain.at(times) == pytest.approx(truth, rel=1e-12, abs=1e-12)
    for begin in (0.0, 0.17):
        edges = begin + step * np.arange(8)
        values, integrals = np.array([exactly(chain, t) for t in edges]).T
        for count in (0, 1, 2, 3, 5, 7):
            assert chain.samples(step, count, begin) == pytest.approx(values[:count], rel=1e-12, abs=1e-12)
            means = np.diff(integrals)[:count] / step
            assert chain.means(step, count, begin) == pytest.approx(means, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("name", CHAINS)
def test_the_image_of_a_chain_is_its_sum_of_products(name):
    chain = CHAINS[name]
    for s in (0.4 + 0.3j, 2.0 + 0j, -3.0 + 1j):
        exact = sum(g / np.prod(s - chain.poles[i:]) for i, g in enumerate(chain.gammas))
        other = sum(g / np.prod(np.conj(s) - chain.poles[i:]) for i, g in enumerate(chain.gammas))
        exact += np.conj(other) if chain.weight == 2.0 else 0.0
        assert complex(chain.image(np.array(s))) == pytest.approx(complex(exact), rel=1e-12)


@pytest.mark.parametrize("poles", [
    [-1.0], [-1.0, -1.0], [-1.0, -1.01, -5.0], [-1 + 2j, -1 - 2j], [0.0, -1e-9],
    [-1 + 2j, -1 - 2j, -1.001 + 2j, -1.001 - 2j], [-2.0, -2.0, -2.001, -2.1], [-1e-3, -1e3, -1.0],
])  # fmt: skip
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_the_polar_part_of_a_rational_function_is_all_of_it(poles, gap):
    """1/Π(s − p) has no other part: the chains add up to it wherever one looks, and start at 0."""
    places = np.array(poles, complex)

    def image(s):
        return 1.0 / np.prod(np.asarray(s) - places.reshape(-1, *[1] * np.ndim(s)), axis=0)

    chains = polar_part(image, places, gap, lambda p, others: 1.0 / np.prod(p - others), lambda _: math.inf)
    s = np.array([0.7 + 0.2j, 3.0 - 5.0j, 0.2 + 20.0j])
    found = sum(chain.image(s) for chain in chains)
    apart = gap > 0.0 or abs(places[0] - places[-1]) != 1e-9  # else large numbers cancel
    assert np.abs(found / image(s) - 1.0).max() < (1e-8 if apart else 1e-5)
    assert sum(len(chain.poles) * chain.weight for chain in chains) == len(places)
    for i, one in enumerate(chains):
        for other in chains[i + 1 :]:
            limit = np.maximum(gap, 0.02 * np.minimum(np.abs(one.poles[:, None]), np.abs(other.poles)))
            assert np.all(np.abs(one.poles[:, None] - other.poles) > limit)


@pytest.mark.parametrize("power", [0.0, 0.4, 1.0, 1.5])
@pytest.mark.parametrize("pole", [0.0, 1.0, 30.0])
def test_transforms_are_inverted_to_twelve_digits(power, pole):
    """t^p e^(−a t) / Γ(1 + p) from (s + a)^(−1−p), at times on either side of a block."""
    t = np.array([1e-9, 0.02, 1.0, 5.0]) / max(pole, 1.0)
    found = inverse_laplace(lambda s: (s + pole) ** (-1.0 - power), t)
    exact = t**power * np.exp(-pole * t) / math.gamma(1.0 + power)
    assert np.abs(found / exact - 1.0).max() < 2e-11
    assert np.abs(found - exact).max() < 3e-13 * max(1.0, exact.max())
    shifted = inverse_laplace(lambda s: (s + pole) ** (-1.0 - power), t, np.array([-1e9 + 1j]))
    assert np.abs(shifted - exact).max() < 3e-13 * max(1.0, exact.max())
    assert inverse_laplace(lambda s: s, np.empty(0)).shape == (0,)


def test_many_times_are_inverted_block_by_block():
    t = np.linspace(0.1, 3.0, 9001)
    found = inverse_laplace(lambda s: 1.0 / (s + 1.0), t)
    assert np.abs(found - np.exp(-t)).max() < 1e-12
    tracemalloc.start()
    inverse_laplace(lambda s: 1.0 / (s + 1.0), np.linspace(0.1, 3.0, 200_000))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40e6  # all at once: 18 complex numbers for each time, several times over


@pytest.mark.parametrize("nodes", [contour._MIDDLE, contour._SHIFTED])
def test_either_rule_keeps_its_digits(nodes):
    places, factors = nodes
    for power in (0.3, 1.0, 2.2):
        assert (factors * places**-power).sum().imag == pytest.approx(1.0 / math.gamma(power), abs=5e-13)


@pytest.mark.parametrize(
    "count, places", [(1, 1), (16, 16), (17, 36), (64, 36), (65, 56), (2000, 96), (100_000, 160)]
)
def test_a_grid_has_as_many_places_as_it_says(count, places):
    grid = LogGrid(count)
    assert len(grid.head) + len(grid.tail) == (places if places < 160 else 156) <= places
    assert np.array_equal(grid.head, np.arange(1, min(count, 16) + 1)) and np.all(
        grid.tail > 16.0 * (1 - 1e-9)
    )
    assert np.all(grid.tail < count)


@pytest.mark.parametrize("count", [1, 16, 17, 40, 64, 65, 2000, 40_000])
def test_what_is_smooth_in_log_t_is_interpolated_to_rounding(count):
    grid, samples = log_grid(count), np.arange(1, count + 1)
    for function in (
        lambda t: np.exp(-((t / 50.0) ** 0.6)),
        lambda t: t**-0.4,
        lambda t: np.cos(2.0 * np.log(t)),
    ):
        found = grid.spread(function(grid.head), function(grid.tail))
        assert np.abs(found - function(samples)).max() < 3e-14 * max(1.0, np.abs(function(samples)).max())


def test_matrices_are_kept_for_short_grids_only(monkeypatch):
    """A panel of a million samples would keep 160 MB; without one the values are the same."""
    kept = LogGrid(300)
    monkeypatch.setattr(loggrid, "_CACHED", 0)
    bare = LogGrid(300)
    values = np.cos(np.concatenate([kept.head, kept.tail]) / 100.0)
    assert bare.spread(values[:16], values[16:]) == pytest.approx(
        kept.spread(values[:16], values[16:]), abs=1e-13
    )
    monkeypatch.undo()
    tracemalloc.start()
    grid = LogGrid(400_000)
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert grid.count == 400_000 and held < 2 * 32_768 * 20 * 8 + 400_000 * 8 * 1.5


@pytest.mark.parametrize("size", [1, 2, 4])
@pytest.mark.parametrize("scale", [1e-3, 0.9, 1.1, 70.0])
def test_triangular_exponentials_in_forty_digits(size, scale):
    rng = np.random.default_rng(size)
    matrices = np.triu(rng.normal(size=(3, size, size)) + 1j * rng.normal(size=(3, size, size))) * scale
    matrices[1] *= 1e-3  # squared less often than its neighbours
    found = triangular_exponential(matrices)
    for made, matrix in zip(found, matrices):
        with mp.workdps(60):
            exact = np.array(mp.expm(mp.matrix(matrix.tolist())).tolist(), dtype=complex).reshape(size, size)
        assert np.abs(made - exact).max() < 1e-12 * (1.0 + scale) * np.abs(exact).max()


@pytest.mark.parametrize("delay, step, whole, part", [
    (0.0, 0.1, 0, 0.0), (0.3, 0.1, 3, 0.0), (0.25, 0.1, 2, 0.5), (0.1, 0.1, 1, 0.0), (7e-11, 0.1, 0, 0.0),
    (0.3 - 5e-11, 0.1, 3, 0.0), (0.3 - 3e-10, 0.1, 2, 1.0), (0.3 + 3e-10, 0.1, 3, 3e-9),
])  # fmt: skip
def test_a_delay_is_whole_samples_and_the_rest_of_one(delay, step, whole, part):
    found = split_delay(delay, step)
    assert found[0] == whole and found[1] == pytest.approx(part, abs=1e-8)
    assert (found[1] == 0.0) == (part == 0.0) and 0.0 <= found[1] < 1.0


def test_a_dead_time_turns_the_phase():
    transfer, omega = TransferFunction([(2, 0)], [(1, 0.6), (1, 0)]), np.array([0.3, 5.0])
    late = Delayed(transfer, 0.4).frequency_response(omega)
    assert late == pytest.approx(transfer.frequency_response(omega) * np.exp(-0.4j * omega), rel=1e-14)
    assert np.array_equal(Delayed(transfer).frequency_response(omega), transfer.frequency_response(omega))


def test_moving_back_leaves_zeros_and_forgets_what_falls_out():
    values = np.array([1.0, 2.0, 3.0])
    assert [_later(values, n).tolist() for n in (0, 1, 3, 9)] == [
        [1.0, 2.0, 3.0], [0.0, 1.0, 2.0], [0.0] * 3, [0.0] * 3
    ]  # fmt: skip


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("part", [0.0, 0.4])
def test_a_feedthrough_is_there_at_once_and_late_by_its_delay(hold, part):
    """(2 s^0.6 + 1)/(s^0.6 + 1) and (2 s + 1)/(s + 1) jump to 2; a constant is itself."""
    step, t = 0.1, 0.1 * np.arange(40)
    for transfer in (
        TransferFunction([(2, 0.6), (1, 0)], [(1, 0.6), (1, 0)]),
        TransferFunction([(2, 1), (1, 0)], [(1, 1), (1, 0)]),
        TransferFunction([(1.5, 0)]),
    ):
        delay = (2.0 + part) * step
        after = np.maximum(np.rint((t - delay) * 1e12) / 1e12, 0.0)
        exact = np.where(t > delay - 1e-12, step_response(transfer, after), 0.0)
        found = Convolution(transfer, step, hold, delay).run(np.ones(40))
        assert found == pytest.approx(exact, abs=1e-11)


def test_the_image_of_a_step_says_what_is_there():
    image = step_image(TransferFunction([(3, 1.2), (1, 0.4)], [(2, 1.2), (1, 0.4)]), 10.0)
    assert image.feedthrough == 1.5 and image.remainder is not None
    assert step_image(TransferFunction([(3, 1)], [(2, 2), (1, 0)]), 10.0).feedthrough == 0.0
    nothing = step_image(TransferFunction([]), 10.0)
    assert (nothing.chains, nothing.remainder, nothing.feedthrough) == ((), None, 0.0) and len(
        nothing.poles
    ) == 0
    whole = step_image(TransferFunction([(1, 0)], [(1, 1), (0.5, 0)]), 10.0)
    assert whole.remainder is None and np.sort(whole.poles.real) == pytest.approx([-0.5, 0.0])
    assert dense((Term(3.0, 4.0), Term(-1.0, 1.0))).tolist() == [3.0, 0.0, 0.0, -1.0, 0.0]
