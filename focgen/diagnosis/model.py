"""What a diagnosis says, as it stands in ``diagnosis.json``."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from focgen.diagnosis.drawn import Drawn
from focgen.jsontext import UNWRITTEN
from focgen.rig.rig import Rig
from focgen.shown import Shown

Interval = tuple[float, float]


VERDICT = re.compile("named|set|unknown|parameters|none")
"""What a diagnosis may end in."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval, in ``unit``."""

    value: float
    ci95: Interval
    unit: str


@dataclass(frozen=True)
class Candidate:
    """An effect that may be the cause, in ``stage``. ``confidence``: probability; ``separation``: standard
    deviations behind the best; ``sizes``: how large it is, as one would measure it on the rig, whatever its
    form and that one's parameters are."""

    effect: str
    stage: str
    confidence: float
    form: str
    parameters: dict[str, Estimate]
    separation: float
    sizes: dict[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True)
class Found:
    """One effect found, in ``stage``: its candidates, likeliest first; ``shrink``: the share lost when it is
    left out."""

    stage: str
    candidates: tuple[Candidate, ...]
    shrink: float
    shrink_interval: Interval


@dataclass(frozen=True)
class Gap:
    """Root-mean-square errors of the output, experiments counted alike, in ``unit``; ``gof`` the same as eq.
    (4)."""

    as_given: float
    refitted: float
    explained: float
    floor: float
    unit: str
    gof: dict[str, float]


@dataclass(frozen=True)
class Where:
    """``stage``: the one that carries the gap, or None; ``inferred``: without its own signals; ``share`` by
    stage."""

    stage: str | None
    inferred: bool
    share: dict[str, float]
    regimes: dict[str, object]


@dataclass(frozen=True)
class PlainFit:
    """What one effect alone does for its segment of the chain: ``error`` is the root-mean-square residual
    with its best form, as a share of the refitted nominal's. A plain fit says nothing about certainty."""

    effect: str
    error: float


@dataclass(frozen=True)
class NextExperiment:
    """What would tell the rivals apart; ``expected_separation`` in standard deviations."""

    why: str
    what: str
    expected_separation: float
    inputs: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
    """The answer to where, which and how far. Files are named relative to ``--out``. ``notes``: what was done
    to the logs; ``warnings``: what in them is implausible. ``refitted`` and ``augmented``: the rigs of those
    files, ``drawn``: what its figures draw; None where it was read from a file."""

    verdict: str
    where: Where
    causes: tuple[Found, ...]
    gap: Gap
    shrink: float | None
    shrink_interval: Interval | None
    refitted_rig: str
    augmented_rig: str
    next_experiment: NextExperiment | None
    unexplained: dict[str, Any]
    notes: tuple[str, ...]
    fits: tuple[PlainFit, ...] = ()
    warnings: tuple[str, ...] = ()
    refitted: Rig | None = field(default=None, metadata=UNWRITTEN, repr=False, compare=False)
    augmented: Rig | None = field(default=None, metadata=UNWRITTEN, repr=False, compare=False)
    drawn: Drawn | None = field(default=None, metadata=UNWRITTEN, repr=False, compare=False)
