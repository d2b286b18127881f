"""What a controller computes in words of few bits, wherever its arithmetic is not that of a generated one.

Inputs, increments and sums are rounded to their range over 2^bits, and a weight of less than half a count is
none (B. Widrow and I. Kollár, Quantization Noise, Cambridge 2008, ch. 15).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.control.controller import Controller
from focgen.fractional.weights import gl_weights
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Scenario


@dataclass(frozen=True)
class Words:
    """Words of ``bits``, to which values are rounded ``down`` or else to the nearest."""

    bits: float
    down: bool = False

    def rounded(self, values, span: float):
        """``values`` in whole counts of ``span``."""
        count = span * 2.0**-self.bits
        return count * np.floor(np.asarray(values) / count + (0.0 if self.down else 0.5))


def in_words(controller: Controller, scenario: Scenario, kinds: Sequence[Words]) -> list[np.ndarray]:
    """The output (lanes, samples) in each kind of words."""
    low, high = controller.ranges.output
    ahead = replace(controller, integrator=False)
    d = [ideal(ahead, _counted(controller, scenario, w), _reach(controller, w)).d for w in kinds]
    if not controller.integrator:
        return [np.clip(w.rounded(v, high - low), low, high) for w, v in zip(kinds, d)]
    d = [w.rounded(v, (high - low) / controller.sample_time) for w, v in zip(kinds, d)]
    return list(_integrated(controller, scenario, kinds, np.stack(d)))


def _integrated(
    controller: Controller, scenario: Scenario, kinds: Sequence[Words], d: np.ndarray
) -> np.ndarray:
    """The clamped trapezoid of ``d`` (kinds, lanes, samples), in whole counts."""
    low, high = controller.ranges.output
    rises = 0.5 * controller.sample_time * (d + np.concatenate([d[..., :1], d[..., :-1]], axis=-1))
    count = (high - low) * 2.0 ** -np.array([w.bits for w in kinds])[:, None]
    ahead = np.array([0.0 if w.down else 0.5 for w in kinds])[:, None]
    now, out = np.zeros(d.shape[:-1]), np.empty(d.shape)
    for r in scenario.resets:
        now[:, r.lane] = r.u0
    for k in range(d.shape[-1]):
        now = count * np.floor(np.clip(now + rises[..., k], low, high) / count + ahead)
        out[..., k] = now
    return out


def _counted(controller: Controller, scenario: Scenario, words: Words) -> Scenario:
    """The same inputs in whole counts: the error in place of the reference."""
    span = max(map(abs, (*controller.ranges.reference, *controller.ranges.measurement)))
    resets = (replace(r, ref=float(words.rounded(r.ref - r.meas, span)), meas=0.0) for r in scenario.resets)
    error = words.rounded(scenario.ref - scenario.meas, span)
    return replace(scenario, ref=error, meas=np.zeros_like(error), resets=tuple(resets))


def _reach(controller: Controller, words: Words) -> int:
    """The memory length: the last weight of at least half a count of the largest."""
    total = np.zeros(controller.length + 1)
    for term in controller.transfer.num:
        weights = gl_weights(term.order, controller.length)
        total += term.coefficient * controller.sample_time**-term.order * weights
    kept = np.flatnonzero(np.abs(total) >= 0.5 * np.abs(total).max() * 2.0**-words.bits)
    return max(1, int(kept[-1]))
