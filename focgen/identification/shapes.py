"""Every shape of a stage fitted to its records, with intervals and Schwarz's criterion, and the choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from focgen.arrays import Array
from focgen.identification.input_noise import fair_square
from focgen.identification.noise import half_width, residual_model
from focgen.identification.projected import Problem, Solved, uncertainty
from focgen.identification.rational import SHAPES, Record, Shape, delay_of, parts
from focgen.identification.starts import best_of, scan, starts_of

T = TypeVar("T")

_FIRST_ROUNDS, _ROUNDS, _LAST_ROUNDS = 4, 12, 8  # of Levenberg–Marquardt: every start, best one, all samples
_ROUGHLY = 6000  # samples for all but the last rounds
_SMALL = 0.1  # of a record: a longer dead time needs more than a part of it
_NO_DELAY, _NO_LEAD = 0.1, 0.02  # samples: a dead time, or a lead, below it is none
MARGIN = 6.0  # of Schwarz's criterion: odds of e³ = 20 to 1 (Kass and Raftery, J. Am. Stat. Assoc. 90, 1995)


@dataclass(frozen=True)
class ShapeFit:
    """One shape as fitted. ``parameters`` maps a name to (value, half 95 % interval), times in s.

    ``bic`` is Schwarz's criterion (smaller is better); ``refused`` says why the shape cannot be taken, ""
    where it can.
    """

    shape: str
    parameters: dict[str, tuple[float, float]]
    bic: float
    gof: float
    refused: str = ""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A shape's optimum: the ``problem``, its solution, what is reported, and the ``covariance`` of
    (nonlinear parameters, shared weights), None where they cannot be told apart; ``independent`` samples are
    what the criterion counts."""

    shape: Shape
    problem: Problem
    solved: Solved
    covariance: Array | None
    independent: float
    report: ShapeFit

    @property
    def half(self) -> dict[str, float]:
        """Half intervals relative to the values."""
        return {k: h / abs(v) if v else np.inf for k, (v, h) in self.report.parameters.items()}

    @property
    def gain_unknown(self) -> bool:
        """Whether the gain's interval reaches 0."""
        return not self.half["gain"] < 1.0


def fit_shapes(records: Sequence[Record], step: float) -> list[Fitted]:
    """Every shape of ``SHAPES`` that converges; ``step`` is the sample time in s."""
    scans = {0: scan(records, 0), 1: scan(records, 1)}
    few = _few(records, max(float(starts[0][-1]) for starts in scans.values()))
    optima: dict[Shape, Array] = {}
    solved: dict[Shape, Solved] = {}
    for shape in SHAPES:
        rough = Problem(shape, few)
        x = _optimum(rough, starts_of(rough, optima, scans[min(shape.poles, 1)]))
        if x is not None:
            optima[shape] = x
            solved[shape] = _refined(Problem(shape, records), x)
    effective = _independent(records, min(solved.values(), key=lambda s: float(np.sum(s.left**2))))
    return [_fitted(Problem(shape, records), s, step, effective) for shape, s in solved.items()]


def refit(fitted: Fitted, records: Sequence[Record], step: float) -> Fitted:
    """A shape fitted to other, longer records from where it was."""
    problem = Problem(fitted.shape, records)
    solved = _refined(problem, fitted.solved.x)
    return _fitted(problem, solved, step, _independent(records, solved))


def _few(records: Sequence[Record], late: float) -> Sequence[Record]:
    """Parts of the records, enough to find an optimum roughly with a dead time of ``late`` samples."""
    few = parts(records, _ROUGHLY)
    return few if late < _SMALL * min(map(len, few)) else records


def choose(fits: Sequence[Fitted]) -> Fitted:
    """The simplest shape that can be, of those within the margin of the best one's criterion."""
    possible = [f for f in fits if not f.report.refused]
    return simplest([(f.report.bic, f.shape.parameters, f) for f in possible])


def simplest(rated: Sequence[tuple[float, int, T]]) -> T:
    """Of (criterion, parameters, fit), the fit of fewest parameters within the margin of the lowest."""
    lowest = min(bic for bic, _, _ in rated)
    near = [entry for entry in rated if entry[0] <= lowest + MARGIN]
    return min(near, key=lambda entry: (entry[1], entry[0]))[2]


def clearly_better(one: Fitted, other: Fitted) -> bool:
    """Whether the criterion of ``one`` is lower than that of ``other`` by more than the margin."""
    return one.report.bic < other.report.bic - MARGIN


def _optimum(problem: Problem, starts: list[Array]) -> Array | None:
    """A few rounds from every start, then the best of them further."""
    if _has_no_slope(problem):
        return starts[0]
    tried = [x for s in starts if (x := problem.fit(s, _FIRST_ROUNDS, 1e-3)) is not None]
    return problem.fit(best_of(problem, tried, 1)[0], _ROUNDS, 1e-5) if tried else None


def _refined(problem: Problem, x: Array) -> Solved:
    found = None if _has_no_slope(problem) else problem.fit(x, _LAST_ROUNDS, 1e-8)
    return problem.solved(x if found is None else found)


def _has_no_slope(problem: Problem) -> bool:
    """Whether there is nothing to follow: a gain alone, or its dead time, whole samples for a held input."""
    return problem.shape == Shape(0) or _by_whole_samples(problem)


def _by_whole_samples(problem: Problem) -> bool:
    return problem.shape == Shape(0, 0, True) and problem.records[0].hold == "zero"


def _independent(records: Sequence[Record], solved: Solved) -> float:
    """How many independent samples the residual stands for."""
    ends = np.cumsum([len(r) for r in records])[:-1]
    return sum(max(residual_model(part).effective, 3.0) for part in np.split(solved.left, ends))


