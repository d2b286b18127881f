"""Closed loops: the input answers the disturbance, and the fit must not take that for the plant.

Red when a controller's answer to noise moves the plant's parameters, with a reference in the log or without.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.identification.excitation import prepare
from focgen.identification.fractional import fit_fractional
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals
from tests.exact_actuator import ALPHA, T, power_answer

STEP, COUNT, K = 0.05, 900, 0.5
RIG = Rig("loop", STEP, Signals("t", "y", command="u", reference="r"), Actuator(T, ALPHA, (K,)))
LOOPS = {"gentle": (2.0, 1.5), "brisk": (6.0, 6.0), "hot": (12.0, 15.0)}  # proportional, integral a second
IMPULSES = np.diff(
    power_answer(STEP * np.arange(COUNT + 1), 0)
)  # what a command held for a sample adds, later


def closed_loop(seed: int, loop: str, pole: float, noise: float) -> dict[str, np.ndarray]:
    """Set points from rest, a PI controller, and a disturbance in the output, coloured by ``pole``."""
    rng, (kp, ki) = np.random.default_rng(seed), LOOPS[loop]
    disturbed = lfilter([noise * np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.normal(size=COUNT + 500))[500:]
    reference = np.repeat([0.0, 0.4, 1.0, 0.6, 0.9, 0.2], COUNT // 6)
    u, y, total = np.zeros(COUNT), np.zeros(COUNT), 0.0
    for k in range(COUNT):
        y[k] = K * (IMPULSES[:k] @ u[:k][::-1]) + disturbed[k]
        total += ki * STEP * (reference[k] - y[k])
        u[k] = kp * (reference[k] - y[k]) + total
    return {"command": u, "output": y, "reference": reference}


def errors_of(seeds: range, loop: str, pole: float, noise: float, told: bool, closed: bool = True):
    """Errors of T, α and K, and whether they lie in their intervals; (seeds, 3) each. ``told``: whether the
    reference is logged; ``closed``: whether the fit is one of closed loops."""
    errors, hits = [], []
    for seed in seeds:
        signals = closed_loop(seed, loop, pole, noise)
        if not told:
            del signals["reference"]
        prepared = prepare(Experiment("a", STEP, signals), RIG)
        fit = fit_fractional([prepared if closed else replace(prepared, reference=None)])
        errors.append([fit.T - T, fit.alpha - ALPHA, fit.K - K])
        hits.append(np.abs(errors[-1]) <= [fit.half["T"], fit.half["alpha"], fit.half["gain"][0]])
        assert fit.closed_loop is closed
    return np.array(errors), np.array(hits)


def test_the_loop_is_the_convolution_of_its_command():
    """Without disturbance every parameter comes back, told of the loop or not: nothing shows it then."""
    for told in (True, False):
        assert np.abs(errors_of(range(1), "brisk", 0.0, 0.0, told, closed=told)[0]).max() < 1e-5


@pytest.mark.parametrize("logged", [True, False])
def test_feedback_brings_no_bias(logged):
    told, hits = errors_of(range(8), "brisk", 0.9, 0.05, logged)
    direct, _ = errors_of(range(8), "brisk", 0.9, 0.05, False, closed=False)
    scatter = told.std(axis=0)
    assert np.all(np.abs(told.mean(axis=0)) < 1.2 * scatter) and hits.mean() >= 0.75  # 3.4 of its own errors
    assert np.max(np.abs(direct.mean(axis=0)) / scatter) > 2.0 * np.max(np.abs(told.mean(axis=0)) / scatter)


@pytest.mark.long
@pytest.mark.parametrize("loop", list(LOOPS))
@pytest.mark.parametrize("pole", [0.9, 0.98])
@pytest.mark.parametrize("logged", [True, False])
def test_feedback_brings_no_bias_over_many_loops(loop, pole, logged):
    told, hits = errors_of(range(100, 160), loop, pole, 0.05, logged)
    direct, _ = errors_of(range(100, 160), loop, pole, 0.05, False, closed=False)
    scatter = told.std(axis=0)
    assert np.all(np.abs(told.mean(axis=0)) < 0.5 * scatter) and hits.mean() >= 0.85
    assert np.max(np.abs(direct.mean(axis=0)) / scatter) > np.max(np.abs(told.mean(axis=0)) / scatter)
