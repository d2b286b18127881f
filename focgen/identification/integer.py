"""Integer-order models, from 1 pole to 3 poles and 2 zeros, fitted by the same algorithm for comparison.

A strictly proper model is a denominator, of factors s + a and s² + b s + c with positive coefficients (so it
is stable), and a numerator, on which the output depends linearly. Levenberg–Marquardt runs over the
denominator's coefficients, from several starts; numerator and offset are projected out (Golub and Pereyra,
1973). Among the starts of a shape are the optima of the smaller ones, so that a larger model never fits
worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import OptimizeResult, least_squares
from scipy.signal import lfilter

from focgen.arrays import Array, Numbers
from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.rational import shifted

SHAPES = tuple((poles, zeros) for poles in (1, 2, 3) for zeros in range(poles))
"""(poles, zeros) of every strictly proper pair, by rising number of poles, then of zeros."""

_STARTS = {1: (0.1,), 2: (0.02, 0.12, 0.6), 3: (0.015, 0.08, 0.5)}  # time constants, times the length
_FASTEST, _SLOWEST = 3.0, 30.0  # a pole's rate: per sample, and times the length
_APART = 1e-6  # relative distance of two poles, nearer than which they are taken apart
_SEARCHED = 2000  # samples that the search from every start looks at
_FIRST_ROUNDS, _ROUNDS = 8, 25  # of Levenberg–Marquardt: from every start, and from the best


@dataclass(frozen=True, eq=False)
class IntegerFit:
    """``num`` and ``den``: coefficients by falling power of s, den monic. ``simulated`` (n,): the model's
    output.
    """

    poles: int
    zeros: int
    num: Array
    den: Array
    offset: float
    simulated: Array

    @property
    def name(self) -> str:
        """As in Table I: ``1p``, ``2p1z``."""
        return shape_name(self.poles, self.zeros)

    @property
    def parameters(self) -> int:
        """Of numerator and denominator, the offset not counted."""
        return self.poles + self.zeros + 1


def shape_name(poles: int, zeros: int) -> str:
    """The name of a shape, as in Table I."""
    return f"{poles}p{zeros}z" if zeros else f"{poles}p"


def fit_integer_models(experiment: Excitation, has_offset: bool = True) -> tuple[IntegerFit, ...]:
    """Fit every shape of ``SHAPES`` to an experiment, with an offset or without.

    Raises FitError where one does not converge from any start.
    """
    made: dict[tuple[int, int], IntegerFit] = {}
    optima: dict[tuple[int, int], Array] = {}
    for poles, zeros in SHAPES:
        problem = _Projected(experiment, poles, zeros, has_offset)
        optima[poles, zeros] = x = _best(problem, _starts(experiment, poles, zeros, optima))
        made[poles, zeros] = problem.finished(x)
    return tuple(made.values())


def _best(problem: _Projected, starts: list[Array]) -> Array:
    """A few rounds from every start, then the best of them to its end."""
    stride = max(1, len(problem.experiment) // _SEARCHED)
    runs = [run for start in starts if (run := _run(problem, start, _FIRST_ROUNDS, stride)) is not None]
    best = min(runs, key=lambda run: run.cost, default=None)
    if best is not None and (stride > 1 or not best.success):
        best = _run(problem, best.x, _ROUNDS) or best
    if best is None:
        name = shape_name(problem.poles, problem.zeros)
        raise FitError(problem.experiment.name, f"no {name} model converges", "look at the log")
    made: Array = best.x
    return made


def _run(problem: _Projected, start: Array, rounds: int, stride: int = 1) -> OptimizeResult | None:
    most = rounds * (len(start) + 1)
    try:
        return least_squares(
            problem.residual, start, method="lm", xtol=1e-6, ftol=1e-8, max_nfev=most, args=(stride,)
        )
    except (ValueError, np.linalg.LinAlgError):
        return None


def _starts(
    experiment: Excitation, poles: int, zeros: int, optima: dict[tuple[int, int], Array]
) -> list[Array]:
    """Choices of distinct time constants, and the smaller shapes' optima with a pole added."""
    rates = [1.0 / (share * len(experiment)) for share in _STARTS[poles]]  # per sample
    starts = [_coefficients(np.array(chosen)) for chosen in combinations(rates, poles)]
    for smaller in ((poles - 1, zeros), (poles - 1, zeros - 1)):
        if smaller in optima:
            known = -_poles(smaller[0], optima[smaller])
            added = 1.0 if smaller[1] == zeros else 3.0 * float(np.abs(known).max())
            starts.append(_coefficients(np.append(known, min(added, 1.0))))
    return starts


def _coefficients(rates: Array) -> Array:
    """Logarithms of (a), (b, c) or (b, c, a) for poles at −rates; a complex pair stands in the quadratic."""
    rates = rates[np.argsort(-np.abs(rates.imag), kind="stable")]
    if len(rates) == 1:
        return np.log(rates.real)
    pair = np.array([(rates[0] + rates[1]).real, (rates[0] * rates[1]).real])
    made: Array = np.log(np.concatenate([pair, rates[2:].real]))
    return made