def _fitted(problem: Problem, solved: Solved, step: float, independent: float) -> Fitted:
    spread, samples = _uncertainty(problem, solved)
    made = _parameters(problem, solved, spread, samples, step)
    bic = criterion(problem, solved, problem.shape.parameters, independent)
    report = ShapeFit(problem.shape.name, made, bic, fit_of(problem, solved), _refusal(problem, made, step))
    return Fitted(problem.shape, problem, solved, spread, independent, report)


def criterion(problem: Problem, solved: Solved, parameters: int, independent: float) -> float:
    """Schwarz's criterion of a stage with ``parameters``, for ``independent`` samples.

    A free initial state is known from a few samples however long the record: what it costs does not grow.
    """
    states = sum(len(own) - 1 for own in solved.own)
    misfit = independent * np.log(fair_square(problem, solved))
    return float(misfit + parameters * np.log(independent) + states)


def fit_of(problem: Problem, solved: Solved) -> float:
    """GOF, eq. (4), of all records together, each about its own mean."""
    return 1.0 - float(np.sqrt(np.mean(solved.left**2))) / problem.spread


def _uncertainty(problem: Problem, solved: Solved) -> tuple[Array | None, float]:
    try:
        return uncertainty(problem, solved, linear_only=_by_whole_samples(problem))
    except np.linalg.LinAlgError:
        return None, 3.0


def _parameters(
    problem: Problem, solved: Solved, spread: Array | None, effective: float, step: float
) -> dict[str, tuple[float, float]]:
    """Name → (value, half interval): the gradients of the named values carry the covariance over."""
    shape, x = problem.shape, np.concatenate([solved.x, solved.shared])
    names, values = _named(shape, x, step)
    if spread is None:
        return {name: (float(v), float("inf")) for name, v in zip(names, values)}
    nudges = np.maximum(1e-6 * np.abs(x), 1e-9)
    rows = [
        (_named(shape, x + d, step, names)[1] - _named(shape, x - d, step, names)[1]) / (2.0 * d.max())
        for d in np.diag(nudges)
    ]
    slopes = np.array(rows).T
    variance = np.einsum("ij,jk,ik->i", slopes, spread, slopes)
    half = half_width(np.where(variance >= 0.0, variance, np.inf), effective, len(x))  # rounding below 0
    made = {name: (float(v), float(h)) for name, v, h in zip(names, values, np.atleast_1d(half))}
    if _by_whole_samples(problem):
        made["delay"] = (made["delay"][0], step)  # a held input shows no part of a sample
    return made


def _named(
    shape: Shape, x: Array, step: float, names: Sequence[str] | None = None
) -> tuple[tuple[str, ...], Array]:
    """Names and values in s; ``names`` given keeps two real poles real and a pair a pair."""
    shared = x[len(x) - 1 - shape.zeros :]
    found = {"gain": shared[0]}
    if shape.poles == 1:
        found["T"] = step * np.exp(x[0])
    elif shape.poles == 2:
        found |= _of_two(float(np.exp(x[0])), float(np.exp(x[1])), step, names)
    if shape.zeros:
        found["zero"] = step * shared[1] / shared[0]
    if shape.delayed:
        found["delay"] = step * x[shape.poles]
    return tuple(found), np.array(list(found.values()))


def _of_two(wn: float, damping: float, step: float, names: Sequence[str] | None) -> dict[str, float]:
    real = damping > 1.0 if names is None else "T1" in names
    if not real:
        return {"wn": wn / step, "damping": damping}
    apart = np.sqrt(max(damping**2 - 1.0, 0.0))
    slow = (damping + apart) / wn
    return {"T1": step * slow, "T2": step / (wn**2 * slow)}


def _refusal(problem: Problem, made: dict[str, tuple[float, float]], step: float) -> str:
    """Why a shape cannot be what the data show."""
    held = problem.records[0].hold == "zero"
    delay, half = made.get("delay", (np.inf, 0.0))
    if -_NO_LEAD * step < delay < _NO_DELAY * step:
        return "no dead time"
    if delay < (_NO_LEAD + problem.earliest) * step and delay < 0.0:
        return "the command is out of step by more than is looked for"
    if abs(delay) - half <= 0.0 and (problem.shape.poles or not held):
        return "the dead time's interval reaches 0"
    zero, half = made.get("zero", (np.inf, 0.0))
    if zero < 0.0:
        return "the zero answers in the wrong direction first"
    if zero - half <= 0.0:
        return "the zero's interval reaches 0"
    if made.get("wn", (0.0, 0.0))[0] * step > np.pi:
        return "it would ring faster than samples can show"
    if problem.shape.poles > 1 and np.isinf(made["gain"][1]):
        return "its poles cannot be told apart"
    if not made["gain"][1] < abs(made["gain"][0]):
        return ""  # nothing is known then: said by whoever takes it
    vague = [name for name, spread in made.items() if name != "delay" and _is_vague(name, *spread, step)]
    return f"{vague[0]} is not determined" if vague else ""


def _is_vague(name: str, value: float, half: float, step: float) -> bool:
    """Whether the interval reaches 0; of a time constant, also whether e^(−step/T), which is seen, does."""
    samples = {"T": value, "T1": value, "T2": value, "wn": 1.0 / value}.get(name, step) / step
    return not half * max(1.0, 1.0 / samples) < abs(value)


def delay_seconds(fitted: Fitted, step: float) -> float:
    """The dead time in s; less than 0 where the drive was early."""
    return delay_of(fitted.shape, fitted.solved.x) * step
