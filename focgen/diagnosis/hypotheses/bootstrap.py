"""How much evidence noise alone gathers: sessions of the nominal rig simulated with noise of the colour
found, and diagnosed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.noise import coloured
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.search import rank
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.progress import say

_RARE = 0.02  # of the sessions without any effect may pass the threshold


def threshold(e: Explanation, candidates: Sequence[CandidateEffect], draws: int, least: float) -> float:
    """The nats of evidence over the whole library that noise exceeds in one of fifty sessions like this
    segment's.

    ``draws``: how many sessions are simulated; Gumbel's law of largest values is fitted to what they give,
    by moments (E. J. Gumbel, Statistics of Extremes, 1958). ``least``: nats that are asked for in any case.
    """
    rng = np.random.default_rng(0)
    gains = np.array([_largest(e, candidates, rng) for _ in range(draws)])
    scale = max(float(np.std(gains, ddof=1)) * np.sqrt(6.0) / np.pi, 0.5)
    found = float(gains.mean()) - 0.5772 * scale - scale * np.log(-np.log1p(-_RARE))
    place = f"{e.segment.entry} to {e.segment.exit}"
    say(f"{place}: noise alone gathers {gains.max():.1f} nats in {draws} sessions")
    made: float = max(found, least)
    return made


def _largest(e: Explanation, candidates: Sequence[CandidateEffect], rng: np.random.Generator) -> float:
    """The evidence of the best family in one simulated session."""
    best, segment = e.best, e.segment
    sigma = float(np.sqrt(best.sse / len(best.innovations))) * segment.level_out
    noise = np.concatenate([coloured(rng, last - first, e.ar, sigma) for first, last in segment.run.spans])
    y = e.nominal.problem.simulate(e.nominal.vector) + noise
    again = replace(e.nominal.problem, segment=replace(segment, y=y), memory={})
    ranking = rank(again, e.nominal.vector, candidates)
    return max(ranking.gain.values(), default=0.0)
