"""What a controller computes in words of few bits, wherever its arithmetic is not that of a generated one.

Inputs, increments and sums are rounded to their range over 2^bits, and a weight of less than half a count is
none (B. Widrow and I. Kollár, Quantization Noise, Cambridge 2008, ch. 15).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.control.controller import Controller
from focgen.plan.canonical import folded
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Scenario


@dataclass(frozen=True)
class WordLength:
    """Words of ``bits``, to which values are rounded ``down`` or else to the nearest."""

    bits: float
    down: bool = False

    def count(self, span: float) -> float:
        """What one count is of ``span``."""
        made: float = span * 2.0**-self.bits
        return made

    @property
    def ahead(self) -> float:
        """The part of a count that is added before the fraction is dropped."""
        return 0.0 if self.down else 0.5

    def rounded(self, values: np.ndarray | float, span: float) -> np.ndarray:
        """``values`` in whole counts of ``span``."""
        return _whole(np.asarray(values), self.count(span), self.ahead)


def _whole(values: np.ndarray, count: np.ndarray | float, ahead: np.ndarray | float) -> np.ndarray:
    made: np.ndarray = count * np.floor(values / count + ahead)
    return made


def with_word_length(
    controller: Controller, scenario: Scenario, kinds: Sequence[WordLength]
) -> list[np.ndarray]:
    """The output (lanes, samples) in each kind of words."""
    low, high = controller.ranges.output
    ahead = replace(controller, integrator=False)
    weights = folded(controller.transfer.num, controller.sample_time, controller.length).weights
    d = [ideal(ahead, _counted(controller, scenario, w), _reach(weights, w)).d for w in kinds]
    if not controller.integrator:
        return [np.clip(w.rounded(v, high - low), low, high) for w, v in zip(kinds, d)]
    d = [w.rounded(v, (high - low) / controller.sample_time) for w, v in zip(kinds, d)]
    return list(_integrated(controller, scenario, kinds, np.stack(d)))


def _integrated(
    controller: Controller, scenario: Scenario, kinds: Sequence[WordLength], d: np.ndarray
) -> np.ndarray:
    """The clamped trapezoid of ``d`` (kinds, lanes, samples), in whole counts."""
    low, high = controller.ranges.output
    rises = 0.5 * controller.sample_time * (d + np.concatenate([d[..., :1], d[..., :-1]], axis=-1))
    count = np.array([w.count(high - low) for w in kinds])[:, None]
    ahead = np.array([w.ahead for w in kinds])[:, None]
    now, out = np.zeros(d.shape[:-1]), np.empty(d.shape)
    for r in scenario.resets:
        now[:, r.lane] = r.u0
    for k in range(d.shape[-1]):
        now = _whole(np.clip(now + rises[..., k], low, high), count, ahead)
        out[..., k] = now
    return out


def _counted(controller: Controller, scenario: Scenario, word_length: WordLength) -> Scenario:
    """The same inputs in whole counts: the error in place of the reference."""
    span = max(map(abs, (*controller.ranges.reference, *controller.ranges.measurement)))
    resets = (
        replace(r, ref=float(word_length.rounded(r.ref - r.meas, span)), meas=0.0) for r in scenario.resets
    )
    error = word_length.rounded(scenario.ref - scenario.meas, span)
    return replace(scenario, ref=error, meas=np.zeros_like(error), resets=tuple(resets))


def _reach(weights: np.ndarray, word_length: WordLength) -> int:
    """The memory length: the last weight of at least half a count of the largest."""
    kept = np.flatnonzero(np.abs(weights) >= 0.5 * word_length.count(np.abs(weights).max()))
    return max(1, int(kept[-1]))
