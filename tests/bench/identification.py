"""One fit of K/(1.32 s^0.6 + 1) to 2000 samples at 10 ms, and a joint one of K(p) p to six runs of 4000: ours
beside Levenberg–Marquardt around eq. (10)."""

import time

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from focgen.fractional.responses import mittag_leffler
from focgen.identification.excitation import Excitation, prepare
from focgen.identification.fractional import fit_fractional
from focgen.identification.kernel import kernels
from focgen.identification.problem import Problem, starts
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

STEP, COUNT, K, T, ALPHA, LEVEL = 0.01, 2000, 0.05, 1.32, 0.6, 0.15
JOINT = 4000
RIG = Rig("bench", STEP, Signals("t", "y", pressure="p"), Actuator(T, ALPHA, (K,)))
ROUNDS = 7
FEW = 3


def experiment(seed: int | None, alpha: float = ALPHA) -> Excitation:
    """A step at the second sample; noise of 2 % of the final value with a ``seed``."""
    late = STEP * np.maximum(np.arange(COUNT) - 1.0, 0.0)
    clean = K * LEVEL * np.where(late > 0.0, 1.0 - mittag_leffler(alpha, 1.0, -(late**alpha) / T), 0.0)
    noise = 0.0 if seed is None else 0.02 * K * LEVEL * np.random.default_rng(seed).normal(size=COUNT)
    pressure = LEVEL * (np.arange(COUNT) >= 1)
    return prepare(Experiment("step", STEP, {"pressure": pressure, "output": clean + noise}), RIG)


def start_of(runs: list[Excitation]) -> np.ndarray:
    """The gain's coefficients, T and α from which ours starts as well."""
    problem = Problem(runs, (None,) * len(runs), False)
    point = problem.at(starts(problem)[0])
    log_tau, alpha = point.x
    return np.array([*point.gain, np.exp(alpha * log_tau), alpha])


def plain_fit(runs: list[Excitation], start: np.ndarray) -> np.ndarray:
    """The gain's coefficients, T and α by scipy's Levenberg–Marquardt around the recursion of eq. (10), with
    the whole past for memory; each run scaled by its spread.
    """

    def residual(parameters):
        *gain, T, alpha = parameters
        left = []
        for x in runs:
            weights = np.cumprod(np.concatenate([[1.0], 1.0 - (alpha + 1.0) / np.arange(1, len(x))]))
            den = T / STEP**alpha * weights
            den[0] += 1.0
            drive = sum(g * x.pressure**m for m, g in enumerate(gain, 1))
            left.append((lfilter([1.0], den, drive) - x.measured) / x.measured.std())
        return np.concatenate(left)

    return least_squares(residual, start, method="lm", x_scale=np.abs(start)).x


def our_fit(runs: list[Excitation]) -> np.ndarray:
    """The gain's coefficients, T and α, with offsets and all intervals; nothing is remembered from the last
    fit."""
    kernels.cache_clear()
    fit = fit_fractional([x.bare() for x in runs])
    return np.array([*fit.gain, fit.T, fit.alpha])


def session(seed: int) -> list[Excitation]:
    """Six levels of 4000 samples, of K(p) = 0.0015 + 0.345 p."""
    rng, late = np.random.default_rng(seed), STEP * np.maximum(np.arange(JOINT) - 100.0, 0.0)
    answer = np.where(late > 0.0, 1.0 - mittag_leffler(ALPHA, 1.0, -(late**ALPHA) / T), 0.0)
    runs = []
    for level in np.linspace(0.075, 0.2, 6):
        final = (0.0015 + 0.345 * level) * level
        signals = {
            "pressure": level * (np.arange(JOINT) >= 100),
            "output": final * (answer + 0.02 * rng.normal(size=JOINT)),
        }
        runs.append(prepare(Experiment(f"{level:.3f}", STEP, signals), RIG, 2))
    return runs


def _seconds(action, *arguments) -> float:
    start = time.perf_counter()
    action(*arguments)
    return time.perf_counter() - start


def _timed(sessions: list[list[Excitation]]) -> tuple[float, float]:
    """Median seconds of both, alternating."""
    times = {"plain": [], "ours": []}
    for runs in sessions:
        start = start_of(runs)
        times["plain"].append(_seconds(plain_fit, runs, start))
        times["ours"].append(_seconds(our_fit, runs))
    return float(np.median(times["plain"])), float(np.median(times["ours"]))


def run() -> str:
    """Return times side by side, alternating, and the bias of each parameter without noise."""
    lines = []
    for what, sessions in (
        (f"A fit of K, T and α to {COUNT} samples", [[experiment(seed)] for seed in range(ROUNDS)]),
        (f"A joint fit of K(p) p, T and α to six runs of {JOINT} samples", [session(s) for s in range(FEW)]),
    ):
        plain, ours = _timed(sessions)
        lines += [
            f"{what} with 2 % noise, median of {len(sessions)}, same data and start.",
            f"least_squares(lm) around lfilter, eq. (10)  {1e3 * plain:8.1f} ms",
            (
                f"fit_fractional, offset and intervals too    {1e3 * ours:8.1f} ms    "
                f"{plain / ours:.1f} times as fast"
            ),
            "",
        ]
    lines.append("Error without noise, plain | ours, and the ratio of the errors in α.")
    lines.append(f"{'α':>5}{'K':>22}{'T':>22}{'α':>22}{'ratio':>11}")
    return "\n".join(lines + [_bias_row(alpha) for alpha in (0.3, 0.6, 0.9)])


def _bias_row(alpha: float) -> str:
    x = [experiment(None, alpha)]
    truth = np.array([K, T, alpha])
    errors = [np.abs(found - truth) for found in (plain_fit(x, start_of(x)), our_fit(x))]
    cells = "".join(f"{f'{plain:.1e} | {ours:.1e}':>22}" for plain, ours in zip(*errors))
    return f"{alpha:5.1f}{cells}{errors[0][2] / max(errors[1][2], 1e-16):11.0e}"
