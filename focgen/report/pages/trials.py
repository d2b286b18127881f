"""The scores of blind trials as a page.

It shows every row beside its target, what confidences are worth, and what each effect was called.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.report.figures import Axis, Bars, Figure, Line, Panel
from focgen.report.page import Page, Section, TableOf
from focgen.report.pages.parts import number, sentence
from focgen.report.trials import LEAST
from focgen.trials.rows import Row
from focgen.trials.score import Scores
from focgen.trials.statistics import reliability, reliability_bins
from focgen.trials.tables import title


def trials_page(sets: Sequence[Scores]) -> Page:
    """The page of the scores of several trials."""
    return Page("How often the diagnosis is right", trials_lead(sets), tuple(map(section, sets)))


def trials_lead(sets: Sequence[Scores]) -> str:
    """What came out, in two sentences."""
    asked = [row for scores in sets for row in scores.rows if row.reached is not None]
    missed = [row for row in asked if row.reached is False]
    cases = sum(scores.cases for scores in sets)
    return (
        f"{cases} sealed cases were diagnosed blind. "
        f"{len(asked) - len(missed)} of {len(asked)} scores that have a target reach it."
    )


def section(scores: Scores) -> Section:
    """The scores as a section of a page: table, then figures."""
    table = TableOf(
        ("score", "value", "90 % interval", "cases", "to reach", "reached"),
        tuple(map(_line, scores.rows)),
        title(scores),
    )
    figures: tuple[Figure, ...] = (_reliability(scores),) if len(scores.stated) >= LEAST else ()
    figures += (_calls(scores),) if scores.confusions else ()
    return Section(
        f"Signals {scores.signals}, suite {scores.suite}",
        (sentence(title(scores)),),
        (table,),
        figures=figures,
    )


def _line(row: Row) -> tuple[str, ...]:
    spread = f"{row.interval[0]:.3f} to {row.interval[1]:.3f}" if row.interval else "–"
    reached = {True: "yes", False: "NO", None: "–"}[row.reached]
    return row.name.strip(), number(row.value), spread, str(row.cases), row.target or "–", reached


def _reliability(scores: Scores) -> Figure:
    """Hit rate over stated confidence; the intervals hold 90 % of calibrated tools."""
    confidence, right = zip(*scores.stated)
    whole, bins = reliability(confidence, right), reliability_bins(confidence, right, 8)
    stated, rate, low, high, _ = map(np.array, zip(*bins))
    spans = np.column_stack([low, high, np.full(len(low), np.nan)]).ravel()
    unit = np.array([0.0, 1.0])
    marks = (
        Line("perfect", unit, unit, "reference", "dashed", 1.0),
        Line("90 % of calibrated tools", np.repeat(stated, 3), spans, "measured", width=6.0),
        Line("measured", stated, rate, "model", dots=8.0),
    )
    rows = tuple(
        (number(s), number(r), f"{number(a)} to {number(b)}") for s, r, a, b in zip(stated, rate, low, high)
    )
    return Figure(
        "What a stated confidence is worth",
        f"How often causes stated at each confidence are so, of {whole['cases']}: calibration error "
        f"{whole['error']:.3f}, that of perfect calibration {whole['perfect']:.3f}, p = {whole['p']:.2f}.",
        "Curve: how often a cause is right over the confidence stated, near the diagonal of perfect "
        "calibration.",
        (
            Panel(
                Axis("stated confidence", low=0.0, high=1.03),
                Axis("how often it is so", low=0.0, high=1.05),
                marks,
                height=360,
            ),
        ),
        TableOf(("stated", "so", "90 % of calibrated tools"), rows, "Reliability, bins of equal count"),
    )


def _calls(scores: Scores) -> Figure:
    """Of every true effect, the share that was called by its name."""
    true = tuple(scores.confusions)[::-1]
    counts = [(scores.confusions[t].get(t, 0), sum(scores.confusions[t].values())) for t in true]
    shares = np.array([100.0 * hits / max(1, count) for hits, count in counts])
    bars = Bars(
        "called by its name",
        np.arange(len(true), dtype=float),
        shares,
        "good",
        names=true,
        across=True,
        width=0.7,
    )
    panel = Panel(
        Axis("called by its name (%)", from_zero=True, high=102.0),
        Axis("", places=true),
        (bars,),
        height=90 + 24 * len(true),
    )
    rows = tuple(
        (t, str(sum(calls.values())), ", ".join(f"{c} {n}" for c, n in calls.items()))
        for t, calls in scores.confusions.items()
    )
    return Figure(
        "What each effect was called",
        "Visible single effects: how many were called by their own name, the strongest candidate counting. "
        "The table says what the others were called.",
        f"Bars: share of the cases of {', '.join(true[::-1])} that were called so.",
        (panel,),
        TableOf(("true effect", "cases", "called"), rows, "What each was called"),
        linked=False,
    )
