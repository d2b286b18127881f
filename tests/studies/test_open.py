"""The open loop of a study: its errors, biases and bounds against sums taken independently.

Red when an error or a bias of a study is off the sum taken independently.
"""

import json
from dataclasses import replace

import mpmath
import numpy as np
import pytest

import focgen
from focgen.fractional.exponential import fit_exponential
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.studies.costs import multiplies
from focgen.studies.jobs import Job, answer, read_row
from focgen.studies.operator import fractional_terms, measure, variant_of
from focgen.studies.results import INPUTS, Setup, Variant
from focgen.studies.signals import exact_power, inputs, signed
from focgen.studies.spectrum import band_of, memory_spectrum, omegas
from tests.conftest import paper_controller
from tests.controllers import random_controller

SAMPLES = 2000


def setup(controller=None, samples=SAMPLES):
    controller = controller or paper_controller()
    return Setup(controller, None, band_of(controller, None, ()), samples, ())


def row(variant, controller=None, samples=SAMPLES):
    return read_row(answer(Job("row", setup(controller, samples), variant)))[0]


def weights(order, count):
    """Eq. (11) with 40 digits."""
    with mpmath.workdps(40):
        found = [mpmath.mpf(1)]
        for j in range(1, count + 1):
            found.append(found[-1] * (j - 1 - mpmath.mpf(order)) / j)
        return np.array([float(w) for w in found])


def plain_error(order, length, x):
    """Largest error of ``length`` past samples relative to the largest exact output, row by row of ``x``."""
    w = weights(order, x.shape[1] - 1)
    cut = np.where(np.arange(len(w)) <= length, w, 0.0)
    exact, short = (np.array([np.convolve(each, r)[: x.shape[1]] for r in x]) for each in (w, cut))
    return np.abs(short - exact).max(axis=1) / np.abs(exact).max(axis=1)


@pytest.mark.parametrize("length", [7, 100, 900])
def test_the_error_is_that_of_sums_taken_one_by_one(length):
    found = row(Variant("short", "f64", 0.01, length=length))
    x = inputs(paper_controller(), 0.01, SAMPLES).error
    expected = plain_error(0.6, length, x)
    assert [found.errors[name] for name in INPUTS] == pytest.approx(expected, rel=1e-9)
    assert found.error == max(found.errors.values())


def test_the_exact_output_is_the_whole_sum():
    x = inputs(paper_controller(), 0.01, 700).error
    expected = [0.01**-0.6 * np.convolve(weights(0.6, 699), each)[:700] for each in x]
    assert exact_power(0.6, 0.01, x) == pytest.approx(np.array(expected), abs=1e-12)


@pytest.mark.parametrize("alpha", [0.2, 0.6, 0.95])
@pytest.mark.parametrize(
    "length", [pytest.param(3, marks=pytest.mark.long), 250, pytest.param(4000, marks=pytest.mark.long)]
)
def test_the_bias_is_gamma_s(alpha, length):
    controller = paper_controller(transfer=TransferFunction([(1.7, alpha), (2.0, 0.0)]))
    found = row(Variant("short", "f64", 0.01, length=length), controller, 300)
    with mpmath.workdps(30):
        gamma = mpmath.gamma(length + 1 - alpha) / (mpmath.gamma(1 - alpha) * mpmath.factorial(length))
        expected = float(gamma), float(1.7 * gamma * mpmath.mpf(0.01) ** -alpha / 2)
    assert (found.operator_bias, found.dc_bias) == pytest.approx(expected, rel=1e-9)


def test_the_bias_is_what_a_constant_leaves_after_hours():
    """The sum over a constant, run for an hour, stays where the bias says."""
    found = row(Variant("short", "f64", 0.1, length=50), paper_controller(), 300)
    constant = np.convolve(0.1**-0.6 * 1.32 * weights(0.6, 50), np.ones(36_000))[:36_000][-1]
    assert found.dc_bias == pytest.approx(constant, rel=1e-9)


