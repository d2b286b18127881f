"""The fit to all experiments at once: beside what the input was before them, what the command does between
their samples, and the loop that a rig may go round in. Each of these shows only beside the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.errors import FitError
from focgen.identification.excitation import Excitation, possible_rests
from focgen.identification.looped import Fitted, again, fitted
from focgen.identification.ready import apart, as_it_runs, befores_of, ready_for
from focgen.identification.sure import misfit_of
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig

Befores = list[float | None]

_TOLD = 20.0  # nats, of residuals that are not white: then the output tells one from the other


@dataclass(frozen=True, eq=False)
class JointFit:
    """``rig``: with what its command does between samples; ``found``: the fit, with all that its intervals
    allow for; ``plain``: the experiments without the loop that it may be beside; ``lowered``: what is said
    where the degree of K(p) was lowered; ``lead``: s by which the command is ahead of its rows."""

    rig: Rig
    found: Fitted
    plain: list[Excitation]
    lowered: tuple[str, ...]
    lead: float = 0.0


def joint_fit(
    used: Sequence[Experiment], rig: Rig, degree: int, delay: bool, rival: Rig | None = None
) -> JointFit:
    """The fit to the experiments ``used``. What the input was before them is found without a loop, and again
    with one where the model lacks something. ``rival``: a rig that may have driven them as well: the numbers
    are known no better than they are apart by it.

    Raises FitError where the logs do not determine the parameters.
    """
    befores = befores_of(used, rig, degree + 1)
    try:
        made = _fit(used, befores, rig, degree, delay)
    except FitError:
        if (looped := _looped_otherwise(used, befores, rig, degree, delay)) is None:
            raise
        return looped
    if rival is not None and not made.found.width:
        made = _beside(made, _or_none(used, befores, rival, degree, delay))
    if not (made.found.width or misfit_of(made.plain, made.found.fit)):
        return made
    looped = _looped_otherwise(used, befores, rig, degree, delay)
    if looped is None or (made.found.width and made.found.left <= looped.found.left):
        return made
    return looped


def _or_none(
    used: Sequence[Experiment], befores: Befores, rig: Rig, degree: int, delay: bool
) -> JointFit | None:
    try:
        return _fit(used, befores, rig, degree, delay)
    except FitError:
        return None


def _beside(made: JointFit, rival: JointFit | None) -> JointFit:
    """A fit beside that of a ``rival`` that may have driven the experiments: the likelier of the two where
    the output tells, else the first, with intervals that reach to the other. Raises FitError where that
    leaves nothing of T."""
    if rival is None or rival.found.width:
        return made
    fit, other = made.found.fit, rival.found.fit
    count = sum(map(len, made.plain))
    nats = 0.5 * count * np.log(max(rival.found.left, 1e-300) / max(made.found.left, 1e-300))
    if abs(nats) > _TOLD:
        return made if nats > 0.0 else replace(rival, rig=made.rig)
    half: dict[str, Any] = dict(fit.half)
    half |= {name: half[name] + by for name, by in apart(fit, other).items()}
    if half["T"] >= fit.T:
        what = "is not told from what a quick regulator does within a sample"
        raise FitError("T", what, "log more samples a second, or leave out the pressure")
    return replace(made, found=replace(made.found, fit=replace(fit, half=half)))


def _looped_otherwise(
    used: Sequence[Experiment], befores: Befores, rig: Rig, degree: int, delay: bool
) -> JointFit | None:
    """Of the fits beside a loop, where the input was something else before the experiments than these
    ``befores``, namely what each begins with, or 0, the one that leaves least; None where there is none."""
    ways, found = [possible_rests(e) for e in used], []
    for other in ([way[k] for way in ways] for k in (0, -1)):
        if other == befores:
            continue
        try:
            found.append(_fit(used, other, rig, degree, delay))
        except FitError:
            continue
    return min((one for one in found if one.found.width), key=lambda one: one.found.left, default=None)


def _fit(used: Sequence[Experiment], befores: Befores, rig: Rig, degree: int, delay: bool) -> JointFit:
    runs = as_it_runs(used, befores, rig, degree, delay)
    plain, lowered = ready_for(used, befores, runs.rig, degree, runs.lead)
    found = fitted(plain, delay)
    pasts = found.fit.pasts if any(past is not None for past in found.fit.pasts) else ()
    if found.width or pasts:  # what a command does shows beside the loop, and the past, alone
        runs = replace(runs, apart={}, least={}) if found.width else runs
        other = as_it_runs(used, befores, rig, degree, delay, found.width, pasts)
        ready, _ = ready_for(used, befores, other.rig, degree, other.lead)
        if new := again(found, [x.behind(found.width) for x in ready], delay):
            runs, plain, found = other, ready, new
    half = found.fit.half
    known = {name: half[name] + by for name, by in runs.apart.items()}
    known |= {name: np.maximum(half[name], by) for name, by in runs.least.items() if name in ("T", "alpha")}
    found = replace(found, fit=replace(found.fit, half=half | known))
    return JointFit(runs.rig, found, plain, lowered, runs.lead)