def _poles(count: int, x: Array) -> Array:
    """The poles, per sample."""
    c = np.exp(x)
    if count == 1:
        return np.array([-c[0]], complex)
    root = np.sqrt(complex(c[0] ** 2 - 4.0 * c[1]))
    far = -0.5 * (c[0] + root)  # the other by the product: no cancellation
    return np.array([far, c[1] / far, *(-c[2:])])


class _Projected:
    """The residual after the best numerator and offset, as a function of the denominator; time in samples."""

    def __init__(self, experiment: Excitation, poles: int, zeros: int, has_offset: bool) -> None:
        self.experiment, self.poles, self.zeros, self.has_offset = experiment, poles, zeros, has_offset
        self.spread = float(np.std(experiment.measured))
        slow, fast = np.log(1.0 / (_SLOWEST * len(experiment))), np.log(_FASTEST)
        self.edges: Numbers = np.array(
            {
                1: [(slow, fast)],
                2: [(slow, fast + 1), (2 * slow, 2 * fast)],
                3: [(slow, fast + 1), (2 * slow, 2 * fast), (slow, fast)],
            }[poles]
        ).T

    def inside(self, x: Array) -> Array:
        """``x`` with every coefficient within what the record can tell."""
        made: Array = np.clip(x, *self.edges)
        return made

    def basis(self, x: Array, stride: int = 1) -> Array:
        """Responses to the input of s^zeros/den, …, 1/den, and 1 for an offset, at every ``stride``-th
        sample; (samples, zeros + 1 or 2)."""
        poles = _apart(_poles(self.poles, self.inside(x)))
        single = [_respond(p, self.experiment)[::stride] for p in poles]
        slopes = [np.prod([p - q for j, q in enumerate(poles) if j != i]) for i, p in enumerate(poles)]
        weights = poles ** np.arange(self.zeros, -1, -1)[:, None] / np.array(slopes)
        rows = np.einsum(
            "kp,pn->kn", weights, np.array(single)
        ).real  # too little for BLAS to share among threads
        constant = [np.ones(rows.shape[1])] * self.has_offset
        return np.column_stack([*rows, *constant])

    def best(self, x: Array, stride: int = 1) -> tuple[Array, Array]:
        """Basis and the linear coefficients that fit best."""
        basis = self.basis(x, stride)
        sizes = np.linalg.norm(basis, axis=0)
        q, r = np.linalg.qr(basis / sizes)
        return basis, solve_triangular(r, q.T @ self.experiment.measured[::stride]) / sizes

    def residual(self, x: Array, stride: int = 1) -> Array:
        """Model − measured at every ``stride``-th sample, in units of the measured signal's spread."""
        basis, linear = self.best(x, stride)
        return (basis @ linear - self.experiment.measured[::stride]) / self.spread

    def finished(self, x: Array) -> IntegerFit:
        """The fit in units of seconds."""
        basis, linear = self.best(x)
        den = np.poly(_apart(_poles(self.poles, self.inside(x)))).real
        scale = self.experiment.step ** -np.arange(self.poles + 1.0)  # per sample → per second
        num = linear[: self.zeros + 1] * scale[self.poles - self.zeros : self.poles + 1]
        offset = float(linear[-1]) if self.has_offset else 0.0
        return IntegerFit(self.poles, self.zeros, num, den * scale, offset, basis @ linear)


def _apart(poles: Array) -> Array:
    """Coinciding poles a little apart, so that partial fractions hold."""
    made = poles.copy()
    for i in range(1, len(made)):
        if np.min(np.abs(made[:i] - made[i])) < _APART * abs(made[i]):
            made[i] *= 1.0 + 10.0 * i * _APART
    return made


def _respond(pole: complex, experiment: Excitation) -> Array:
    """1/(s − pole) at the samples, exactly for jumps and straight lines, as late as the experiment; time in
    samples."""
    if pole.imag == 0.0:
        pole = pole.real  # half the work
    course, decay = experiment.course, np.exp(pole)
    values, straight = (v[0].astype(type(decay)) for v in (course.values, course.straight))
    held, line = _driven(pole, 1.0)
    made: Array = lfilter([0.0, held], [1.0, -decay], values)
    made = made + lfilter([line], [1.0, -decay], straight) if np.any(straight) else made
    whole, part = divmod(experiment.late / experiment.step, 1.0)
    if part:  # where it was at a share of the sample
        held, line = _driven(pole, 1.0 - part)
        made = np.exp(pole * (1.0 - part)) * shifted(made, 1) + held * shifted(values, 1) + line * straight
    return shifted(made, int(whole))


def _driven(pole: complex, share: float) -> tuple[Any, Any]:
    """What is made, in a ``share`` of a sample, of 1, and of a line that rises to 1 by the sample's end."""
    held = np.expm1(pole * share) / pole
    small = abs(pole) * share <= 1e-4
    return held, share**2 * (0.5 + pole * share / 6.0) if small else (held - share) / pole
