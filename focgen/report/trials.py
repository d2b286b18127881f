"""Pictures of scores: what confidences are worth, and what is called what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from focgen.report.style import COLOURS, figure, png
from focgen.trials.score import Scores
from focgen.trials.statistics import reliability, reliability_bins
from focgen.trials.vocabulary import VOCABULARY

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEAST = 20  # stated confidences below which a reliability picture says nothing


def pictures(sets: Sequence[Scores]) -> dict[str, bytes]:
    """PNG by file name: the reliability of every set with confidences enough, the confusions of each."""
    found = {}
    telling = [s for s in sets if len(s.stated) >= LEAST]
    if telling:
        found["reliability.png"] = reliability_picture(telling)
    for scores in sets:
        if scores.confusions:
            found[f"confusion_{scores.signals}_{scores.suite}.png"] = confusion_picture(scores)
    return found


def reliability_picture(sets: Sequence[Scores]) -> bytes:
    """Hit rate over stated confidence, bins of equal count; the bars hold 90 % of calibrated tools."""
    columns = min(3, len(sets))
    rows = -(-len(sets) // columns)
    with figure(rows, columns, size=(2.6 * columns + 0.4, 2.9 * rows + 0.3), squeeze=False) as (fig, axes):
        for axis in axes.ravel()[len(sets) :]:
            axis.set_visible(False)
        for axis, scores in zip(axes.ravel(), sets):
            _reliability(axis, scores)
        fig.supxlabel("stated confidence", fontsize=9)
        fig.supylabel("how often it is so", fontsize=9)
        return png(fig)


def _reliability(axis: Axes, scores: Scores) -> None:
    confidence, right = zip(*scores.stated)
    whole = reliability(confidence, right)
    bins = reliability_bins(confidence, right, 8)
    stated, rate, low, high, _ = map(np.array, zip(*bins))
    axis.plot([0, 1], [0, 1], color=COLOURS["reference"], lw=0.8)
    axis.vlines(stated, low, high, color=COLOURS["band"], lw=7, label="calibrated, 90 %")
    axis.plot(stated, rate, "o-", color=COLOURS["model"], lw=1.0, ms=4, label="measured")
    axis.set(xlim=(0, 1.03), ylim=(0, 1.05), aspect="equal")
    axis.set_title(f"{scores.signals}, {scores.suite}: {whole['cases']} causes", fontsize=9)
    text = f"error {whole['error']:.3f}\nperfect {whole['perfect']:.3f}\np = {whole['p']:.2f}"
    axis.text(0.05, 0.97, text, transform=axis.transAxes, va="top", fontsize=7.5)
    axis.legend(loc="lower right", fontsize=7, handlelength=1.2)


def confusion_picture(scores: Scores) -> bytes:
    """What each effect of the visible singles was called: share of its cases, with the counts."""
    true = [e for e in _ordered() if e in scores.confusions]
    true += [e for e in scores.confusions if e not in true]
    called = {c for row in scores.confusions.values() for c in row}
    names = [e for e in [*_ordered(), *true] if e in called or e in true]
    names = list(dict.fromkeys([*names, *sorted(called - set(names))]))
    counts = np.array([[scores.confusions[t].get(c, 0) for c in names] for t in true], float)
    shares = counts / counts.sum(axis=1, keepdims=True)
    size = (0.27 * len(names) + 2.6, 0.25 * len(true) + 2.2)
    with figure(1, 1, size=size) as (fig, axis):
        axis.grid(False)
        axis.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.3, aspect="auto")
        for i, j in zip(*np.nonzero(counts)):
            colour = "white" if shares[i, j] > 0.7 else "black"
            axis.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=7, color=colour)
        axis.set_yticks(range(len(true)), true)
        axis.set_xticks(range(len(names)), names, rotation=60, ha="right", rotation_mode="anchor")
        axis.set_ylabel("true effect")
        axis.set_xlabel("strongest candidate, or the verdict without one")
        axis.set_title(f"Visible singles, signals {scores.signals}, suite {scores.suite}")
        _frame(axis, true, names)
        return png(fig)


def _ordered() -> list[str]:
    """The vocabulary, stage by stage."""
    return list(VOCABULARY)


def _frame(axis: Axes, true: Sequence[str], names: Sequence[str]) -> None:
    """Lines between the stages, and the diagonal's cells framed."""
    for labels, line in ((true, axis.axhline), (names, axis.axvline)):
        stages = [VOCABULARY[e][0] if e in VOCABULARY else "" for e in labels]
        for i in range(1, len(stages)):
            if stages[i] != stages[i - 1]:
                line(i - 0.5, color=COLOURS["measured"], lw=0.7)
    for i, effect in enumerate(true):
        if effect in names:
            j = names.index(effect)
            axis.plot(
                [j - 0.5, j + 0.5, j + 0.5, j - 0.5, j - 0.5],
                [i - 0.5, i - 0.5, i + 0.5, i + 0.5, i - 0.5],
                color=COLOURS["measured"],
                lw=0.5,
            )
