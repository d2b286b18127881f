"""The experiment that best tells the rivals apart, per second of rig time.

For rivals A and B the expected separation is the distance of their outputs in units of the noise, as far as
B cannot take it up by moving its parameters (T-optimality, A. C. Atkinson and V. V. Fedorov, Biometrika 62,
1975), with what the logs have already told about them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.excitation import excitation
from focgen.diagnosis.explain import Explanation
from focgen.diagnosis.menu import Choice, menu
from focgen.diagnosis.model import Found, NextExperiment
from focgen.diagnosis.noise import whiten
from focgen.diagnosis.rivals import Rival
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run, library
from focgen.rig.engine import Chain

_ENOUGH = 3.0  # standard deviations
_MOST = 99.0
_RIVALS = 3  # of those tied, the likeliest
_ROLES = {"regulator": "pressure", "actuator": "curvature"}


def propose(
    logs: Sequence[Experiment], explanations: Sequence[Explanation], found: Sequence[Found]
) -> NextExperiment | None:
    """For the least certain cause with rivals; None where nothing is tied."""
    for e in explanations:
        for cause in e.causes:
            names = {c.effect for f in found for c in f.candidates if len(f.candidates) > 1}
            rivals = [r for r in cause.rivals if r.effect in names]
            if len(rivals) > 1 and cause.rivals[0].effect in names:
                return _between(logs, e, rivals[0], rivals[1 : 1 + _RIVALS])
    return None


def _between(logs, e: Explanation, a: Rival, others: Sequence[Rival]) -> NextExperiment:
    """The experiment that tells ``a`` from the ``others``: what counts is the one that it tells least."""
    response = a.fit.problem.references.clocks["response"]
    entry, h = e.segment.entry, logs[0].sample_time
    choices = _showing(menu(e.segment.level_in, response, h), [a, *others], response)
    asked = [(c, None) for c in choices] + [(c, s) for c in choices[:4] for s in e.segment.stages[:-1]]
    options = [(min(_separation(e, a, b, c, stage) for b in others), c, stage) for c, stage in asked]
    good = [o for o in options if o[0] >= _ENOUGH] or [max(options, key=lambda o: o[0])]
    value, choice, stage = max(good, key=lambda o: o[0] / np.sqrt(o[1].seconds))
    logged = f", with the {_ROLES[stage]} logged" if stage else ""
    rivals = [r.effect for r in others]
    return NextExperiment(
        f"telling {a.effect} from {' and '.join(rivals)}{_lacking(e, [a.effect, *rivals])}",
        f"{choice.what}, on the {entry} from 0 to {e.segment.level_in:.4g}, {choice.seconds:.0f} s{logged}",
        float(min(value, _MOST)),
        {"seconds": choice.seconds, "also_log": _ROLES.get(stage), "rivals": [a.effect, *rivals]},
    )


def _showing(choices: Sequence[Choice], rivals: Sequence[Rival], response: float) -> list[Choice]:
    """The experiments that are made to show most of the rivals."""
    needs = [library()[r.effect].needs for r in rivals]
    made = [excitation([c.command], c.h, response) for c in choices]
    hidden = [sum(need(e) is not None for need in needs) for e in made]
    return [c for c, count in zip(choices, hidden, strict=True) if count == min(hidden)]


def _lacking(e: Explanation, names: Sequence[str]) -> str:
    """What the segment's experiments lack to show any of the effects."""
    missing = dict.fromkeys(m for name in names if (m := e.nominal.problem.lacks(name)))
    return f" (so far, {'; '.join(missing)})" if missing else ""


def _separation(e: Explanation, a: Rival, b: Rival, choice: Choice, stage: str | None) -> float:
    """Expected standard deviations between the two on the choice, seen at the output or at what leaves
    ``stage``."""
    run = Run.of([len(choice.command)], [float(e.segment.run.clock[-1])], choice.h)
    last = stage or e.segment.stages[-1]

    def output(rival: Rival, vector: np.ndarray) -> np.ndarray:
        problem = rival.fit.problem
        chain = Chain(problem.rig(vector), problem.placed(vector))
        return chain.run(choice.command, e.segment.stages[0], last, run)

    fit = b.fit
    base = output(b, fit.vector)
    level = e.segment.level_out if stage is None else max(float(np.max(np.abs(base))), 1e-300)
    per = max(1, int(round(e.segment.run.h / choice.h))) if choice.h < e.segment.run.h else 1
    sigma2 = fit.sse / len(fit.innovations)

    def seen(y: np.ndarray) -> np.ndarray:
        return whiten(y / level, e.ar)[::per]

    difference = seen(output(a, a.fit.vector) - base)
    columns = []
    for i in range(len(fit.vector)):
        moved = fit.vector.copy()
        moved[i] += 1e-4
        columns.append(seen(output(b, moved) - base) / 1e-4)
    jacobian = np.stack(columns, axis=1)
    information = fit.information + jacobian.T @ jacobian
    slope = jacobian.T @ difference
    left = float(difference @ difference - slope @ np.linalg.pinv(information) @ slope)
    # what tells them apart is not the size but its square over the spread of the likelihood ratio
    return float(np.sqrt(max(left, 0.0) / max(sigma2, 1e-300)) / 2)
