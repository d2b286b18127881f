"""What the pages share: notes as sentences, and the numbers of curves as a table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from focgen.arrays import Array
from focgen.report.figures import Figure
from focgen.report.page import Section, TableOf


def sentence(line: str) -> str:
    """A line of text with a full stop, and a capital unless it begins with a name as files write it."""
    text = line.strip()
    first = text.partition(" ")[0]
    head = text[:1].upper() if first.rstrip(",.:;").isalpha() else text[:1]
    return f"{head}{text[1:]}{'' if text.endswith(('.', '!', '?', ':')) else '.'}"


def notes(said: Iterable[str]) -> tuple[str, ...]:
    """Notes as the page sets them apart."""
    return tuple(f"Note: {sentence(one)}" for one in said)


def warnings(said: Iterable[str]) -> tuple[str, ...]:
    """Warnings as the page sets them apart."""
    return tuple(f"Warning: {sentence(one)}" for one in said)


def number(value: float | None) -> str:
    """Four digits, or a dash where there is no number."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.4g}"


def curves_table(caption: str, curves: Sequence[tuple[str, Sequence[float] | Array]]) -> TableOf:
    """Of every curve, named, how it begins and ends and how far it reaches."""
    rows = []
    for name, values in curves:
        finite = np.asarray(values, float)
        finite = finite[np.isfinite(finite)]
        ends = (finite[0], finite.min(), finite.max(), finite[-1]) if len(finite) else (None,) * 4
        rows.append((name, *map(number, ends)))
    return TableOf(("curve", "first", "smallest", "largest", "last"), tuple(rows), caption)


def figures_of(sections: Iterable[Section]) -> tuple[Figure, ...]:
    """All figures of some sections, for a page that tells their story in its own words."""
    return tuple(figure for section in sections for figure in section.figures)
