"""The rows of the score table: which cases each counts, what it measures, and what it should reach."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from focgen.present import present
from focgen.trials.judging import PROPOSED, Judged
from focgen.trials.statistics import interval, reliability
from focgen.trials.vocabulary import stage_of

BESIDE = ("correlation", "best fit", "oracle")
"""What a figure stands beside: the look of the residual (:mod:`focgen.trials.baselines`), the effect of the
lowest error on the given logs without any penalty, and the diagnosis that is told the effects."""


@dataclass(frozen=True)
class Row:
    """One figure: ``value`` with its 90 % ``interval`` over ``cases``; ``target`` and whether it is
    ``reached`` (None: none); ``beside``: the same figure of others, by their names in :data:`BESIDE`.
    """

    name: str
    value: float | None
    interval: tuple[float, float] | None
    cases: int
    target: str
    reached: bool | None
    beside: dict[str, float] = field(default_factory=dict)


_SIGNALS = "CBA"
_AT_LEAST, _AT_MOST = "≥", "≤"


@dataclass(frozen=True)
class _Measure:
    """``of`` gives a case's number; ``who`` the cases that count; ``target``: sense and limit, one or one for
    C, B, A. ``guessed``: the number of a case for which another method names one effect.
    """

    name: str
    who: Callable[[Judged], bool]
    of: Callable[[Judged], float]
    sense: str = _AT_LEAST
    limits: tuple[float, ...] = ()
    figure: Callable[..., Any] = np.mean
    guessed: Callable[[Judged, str], float] | None = None


def _visible(j: Judged) -> bool:
    return j.kind == "single" and j.visible


def _reporting(j: Judged) -> bool:
    return _visible(j) and (bool(j.reported) or j.verdict == "failed")


def _null(j: Judged) -> bool:
    return j.kind in ("none", "parameters")


def _promised(j: Judged) -> bool:
    return j.kind in ("single", "pair", "linear") and j.promise is not None and j.achieved is not None


def _error(j: Judged) -> float:
    return abs(present(j.promise) - present(j.achieved))


def _covered(j: Judged) -> bool:
    if j.promise_interval is None:
        return False
    return j.promise_interval[0] <= present(j.achieved) <= j.promise_interval[1]


def _hit(j: Judged, guess: str) -> bool:
    return guess in j.effects


def _staged(j: Judged, guess: str) -> bool:
    return stage_of(guess) in j.stages


def _severe(severity: str) -> Callable[[Judged], bool]:
    return lambda j: _visible(j) and j.severity == severity


def _one_stage(j: Judged) -> bool:
    return len(set(j.stages)) == 1


def _pair(j: Judged) -> bool:
    return j.kind == "pair" and j.visible


def _missed(j: Judged) -> bool:
    return _pair(j) and not j.found and j.forgone is not None


ROWS = (
    _Measure("top-1 effect", _visible, lambda j: j.top_right, limits=(0.92, 0.80, 0.72), guessed=_hit),
    _Measure("  … high severity", _severe("high"), lambda j: j.top_right),
    _Measure("  … mid severity", _severe("mid"), lambda j: j.top_right),
    _Measure("  … low severity", _severe("low"), lambda j: j.top_right),
    _Measure("stage right", _visible, lambda j: j.stage_right, limits=(0.98, 0.92, 0.88), guessed=_staged),
    _Measure(
        "named one effect, wrongly",
        _visible,
        lambda j: j.wrongly_named,
        _AT_MOST,
        (0.02, 0.03, 0.03),
        guessed=lambda j, guess: not _hit(j, guess),
    ),
    _Measure("truth in the reported set", _reporting, lambda j: j.in_set, limits=(0.97,), guessed=_hit),
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
    _Measure("pairs: both found", _pair, lambda j: j.found, limits=(0.88,)),
    _Measure("  … within one stage", lambda j: _pair(j) and _one_stage(j), lambda j: j.found),
    _Measure("  … across stages", lambda j: _pair(j) and not _one_stage(j), lambda j: j.found),
    _Measure("  … missed: the true pair closes < 0.02 more", _missed, lambda j: present(j.forgone) < 0.02),
    _Measure("pairs: false extras per case", _pair, lambda j: j.extras, _AT_MOST, (0.12,)),
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
        "sets: the proposal resolves what the menu can",
        lambda j: any(name != PROPOSED and so for name, so in j.resolved.items()),
        lambda j: j.resolved.get(PROPOSED, False),
        limits=(0.9,),
    ),
    _Measure("  … resolved, of all sets", lambda j: bool(j.resolved), lambda j: j.resolved[PROPOSED]),
    _Measure("  … by the best of the menu", lambda j: bool(j.resolved), lambda j: any(j.resolved.values())),
    _Measure(
        "one linear stage: top-1 effect", lambda j: j.kind == "linear" and j.visible, lambda j: j.top_right
    ),
    _Measure(
        "below visibility: named one effect, wrongly",
        lambda j: j.kind == "single" and not j.visible,
        lambda j: j.wrongly_named,
        _AT_MOST,
    ),
    _Measure(
        "median time, s",
        lambda j: j.seconds is not None,
        lambda j: present(j.seconds),
        _AT_MOST,
        (),
        np.median,
    ),
    _Measure(
        "longest time, s", lambda j: j.seconds is not None, lambda j: present(j.seconds), _AT_MOST, (), np.max
    ),
)


def rows(judged: Sequence[Judged], signals: str) -> tuple[Row, ...]:
    """Every row of the table; one without cases has no value."""
    plain = [_row(measure, judged, signals) for measure in ROWS]
    return (*plain, *_achieved(judged), *_reliability(judged))


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
        _beside(measure, judged),
    )


def _beside(measure: _Measure, judged: Sequence[Judged]) -> dict[str, float]:
    """The figure of those that always name one effect, over the cases in which they did."""
    if measure.guessed is None:
        return {}
    guesses: dict[str, Callable[[Judged], Any]] = {
        "correlation": lambda j: j.baseline,
        "best fit": lambda j: j.best_fit,
    }
    found = {}
    for name, guess in guesses.items():
        values = [float(measure.guessed(j, guess(j))) for j in judged if measure.who(j) and guess(j)]
        if values:
            found[name] = float(measure.figure(values))
    return found


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


def _achieved(judged: Sequence[Judged]) -> list[Row]:
    """Achieved shrink beside the oracle's, and the ratio of the means, over visible cases that have both.

    A case without a promise achieves nothing: its model is the refitted nominal.
    """
    pairs = np.array([(j.achieved or 0.0, j.oracle) for j in judged if j.visible and j.oracle is not None])
    name, target = "achieved shrink over the oracle's", "≥ 0.97"
    if len(pairs) == 0:
        return [Row("achieved shrink, mean", None, None, 0, "", None), Row(name, None, None, 0, target, None)]
    ours, count = pairs[:, 0], len(pairs)
    value = float(ours.mean() / pairs[:, 1].mean())
    picks = np.random.default_rng(0).integers(0, count, (2000, count))
    low, high = np.quantile([ours[p].mean() / pairs[p, 1].mean() for p in picks], (0.05, 0.95))
    mean = Row(
        "achieved shrink, mean",
        float(ours.mean()),
        interval(ours.tolist()),
        count,
        "",
        None,
        {"oracle": float(pairs[:, 1].mean())},
    )
    return [mean, Row(name, value, (float(low), float(high)), count, target, value >= 0.97)]


def _reliability(judged: Sequence[Judged]) -> list[Row]:
    """Of the first candidate of every cause, in all cases: how often it is there against how often it should
    be.
    """
    stated = stated_in(judged)
    found = reliability([c for c, _ in stated], [r for _, r in stated])
    if not stated:
        return [Row("confidences: calibration error", None, None, 0, "", None)]
    count = found["cases"]
    return [
        Row("confidences: calibration error", found["error"], None, count, "", None),
        Row("  … of perfect calibration, as many cases", found["perfect"], None, count, "", None),
        Row("  … bootstrap p", found["p"], None, count, "> 0.05", found["p"] > 0.05),
    ]


def stated_in(judged: Sequence[Judged]) -> list[tuple[float, bool]]:
    """(confidence, whether it is so) of the first candidate of every cause named in any case."""
    return [first for j in judged for first in j.first_confidences()]
