"""Levenberg–Marquardt fit of K/(T s^α + 1), eq. (3), to one experiment, or of one T and α to several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.kernel import step_means, step_responses
from focgen.identification.noise import ResidualModel, covariance, half_width, residual_model

_ALPHAS = (0.05, 1.95)
_LONGEST = 60.0  # |log τ|, τ in s
_STARTS = (0.75, 0.95)  # of α; T starts at the experiment's own rise
_DOUBTFUL = 0.6  # residual over spread (1 − GOF) from which on a fit is repeated from the other start


@dataclass(frozen=True, eq=False)
class FractionalFit:
    """A fit of one experiment or several, which share T and α.

    ``K`` and ``offset`` (experiments,), ``T`` in s^alpha. ``half`` maps "T", "alpha" to half a 95 % interval
    and "K", "offset" to those of each experiment (experiments,). ``K_covariance`` (experiments, experiments).
    ``simulated``: the model's outputs.
    """

    K: np.ndarray
    T: float
    alpha: float
    offset: np.ndarray
    half: dict[str, float | np.ndarray]
    K_covariance: np.ndarray
    residuals: list[ResidualModel]
    simulated: list[np.ndarray]


def fit_fractional(experiments: Sequence[Excitation]) -> FractionalFit:
    """Fit K and an offset to each experiment, T and α to all. Raises FitError where the data do not determine
    them.
    """
    problem = _Problem(experiments)
    best = _best(problem)
    _check(experiments, best)
    return _finished(experiments, problem, best.x)


class _Problem:
    """Residuals and their exact derivatives in (log τ, α, K₁, c₁, K₂, c₂, …); T = τ^α.

    Each experiment is scaled by its own spread, so that all weigh alike.
    """

    def __init__(self, experiments: Sequence[Excitation]):
        self.experiments = experiments
        self.weights = [1.0 / np.std(e.measured) for e in experiments]
        self._at: tuple | None = None

    def responses(self, log_tau: float, alpha: float) -> list[np.ndarray]:
        """The unit response and its derivatives in log τ and α, (3, n) each experiment."""
        found = []
        for e in self.experiments:
            held = e.hold == "zero"
            steps = step_responses(log_tau, alpha, e.step, len(e)) if held or e.jumps else None
            means = None if held else step_means(log_tau, alpha, e.step, len(e))
            found.append(e.respond(steps, means)[:, 0])
        return found

    def _kept(self, x: np.ndarray) -> list[np.ndarray]:
        """The responses at ``x``; beyond the edges of what makes sense, those at the edge."""
        key = (float(np.clip(x[0], -_LONGEST, _LONGEST)), float(np.clip(x[1], *_ALPHAS)))
        if self._at is None or self._at[0] != key:
            self._at = key, self.responses(*key)
        return self._at[1]

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Model − measured, scaled, of all experiments in a row."""
        parts = [
            (x[2 + 2 * i] * r[0] + x[3 + 2 * i] - e.measured) * w
            for i, (e, r, w) in enumerate(zip(self.experiments, self._kept(x), self.weights))
        ]
        return np.concatenate(parts)

    def cost(self, x: np.ndarray) -> float:
        """Sum of squares of :meth:`residual`."""
        return float(np.sum(self.residual(x) ** 2))

    def explains(self, x: np.ndarray) -> bool:
        """Whether ``x`` makes sense and leaves little, so that no other start is worth its time."""
        return _ALPHAS[0] < x[1] < _ALPHAS[1] and self.cost(x) < _DOUBTFUL**2 * sum(
            map(len, self.experiments)
        )

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Derivatives of :meth:`residual`, (samples, parameters)."""
        blocks = []
        for i, (r, w) in enumerate(zip(self._kept(x), self.weights)):
            block = np.zeros((r.shape[1], len(x)))
            block[:, 0], block[:, 1] = x[2 + 2 * i] * r[1], x[2 + 2 * i] * r[2]
            block[:, 2 + 2 * i], block[:, 3 + 2 * i] = r[0], 1.0
            blocks.append(block * w)
        return np.vstack(blocks)


def _best(problem: _Problem):
    """The fit from the better start; from the other one as well where that one leaves doubt."""
    starts = sorted((_start(problem, alpha) for alpha in _STARTS), key=problem.cost)
    runs = []
    for start in starts:
        runs.append(_fit_from(problem, start))
        if runs[-1].success and problem.explains(runs[-1].x):
            break
    return min(runs, key=lambda run: run.cost)


def _fit_from(problem: _Problem, start: np.ndarray):
    try:
        return least_squares(
            problem.residual,
            start,
            problem.jacobian,
            method="lm",
            x_scale="jac",
            xtol=1e-10,
            ftol=1e-12,
            max_nfev=200,
        )
    except (ValueError, FloatingPointError, np.linalg.LinAlgError) as reason:
        name = problem.experiments[0].name
        raise FitError(name, f"the fit does not converge ({reason})", "look at the log") from None


def _start(problem: _Problem, alpha: float) -> np.ndarray:
    """τ such that the slope of the measured signal's rise is met roughly; K and offset by linear least
    squares.
    """
    log_tau = float(np.median([np.log(_rise_time(e)) for e in problem.experiments]))
    x = [log_tau, alpha]
    for e, r in zip(problem.experiments, problem.responses(log_tau, alpha)):
        x += list(np.linalg.lstsq(np.column_stack([r[0], np.ones(len(e))]), e.measured, rcond=None)[0])
    return np.array(x)


def _rise_time(e: Excitation) -> float:
    """Seconds from the input's half-way crossing to the output's, at least one sample."""
    drive, out = np.abs(e.drives[0]), np.abs(e.measured - e.measured[: max(3, len(e) // 200)].mean())
    begin = int(np.argmax(drive >= 0.5 * drive.max()))
    late = int(np.argmax(out[begin:] >= 0.5 * out[begin:].max()))
    return max(late, 1) * e.step


def _check(experiments: Sequence[Excitation], best) -> None:
    names = ", ".join(e.name for e in experiments)
    if not np.all(np.isfinite(best.x)):
        raise FitError(names, "the fit does not converge", "look at the log")
    if not _ALPHAS[0] < best.x[1] < _ALPHAS[1]:
        what = f"the best order is at the edge of (0, 2): {best.x[1]:.3g}"
        raise FitError(names, what, "the log does not show such dynamics; look at its columns and its time")


def _finished(experiments, problem: _Problem, x: np.ndarray) -> FractionalFit:
    residual, jacobian = problem.residual(x), problem.jacobian(x)
    ends = np.cumsum([len(e) for e in experiments])
    models = [residual_model(part) for part in np.split(residual, ends[:-1])]
    try:
        spread = covariance(jacobian, models)
    except np.linalg.LinAlgError:
        raise FitError(
            experiments[0].name, "the log does not determine K, T and alpha", "hold the step longer"
        ) from None
    return _with_intervals(problem, x, spread, models)


def _with_intervals(problem, x, spread, models) -> FractionalFit:
    log_tau, alpha, K = x[0], x[1], x[2::2]
    T = float(np.exp(alpha * log_tau))
    slope = np.zeros(len(x))
    slope[:2] = T * alpha, T * log_tau  # of T = exp(α log τ)
    effective = sum(m.effective for m in models)
    wide = lambda variance: half_width(variance, effective, len(x))  # noqa: E731
    gains = slice(2, None, 2)
    half = {
        "T": float(wide(slope @ spread @ slope)),
        "alpha": float(wide(spread[1, 1])),
        "K": wide(np.diag(spread)[gains]),
        "offset": wide(np.diag(spread)[3::2]),
    }
    simulated = [K[i] * r[0] + x[3 + 2 * i] for i, r in enumerate(problem.responses(log_tau, alpha))]
    return FractionalFit(
        K.copy(), T, float(alpha), x[3::2].copy(), half, spread[gains, gains], models, simulated
    )
