"""A difference in words: the first sample, what went in, and what came out of either."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from focgen.plan.plan import Format, Plan
from focgen.plan.scenario import Reset, Track, Tune
from focgen.testing.candidates import events_of

if TYPE_CHECKING:
    from focgen.testing.equivalence import Judged


def difference(plan: Plan, headline: str, judged: Judged, counted: tuple[int, int], seed: int) -> str:
    """The message of a failed comparison."""
    places = np.argwhere(judged.wrong)
    lane, k = (int(i) for i in places[np.argmin(places[:, 1])])
    kind = "in a bit" if judged.allowed is None else "by more than the bound"
    return "\n".join(
        [
            f"{headline}: {counted[0]} of {counted[1]} samples differ {kind}",
            f'first in sample {k} of run {lane}, "{judged.trial.label}", seed {seed}:',
            *_inputs(plan, judged, lane, k),
            *_events(plan, judged, lane, k),
            *_outputs(plan, judged, (lane, k)),
        ]
    )


def _inputs(plan: Plan, judged: Judged, lane: int, k: int) -> list[str]:
    raw = judged.trial.raw
    found = [("ref", raw.ref, plan.error), ("meas", raw.meas, plan.error)]
    if plan.schedule and raw.sched is not None:
        found.append(("sched", raw.sched, plan.schedule.signal))
    return [f"  {name:<9} {_value(values[lane, k], form)}" for name, values, form in found]


def _events(plan: Plan, judged: Judged, lane: int, k: int) -> list[str]:
    """The latest tune, reset or track, which most differences have to do with."""
    events = events_of(judged.trial.raw, lane)
    latest = max((sample for sample in events if sample <= k), default=None)
    if latest is None:
        return ["  begun at rest"]
    when = "before it" if latest == k else f"before sample {latest}"
    return [f"  {when}: {', '.join(_call(plan, event) for event in events[latest])}"]


def _call(plan: Plan, event: Reset | Track | Tune) -> str:
    if isinstance(event, Tune):
        p, factor = event.params, plan.box.factor
        gains = ", ".join(_value(count, factor) for count in p.gain)
        return f"tune([{gains}], {_value(p.u_min, plan.output)}, {_value(p.u_max, plan.output)})"
    if isinstance(event, Track):
        return f"track({_value(event.u, plan.output)})"
    error = plan.error
    given = (event.ref, error), (event.meas, error), (event.u0, plan.output)
    return f"reset({', '.join(_value(*one) for one in given)})"


def _outputs(plan: Plan, judged: Judged, at: tuple[int, int]) -> list[str]:
    seen, form = judged.seen, plan.output
    if judged.allowed is None:
        told = "" if judged.flags is None else f", flags {judged.flags[at]}"
        own = "" if judged.flags is None or seen.flags is None else f", flags {seen.flags[at]}"
        return [
            f"  reference u = {_value(judged.u[at], form)}{told}",
            f"  candidate u = {_value(seen.u[at], form)}{own}",
        ]
    unit = f" {form.unit}".rstrip()
    return [
        f"  exact     u = {judged.u[at]:.9g}{unit}",
        f"  candidate u = {seen.u[at] * form.lsb:.9g}{unit}",
        f"  they are {judged.error[at]:.3g}{unit} apart, and {judged.allowed[at]:.3g}{unit} is allowed",
    ]


def _value(raw: Any, form: Format) -> str:
    """A raw value, and what it stands for."""
    unit = f" {form.unit}".rstrip()
    if form.floating:
        return f"{np.float32(raw) if form.ctype == 'float' else float(raw)!s}{unit}"
    shown = int(raw) if np.isfinite(raw) and float(raw).is_integer() else raw
    return f"{shown} ({float(raw) * form.lsb:.6g}{unit})"
