"""The rows of the score table: which cases each counts, what it measures, and what it should reach."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from focgen.trials.judging import Judged
from focgen.trials.statistics import interval, reliability


@dataclass(frozen=True)
class Row:
    """One figure: ``value`` with its 90 % ``interval`` over ``cases``; ``target`` and whether it is
    ``reached`` (None: none).
    """

    name: str
    value: float | None
    interval: tuple[float, float] | None
    cases: int
    target: str
    reached: bool | None


_SIGNALS = "CBA"
_AT_LEAST, _AT_MOST = "≥", "≤"


@dataclass(frozen=True)
class _Measure:
    """``of`` gives a case's number; ``who`` the cases that count; ``target``: sense and limit, one or one for
    C, B, A.
    """

    name: str
    who: Callable[[Judged], bool]
    of: Callable[[Judged], float]
    sense: str = _AT_LEAST
    limits: tuple[float, ...] = ()
    figure: Callable = np.mean


def _visible(j: Judged) -> bool:
    return j.kind == "single" and j.visible


def _reporting(j: Judged) -> bool:
    return _visible(j) and (bool(j.reported) or j.verdict == "failed")


def _null(j: Judged) -> bool:
    return j.kind in ("none", "parameters")


def _promised(j: Judged) -> bool:
    return j.kind in ("single", "pair", "linear") and j.promise is not None and j.achieved is not None


def _error(j: Judged) -> float:
    return abs(j.promise - j.achieved)


def _covered(j: Judged) -> bool:
    return j.promise_interval is not None and j.promise_interval[0] <= j.achieved <= j.promise_interval[1]


def _baselined(j: Judged) -> bool:
    return _visible(j) and j.baseline is not None


def _fitted(j: Judged) -> bool:
    return _visible(j) and j.best_fit is not None


ROWS = (
    _Measure("top-1 effect", _visible, lambda j: j.top_right, limits=(0.92, 0.80, 0.72)),
    _Measure("  … by residual correlation", _baselined, lambda j: j.baseline in j.effects),
    _Measure("  … by plain best fit", _fitted, lambda j: j.best_fit in j.effects),
    _Measure("stage right", _visible, lambda j: j.stage_right, limits=(0.98, 0.92, 0.88)),
    _Measure("named one effect, wrongly", _visible, lambda j: j.wrongly_named, _AT_MOST, (0.02, 0.03, 0.03)),
    _Measure("truth in the reported set", _reporting, lambda j: j.in_set, limits=(0.97,)),
    _Measure("  … its mean size", _reporting, lambda j: len(j.reported), _AT_MOST, (1.3, 2.0, 2.4)),
    _Measure(
        "false alarm on none or parameter error",
        _null,
        lambda j: j.caused or j.verdict in ("unknown", "failed"),
        _AT_MOST,
        (0.02,),
    ),
    _Measure("unknown caught", lambda j: j.kind == "outside", lambda j: j.says_unknown, limits=(0.90,)),
    _Measure(
        "known wrongly abstained", _visible, lambda j: j.verdict in ("unknown", "failed"), _AT_MOST, (0.06,)
    ),
    _Measure(
        "pairs: both found", lambda j: j.kind == "pair" and j.visible, lambda j: j.found, limits=(0.88,)
    ),
    _Measure(
        "pairs: false extras per case",
        lambda j: j.kind == "pair" and j.visible,
        lambda j: j.extras,
        _AT_MOST,
        (0.12,),
    ),
    _Measure("singles: false extras per case", _visible, lambda j: j.extras, _AT_MOST),
    _Measure("promised shrink: median error", _promised, _error, _AT_MOST, (0.04,), np.median),
    _Measure("promised shrink: within 0.10", _promised, lambda j: _error(j) <= 0.10, limits=(0.85,)),
    _Measure("promised shrink: 90 % interval covers", _promised, _covered, "in", (0.85, 0.95)),
    _Measure(
        "unidentifiable: says so and resolves",
        lambda j: j.kind == "unidentifiable",
        lambda j: j.says_tied,
        limits=(0.9,),
    ),
    _Measure(
        "one linear stage: top-1 effect", lambda j: j.kind == "linear" and j.visible, lambda j: j.top_right
    ),
    _Measure(
        "below visibility: named one effect, wrongly",
        lambda j: j.kind == "single" and not j.visible,
        lambda j: j.wrongly_named,
        _AT_MOST,
    ),
    _Measure("median time, s", lambda j: j.seconds is not None, lambda j: j.seconds, _AT_MOST, (), np.median),
    _Measure("longest time, s", lambda j: j.seconds is not None, lambda j: j.seconds, _AT_MOST, (), np.max),
)


def rows(judged: Sequence[Judged], signals: str) -> tuple[Row, ...]:
    """Every row of the table; one without cases has no value."""
    plain = [_row(measure, judged, signals) for measure in ROWS]
    return (*plain, *_oracle(judged), *_reliability(judged))


def _row(measure: _Measure, judged: Sequence[Judged], signals: str) -> Row:
    values = [float(measure.of(j)) for j in judged if measure.who(j)]
    target = _target(measure, signals)
    if not values:
        return Row(measure.name, None, None, 0, target, None)
    value = float(measure.figure(values))
    return Row(
        measure.name,
        value,
        interval(values, measure.figure),
        len(values),
        target,
        _reaches(value, measure, signals),
    )


def _limit(measure: _Measure, signals: str) -> float:
    return measure.limits[_SIGNALS.index(signals) if len(measure.limits) == 3 else 0]


def _target(measure: _Measure, signals: str) -> str:
    if not measure.limits:
        return ""
    if measure.sense == "in":
        return f"{measure.limits[0]:g} … {measure.limits[1]:g}"
    return f"{measure.sense} {_limit(measure, signals):g}"


def _reaches(value: float, measure: _Measure, signals: str) -> bool | None:
    if not measure.limits:
        return None
    if measure.sense == "in":
        return measure.limits[0] <= value <= measure.limits[1]
    limit = _limit(measure, signals)
    return value >= limit - 1e-9 if measure.sense == _AT_LEAST else value <= limit + 1e-9


def _oracle(judged: Sequence[Judged]) -> list[Row]:
    """Achieved shrink over the oracle's: the ratio of the means over visible cases that have both.

    A case without a promise achieves nothing: its model is the refitted nominal.
    """
    pairs = np.array([(j.achieved or 0.0, j.oracle) for j in judged if j.visible and j.oracle is not None])
    name, target = "achieved shrink over the oracle's", "≥ 0.97"
    if len(pairs) == 0:
        return [Row(name, None, None, 0, target, None)]
    value = float(pairs[:, 0].mean() / pairs[:, 1].mean())
    picks = np.random.default_rng(0).integers(0, len(pairs), (2000, len(pairs)))
    drawn = [pairs[p, 0].mean() / pairs[p, 1].mean() for p in picks]
    low, high = np.quantile(drawn, (0.05, 0.95))
    return [Row(name, value, (float(low), float(high)), len(pairs), target, value >= 0.97)]


def _reliability(judged: Sequence[Judged]) -> list[Row]:
    """Of the first candidate of every cause, in all cases: how often it is there against how often it should
    be.
    """
    stated = [first for j in judged for first in j.first_confidences()]
    found = reliability([c for c, _ in stated], [r for _, r in stated])
    if not stated:
        return [Row("confidences: calibration error", None, None, 0, "", None)]
    count = found["cases"]
    return [
        Row("confidences: calibration error", found["error"], None, count, "", None),
        Row("  … of perfect calibration, as many cases", found["perfect"], None, count, "", None),
        Row("  … bootstrap p", found["p"], None, count, "> 0.05", found["p"] > 0.05),
    ]


def table(found: Sequence[Row]) -> str:
    """The rows as text."""
    lines = [f"{'score':46s} {'value':>7s}  {'90 % interval':17s} {'cases':>5s}  reach"]
    for row in found:
        value = "–" if row.value is None else f"{row.value:.3f}"
        spread = f"[{row.interval[0]:.3f}, {row.interval[1]:.3f}]" if row.interval else ""
        mark = {True: "", False: "  missed", None: ""}[row.reached]
        lines.append(f"{row.name:46s} {value:>7s}  {spread:17s} {row.cases:5d}  {row.target}{mark}")
    return "\n".join(lines)
