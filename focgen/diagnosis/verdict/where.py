"""Where the gap lies: its share by stage, and the levels, directions, times that carry it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.fitting.fit import problem_residual
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.model import Found, Where

STAGES = ("regulator", "actuator", "sensor", "controller")


def stage_shares(
    found: Sequence[Found], unknown: Sequence[Explanation], explanations: Sequence[Explanation]
) -> dict[str, float]:
    """The part of the gap that each stage's causes carry; they sum to 1 where there is one. A segment that
    no effect explains carries its part of what inputs predict of all residuals."""
    weight = dict.fromkeys(STAGES, 0.0)
    for f in found:
        weight[f.stage] += max(f.shrink, 0.01)
    gaps = [_predictable_share(e) for e in explanations]
    for e in unknown:
        part = max(_predictable_share(e) / max(sum(gaps), 1e-300), 0.01)
        for stage in e.segment.stages:
            weight[stage] += part / len(e.segment.stages)
    total = sum(weight.values())
    return {k: v / total for k, v in weight.items()} if total else weight


def _predictable_share(e: Explanation) -> float:
    """What inputs predict of the nominal residual: mean square, as a share of the level's."""
    return float(np.mean(e.nominal.weighed**2)) * e.nominal_predictability.share


def locate(explanations: Sequence[Explanation], share: dict[str, float], found: Sequence[Found]) -> Where:
    """The stage with the largest share, and the regimes of its segment."""
    top = max(share, key=lambda k: share[k])
    if not share[top]:
        return Where(None, False, share, {})
    if top == "controller":  # replayed itself; residuals are those of the stages behind it
        return Where(top, False, share, {})
    segment = next((e for e in explanations if top in e.segment.stages), explanations[-1])
    merged = len(segment.segment.stages) > 1
    stage = None if merged and not found else top
    return Where(stage, merged, share, regimes(segment))


def regimes(e: Explanation) -> dict[str, object]:
    """The part of the nominal residual's mean square by level, direction and third of the session."""
    residual, x = problem_residual(e.nominal), np.abs(e.segment.x)
    square = residual**2 / max(float(np.sum(residual**2)), 1e-300)
    edges = np.linspace(0, x.max() or 1.0, 4)
    level = np.digitize(x, edges[1:-1])
    slope = np.where(e.segment.run.rest, 0.0, np.diff(x, prepend=0.0))
    moving = np.abs(slope) > 1e-6 * (x.max() or 1.0)
    third = np.digitize(np.arange(len(x)), np.array([1, 2]) * len(x) / 3)
    return {
        "level": {f"{edges[i]:.3g} to {edges[i + 1]:.3g}": float(square[level == i].sum()) for i in range(3)},
        "direction": {
            "rising": float(square[moving & (slope > 0)].sum()),
            "falling": float(square[moving & (slope < 0)].sum()),
            "held": float(square[~moving].sum()),
        },
        "time": {
            name: float(square[third == i].sum()) for i, name in enumerate(("first third", "second", "last"))
        },
        "frequency": _bands(e, residual),
        "depends_on": e.nominal_predictability.depends,
    }


def _bands(e: Explanation, residual: np.ndarray) -> dict[str, float]:
    response = e.nominal.problem.references.clocks["response"]
    edges, h = np.array([0.1, 1.0]) / response, e.segment.run.h
    power = np.zeros(3)
    for part in e.segment.parts(residual):
        f = np.fft.rfftfreq(len(part), h)
        np.add.at(power, np.digitize(f, edges), np.abs(np.fft.rfft(part)) ** 2)
    names = (f"below {edges[0]:.3g} Hz", f"to {edges[1]:.3g} Hz", "above")
    return {name: float(p / max(power.sum(), 1e-300)) for name, p in zip(names, power)}
