"""A time that the alignment of the columns has taken a part of gets it back.

A log is straight lines between samples, so a misalignment, or a dead time, of whole samples is a corner of
the sum of squares, and a fit may rest in one although another is likelier.
"""

from __future__ import annotations

from focgen.diagnosis.fitting.fit import Fit, Weighing, fit
from focgen.diagnosis.problem.problem import Problem

_TAKEN = 0.25  # of the slack: a misalignment below it is left


def realigned(best: Fit, weighing: Weighing) -> Fit:
    """``best``, or the likeliest of the fits with the columns aligned and one of the effects' times longer by
    what they were out of step."""
    place = len(best.problem.nominal_start)
    late = best.vector[place]
    if abs(late) < _TAKEN * best.problem.slack:
        return best
    low, high = best.problem.bounds()
    found = [best]
    for at, unit in _times(best.problem):
        start = best.vector.copy()
        start[place], start[at] = 0.0, start[at] + late * best.problem.segment.fed.run.h / unit
        if low[at] <= start[at] <= high[at]:
            found.append(fit(best.problem, start, weighing, 6))
    return min(found, key=lambda f: f.cost)


def _times(problem: Problem) -> list[tuple[int, float]]:
    """Where the effects' times are in the vector, and the s in one unit; those on a logarithmic scale have
    no zero to begin from."""
    parameters = [p for candidate in problem.candidates for p in candidate.form.parameters]
    clocks = problem.references.clocks
    return [
        (problem.head + i, clocks[p.clock])
        for i, p in enumerate(parameters)
        if p.time == 1 and p.level == 0 and not p.log
    ]
