"""One fit of K/(1.32 s^0.6 + 1) to 2000 samples at 10 ms: ours beside Levenberg–Marquardt around eq. (10)."""

import time

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from focgen.fractional.responses import mittag_leffler
from focgen.identification.excitation import Excitation, prepare
from focgen.identification.fractional import _Problem, _start, fit_fractional
from focgen.identification.kernel import step_means, step_responses
from focgen.logs.experiment import Experiment
from focgen.rig.model import Actuator, Rig, Signals

STEP, COUNT, K, T, ALPHA, LEVEL = 0.01, 2000, 0.05, 1.32, 0.6, 0.15
RIG = Rig("bench", STEP, Signals("t", "y", pressure="p"), Actuator(T, ALPHA, (K,)))
ROUNDS = 7


def experiment(seed: int | None, alpha: float = ALPHA) -> Excitation:
    """A step at the second sample; noise of 2 % of the final value with a ``seed``."""
    late = STEP * np.maximum(np.arange(COUNT) - 1.0, 0.0)
    clean = K * LEVEL * np.where(late > 0.0, 1.0 - mittag_leffler(alpha, 1.0, -(late**alpha) / T), 0.0)
    noise = 0.0 if seed is None else 0.02 * K * LEVEL * np.random.default_rng(seed).normal(size=COUNT)
    pressure = LEVEL * (np.arange(COUNT) >= 1)
    return prepare(Experiment("step", STEP, {"pressure": pressure, "output": clean + noise}), RIG)


def start_of(x: Excitation) -> np.ndarray:
    """K, T and α from which ours starts as well."""
    log_tau, alpha, gain, _ = min((_start(_Problem([x]), a) for a in (0.75, 0.95)), key=_Problem([x]).cost)
    return np.array([gain, np.exp(alpha * log_tau), alpha])


def plain_fit(x: Excitation, start: np.ndarray) -> np.ndarray:
    """K, T and α by scipy's Levenberg–Marquardt around the recursion of eq. (10), all 2000 samples of
    memory.
    """

    def residual(parameters):
        gain, T, alpha = parameters
        weights = np.cumprod(np.concatenate([[1.0], 1.0 - (alpha + 1.0) / np.arange(1, COUNT)]))
        den = T / STEP**alpha * weights
        den[0] += 1.0
        return (lfilter([gain], den, x.pressure) - x.measured) / x.measured.std()

    return least_squares(residual, start, method="lm", x_scale=np.abs(start)).x


def our_fit(x: Excitation) -> np.ndarray:
    """K, T and α, with an offset and all intervals; nothing is remembered from the last fit."""
    step_responses.cache_clear()
    step_means.cache_clear()
    fit = fit_fractional([x])
    return np.array([fit.K[0], fit.T, fit.alpha])


def _seconds(action, *arguments) -> float:
    start = time.perf_counter()
    action(*arguments)
    return time.perf_counter() - start


def run() -> str:
    """Return times side by side, alternating, and the bias of each parameter without noise."""
    noisy = [experiment(seed) for seed in range(ROUNDS)]
    times = {"plain": [], "ours": []}
    for x in noisy:
        start = start_of(x)
        times["plain"].append(_seconds(plain_fit, x, start))
        times["ours"].append(_seconds(our_fit, x))
    plain, ours = (float(np.median(times[name])) for name in ("plain", "ours"))
    lines = [
        f"A fit of K, T and α to {COUNT} samples with 2 % noise, median of {ROUNDS}, same data and start.",
        f"least_squares(lm) around lfilter, eq. (10)  {1e3 * plain:8.1f} ms",
        f"fit_fractional, offset and intervals too    {1e3 * ours:8.1f} ms    "
        f"{plain / ours:.1f} times as fast",
        "",
        "Error without noise, plain | ours, and the ratio of the errors in α.",
    ]
    lines.append(f"{'α':>5}{'K':>22}{'T':>22}{'α':>22}{'ratio':>11}")
    return "\n".join(lines + [_bias_row(alpha) for alpha in (0.3, 0.6, 0.9)])


def _bias_row(alpha: float) -> str:
    x = experiment(None, alpha)
    truth = np.array([K, T, alpha])
    errors = [np.abs(found - truth) for found in (plain_fit(x, start_of(x)), our_fit(x))]
    cells = "".join(f"{f'{plain:.1e} | {ours:.1e}':>22}" for plain, ours in zip(*errors))
    return f"{alpha:5.1f}{cells}{errors[0][2] / max(errors[1][2], 1e-16):11.0e}"