def by_turns(seeds, count):
    """Seeds and forms of memory; every other pair of all but the first ``count`` is in the long suite."""
    return [
        pytest.param(
            seed,
            memory,
            marks=() if turn < count and (turn // 4 + turn + i) % 2 == 0 else pytest.mark.long,
        )
        for turn, seed in enumerate(seeds)
        for i, memory in enumerate(("short", "exponential"))
    ]


@pytest.mark.parametrize("seed, memory", by_turns(range(12), 6))
def test_no_error_exceeds_its_bound(seed, memory):
    random = np.random.default_rng(seed)
    order, length = float(random.uniform(0.05, 1.6)), int(random.integers(2, 300))
    arithmetic = ("f64", "f32", "q31", "q15")[seed % 4]
    num = [(float(random.uniform(0.3, 3.0)), order), (1.0, 0.0)]
    controller = paper_controller(transfer=TransferFunction(num), integrator=bool(seed % 3))
    if not controller.integrator:
        controller = replace(controller, ranges=replace(controller.ranges, output=(-2000.0, 2000.0)))
    variant = Variant("short", arithmetic, 0.01, length=length)
    if memory == "exponential":
        tolerance = float(10.0 ** random.uniform(-6.0, -1.0))
        variant = Variant(
            memory, arithmetic, 0.01, tolerance=tolerance, horizon=int(random.integers(100, 10_000))
        )
    found = row(variant, controller, 800)
    assert found.note is None or "compiled" in found.note
    assert 0.0 < found.error <= found.bound


@pytest.mark.parametrize("seed, memory", by_turns([1, 4, 19, 31, 35, 44, 51, 59], 4))
def test_any_controller_can_be_studied(seed, memory):
    """Integrating ones, leads, lags, second order; ranges that differ, or hold errors of one sign only."""
    controller = random_controller(seed)
    arithmetic, h = ("f64", "f32", "q31", "q15")[seed % 4], controller.sample_time
    variant = Variant("short", arithmetic, h, length=60)
    if memory == "exponential":
        variant = Variant(memory, arithmetic, h, tolerance=1e-3, horizon=10_000)
    found = answer(Job("row", setup(controller, 400), variant))
    json.dumps(found, allow_nan=False)
    assert found["row"]["note"] is None and 0.0 <= found["row"]["error"] <= found["row"]["bound"]


@pytest.mark.parametrize("seed", range(40))
def test_inputs_never_leave_the_ranges(seed):
    controller = signed(random_controller(seed))
    given, ranges = inputs(controller, controller.sample_time, 200), controller.ranges
    for part, (low, high) in (
        (given.scenario.ref, ranges.reference),
        (given.scenario.meas, ranges.measurement),
    ):
        slack = 1e-12 * (high - low)
        assert low - slack <= part.min() and part.max() <= high + slack
    assert given.scenario.ref - given.scenario.meas == pytest.approx(given.error, abs=1e-9 * given.amplitude)
    assert np.abs(given.error).max() == given.amplitude > 0.0


def test_arithmetic_adds_what_it_rounds():
    """With memory for all the samples there are, only the rounding is left; it grows from f64 to q15."""
    found = [
        row(Variant("short", a, 0.01, length=SAMPLES), samples=1000).error
        for a in ("f64", "f32", "q31", "q15")
    ]
    assert found[0] < 1e-12 < found[1] < 1e-4
    assert found[0] < found[2] < 1e-4 < found[3] < 0.1


def test_an_exponential_memory_of_six_states_beats_a_thousand_taps():
    short = row(Variant("short", "q31", 0.01, length=1000), samples=10_000)
    exponential = row(Variant("exponential", "q31", 0.01, tolerance=0.1, horizon=10_000), samples=10_000)
    assert exponential.error < 0.1 * short.error and exponential.multiplies < 0.02 * short.multiplies
    assert exponential.dc_bias == pytest.approx(0.0, abs=1e-9) and exponential.error <= exponential.bound


def test_phase_and_magnitude_are_those_of_the_weights():
    controller = variant_of(paper_controller(), Variant("short", "f64", 0.01, length=60))
    band = band_of(controller, None, ())
    found = memory_spectrum(controller, build_plan(controller), band)
    omega = omegas(band, 0.01)
    back = np.exp(-1j * omega * 0.01)
    cut = 1.32 * 0.01**-0.6 * np.polyval(weights(0.6, 60)[::-1], back) + 1.0
    ratio = cut / (1.32 * ((1.0 - back) / 0.01) ** 0.6 + 1.0)
    assert found.phase_deg == pytest.approx(np.degrees(np.angle(ratio)), abs=1e-9)
    assert found.magnitude_db == pytest.approx(20 * np.log10(np.abs(ratio)), abs=1e-9)
    late = np.abs(found.phase_deg[omega >= found.good_from])
    assert late.max() <= 2.0 < np.abs(found.phase_deg[omega < found.good_from][-1])


def test_inputs_stay_in_the_ranges_and_last_as_long_at_every_sample_time():
    controller = paper_controller()
    for h in (0.005, 0.01, 0.04):
        given = inputs(replace(controller, sample_time=h), 0.01, 1000)
        assert given.error.shape == (4, round(10.0 / h))
        assert given.scenario.ref - given.scenario.meas == pytest.approx(given.error, abs=1e-15)
        for part, (low, high) in ((given.scenario.ref, (0.0, 0.02)), (given.scenario.meas, (0.0, 0.02))):
            assert low - 1e-15 <= part.min() and part.max() <= high + 1e-15


def test_a_denominator_needs_memory_too():
    lead = paper_controller(
        transfer=TransferFunction([(2.0, 0.4), (1.0, 0.0)], [(0.1, 0.7), (1.0, 0.0)]), integrator=False
    )
    lead = replace(lead, ranges=replace(lead.ranges, output=(-500.0, 500.0)))
    assert [t.order for t in fractional_terms(lead)] == [0.4, 0.7]
    found = row(Variant("short", "f64", 0.01, length=300), lead)
    assert found.multiplies == 301 + 300
    x = inputs(lead, 0.01, SAMPLES).error
    worst = max(plain_error(order, 300, x).max() for order in (0.4, 0.7))
    assert found.error == pytest.approx(worst, rel=1e-9)


def test_what_an_arithmetic_cannot_do_is_said_not_guessed():
    tiny = paper_controller(transfer=TransferFunction([(1e12, 0.6), (1.0, 0.0)]))
    found = row(Variant("short", "q15", 0.01, length=100), tiny)
    assert found.error is None and "output range is too small" in found.note


def test_multiplies_are_one_a_tap_and_two_an_exponential():
    for length in (5, 400):
        assert multiplies(build_plan(paper_controller(length))) == length + 1
    found = row(Variant("exponential", "q31", 0.01, tolerance=1e-3, horizon=10_000), samples=100)
    assert found.multiplies == 2 * found.states + 2 and found.dc_bias == found.operator_bias == 0.0


@pytest.mark.parametrize("memory", [pytest.param("short", marks=pytest.mark.long), "exponential"])
def test_cycles_and_bytes_are_those_that_cost_counts(tmp_path, memory):
    pytest.importorskip("unicorn")
    variant = Variant(memory, "q31", 0.01, length=40)
    if memory == "exponential":
        variant = Variant(memory, "q31", 0.01, tolerance=0.01, horizon=10_000)
    found = read_row(answer(Job("row", replace(setup(samples=100), target="cortex-m4"), variant)))[0]
    focgen.generate(variant_of(paper_controller(), variant), tmp_path, target="cortex-m4")
    counted = focgen.cost(tmp_path, "cortex-m4").controllers[0].targets["cortex-m4"]
    assert found.cycles == counted.cycles_per_step.mean > 100.0
    assert found.instructions == counted.instructions_per_step.mean
    assert (found.flash_bytes, found.ram_bytes) == (counted.flash_bytes, counted.ram_bytes)
    assert found.stack_bytes == counted.stack_bytes and found.compiled_for.startswith("cortex-m4, ")


@pytest.mark.parametrize(
    "arithmetic", ["f32", "q15", *(pytest.param(a, marks=pytest.mark.long) for a in ("f64", "q31"))]
)
def test_the_error_of_an_exponential_memory_is_that_of_its_operator(arithmetic):
    """The plan's error, less the rounding of the arithmetic, is the exponentials' by themselves."""
    found = row(Variant("exponential", arithmetic, 0.01, tolerance=0.03, horizon=10_000))
    memory = fit_exponential(0.6, 10_000, 0.03)
    x = inputs(paper_controller(), 0.01, SAMPLES).error
    exact = np.array([np.convolve(weights(0.6, SAMPLES - 1), each)[:SAMPLES] for each in x])
    made = np.array([memory.run(each) for each in x])
    expected = (np.abs(made - exact).max(axis=1) / np.abs(exact).max(axis=1)).max()
    assert found.states == memory.states
    assert found.error == pytest.approx(expected, rel=0.2 if arithmetic == "q15" else 1e-3)


def test_the_signal_ahead_of_the_integrator_is_hurt_less_than_its_power():
    """T s^α + 1: the constant part does not forget."""
    controller = variant_of(paper_controller(), Variant("short", "f64", 0.01, length=100))
    found = measure(controller, build_plan(controller), 0.01, SAMPLES, np.array([1.0]))
    x = inputs(controller, 0.01, SAMPLES).error
    w = weights(0.6, SAMPLES - 1)
    cut = np.where(np.arange(SAMPLES) <= 100, w, 0.0)
    exact, short = (
        np.array([1.32 * 0.01**-0.6 * np.convolve(e, r)[:SAMPLES] + r for r in x]) for e in (w, cut)
    )
    expected = (np.abs(short - exact).max(axis=1) / np.abs(exact).max(axis=1)).max()
    assert found.error_ahead == pytest.approx(expected, rel=1e-9) and found.error_ahead < found.error


@pytest.mark.parametrize("memory", ["short", "exponential"])
@pytest.mark.parametrize("order", [pytest.param(0.6, marks=pytest.mark.long), 1.4, -0.4])
def test_the_error_against_s_is_that_of_the_weights_and_of_sampling(memory, order):
    """By the sums themselves; a fine memory is left with the delay of order · h / 2 of Grünwald–Letnikov."""
    h, omega = 0.01, np.geomspace(3.0, 0.1 * np.pi / 0.01, 9)
    options = {"tolerance": 1e-6, "horizon": 100_000} if memory == "exponential" else {"length": 200}
    transfer = TransferFunction([(2.0, order)])
    controller = replace(paper_controller(), transfer=transfer, memory=memory, arithmetic="f64", **options)
    found = measure(controller, build_plan(controller), h, 400, omega).error_s
    delay = np.exp(-1j * omega * h)
    own = order if order > 0.0 else order + 1.0  # the power that is summed; 1/s is apart
    sums = (1.0 - delay) ** own * h**-own
    if memory == "short":
        sums = h**-own * np.exp(-1j * np.outer(omega * h, np.arange(201))) @ weights(own, 200)
    expected = np.abs(sums / (1j * omega) ** own - 1.0).max()
    assert found == pytest.approx(expected, rel=1e-4)
    if memory == "exponential":
        assert found == pytest.approx(0.05 * np.pi * own, rel=0.1)
