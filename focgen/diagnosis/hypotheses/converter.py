"""A coarse converter, read off the levels that the output takes, and what can be told beside it.

A search does without it: steps have no slope. To the search a rounding in steps of q is an error of a root
mean square of at most q/√12, which real converters, with uneven or sluggish steps, exceed by little. What an
effect changes by less than that could be the converter's as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, Weighing, fit, problem_residual
from focgen.diagnosis.fitting.pinned import pinned
from focgen.diagnosis.hypotheses.blurred import noise_ahead, part_that_stays
from focgen.diagnosis.hypotheses.rivals import Cause, Rival, share_of
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.problem.problem import Problem
from focgen.rig import kernels
from focgen.rig.effects import form_of, library
from focgen.rig.effects._effect import Run, Values
from focgen.rig.placed import slot_in

_SHARP = 20_000  # parts of the range: what readings may lie off a level that is one
_READINGS = 2  # of one level at most, in the mean: then there is little between the levels
_REFITTED = 6  # iterations
_EASED = (0.2, 0.06)  # of a step: what it rises in, as it is fitted


@dataclass(frozen=True, eq=False)
class Converter:
    """The rounding ``candidate``, its ``entries`` of a problem's vector, its ``step`` as a share of the
    output's level, and the ``noise`` ahead of it, in steps."""

    candidate: CandidateEffect
    entries: tuple[float, ...]
    step: float
    noise: float = 0.0

    @property
    def uneven(self) -> float:
        """Root mean square, as a share of the output's level, that real steps miss the reading by, in the
        mean over noise that blurs them; no less than they miss ideal ones by."""
        return self.step * max(NUMBERS.uneven * part_that_stays(self.noise), NUMBERS.stepped)

    @property
    def blurred(self) -> bool:
        """Whether noise has made the reading follow what is ahead of the steps more closely than the steps:
        simulated without noise, they are no closer to it."""
        return part_that_stays(self.noise) < NUMBERS.stays

    @property
    def left(self) -> float:
        """The same where the steps are simulated."""
        return NUMBERS.stepped * self.step

    def sluggish(self, lag: float) -> Converter:
        """The same with levels that go on ``lag`` of a step late, on either way."""
        form = form_of(self.candidate.effect, "sluggish")
        entries = (*self.entries, lag)
        late = pinned(replace(self.candidate, form=form), entries)
        return replace(self, candidate=late, entries=entries)

    def explains(self, of: Fit) -> bool:
        """Whether the residual is no larger than what a converter's steps leave."""
        return rms(of.weighed) < NUMBERS.uneven * self.step

    def is_noise(self, nominal: Fit, alone: bool) -> bool:
        """Whether an error of q/√12 is next to nothing of what is left without any effect; where nothing else
        was found (``alone``), whether it is less than half of what no input predicts: every converter has
        steps."""
        left = float(np.mean(nominal.weighed**2))
        asked = NUMBERS.stays * (1.0 - nominal.predictable_share) if alone else NUMBERS.vain
        return self.step**2 / 12.0 < asked * left

    def beside(
        self, best: Fit, nominal: Fit, causes: tuple[Cause, ...], weighing: Weighing
    ) -> tuple[Fit, tuple[Cause, ...]]:
        """With the rounding put to what was found without it: a cause, and where it brings the model closer
        a part of it, by the samples' trust and by what users see. Where it is next to nothing of the gap
        beside what was found, or less than the noise by itself, it is noise."""
        if self.is_noise(nominal, alone=not causes):
            return best, causes
        both = self.stepped(best, weighing)
        rival = Rival(self.candidate.effect, self.candidate.stage, 0.0, 0.0, both)
        closer = rms(both.weighed) < rms(best.weighed) and _misses(both) < _misses(best)
        return both if closer else best, (*causes, Cause((rival,), 0.0, share_of(nominal, best, both)))

    def stepped(self, of: Fit, weighing: Weighing = WHITE) -> Fit:
        """A fit with the rounding behind it, made again: what was fitted to coarse steps as if they were the
        reading lies off by part of a step. Steps have no slope, so they are rounded off, first much and then
        little."""
        problem, vector = of.problem.with_candidates([*of.problem.candidates, self.candidate]), of.vector
        start = np.r_[vector, self.entries]
        found = [fit(problem, start, weighing, 0)]
        for width in _EASED:
            eased = replace(self.candidate, form=replace(self.candidate.form, act=partial(_eased, width)))
            soft = problem.with_candidates([*problem.candidates[:-1], eased])
            start = fit(soft, start, WHITE, _REFITTED).vector
            found.append(fit(problem, np.r_[start[: len(vector)], self.entries], weighing, 0))
        return min(found, key=lambda f: rms(f.weighed))


def _misses(of: Fit) -> float:
    """The root mean square of what a fit leaves, every sample alike: steps at a wrong time miss most where
    the output moves, and there samples are trusted least."""
    return rms(problem_residual(of))


def is_rounded(causes: Sequence[Cause]) -> bool:
    """Whether a rounding is among the effects found: a cause even where the best fit goes without it."""
    return any(library()[c.rivals[0].effect].rounds for c in causes)


def _eased(width: float, x: np.ndarray, values: Values, run: Run) -> np.ndarray:
    """Steps of ``values`` (step, phase and, of sluggish ones, lag), each risen in a part ``width`` of it, by
    a hyperbolic tangent."""
    step, phase, *lag = values
    x = kernels.play(x, run.rest, lag[0] * step) if lag else x
    whole = np.floor((x - phase) / step)
    part = (x - phase) / step - whole
    risen = np.tanh((part - 0.5) / width) / np.tanh(0.5 / width)
    made: np.ndarray = step * (whole + 0.5 + 0.5 * risen) + phase
    return made


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def converter_of(problem: Problem, candidates: Sequence[CandidateEffect]) -> Converter | None:
    """The one whose levels the segment's output shows, if any. Levels that noise has widened may be rests of
    the rig as well: then its refitted model has to move on while the reading stays on one, or rounding has to
    bring it closer."""
    for candidate in candidates:
        values = candidate.form.seen(problem.segment.y) if candidate.form.seen else None
        if values is not None:
            slot = slot_in(candidate.form, candidate.stage)
            scales = [problem.references.scale(p, slot) for p in candidate.form.parameters]
            entries = tuple(v / s for v, s in zip(values, scales))
            held = pinned(candidate, entries)
            found = Converter(held, entries, values[0] / problem.segment.level_out)
            levels = _levels(problem, candidate, values)
            if not (_is_sharp(problem, levels) or _is_read(problem, found, levels)):
                return None
            return replace(found, noise=_noise_ahead(problem, levels, values[0]))
    return None


def _noise_ahead(problem: Problem, levels: np.ndarray, step: float) -> float:
    """The noise ahead of a converter that reads ``levels`` (n,), in its steps, by the model as given: where
    that stays, the rig does, or moves slowly."""
    made = problem.simulate(problem.nominal())
    return noise_ahead(levels / step, made / step, problem.segment.run.spans)


def _levels(problem: Problem, candidate: CandidateEffect, values: Values) -> np.ndarray:
    """The output's readings (n,), each as the level it is of."""
    segment = problem.segment
    made: np.ndarray = candidate.form.act(segment.y, values, segment.run)
    return made


def _is_sharp(problem: Problem, levels: np.ndarray) -> bool:
    """Whether most readings are levels, but for the rounding of the file, or there are hardly more readings
    than levels: a finer converter behind the coarse one gives each level as its own nearest."""
    y = problem.segment.y
    few = len(np.unique(y)) <= _READINGS * len(np.unique(levels))
    return few or bool(_SHARP * np.median(np.abs(y - levels)) < np.ptp(y))


def _is_read(problem: Problem, found: Converter, levels: np.ndarray) -> bool:
    """Whether the ``levels`` (n,) are the reading's and no rests of the rig."""
    nominal = fit(problem, problem.nominal(), WHITE, _REFITTED)
    if _moves_on(nominal, levels):
        return True
    both, _ = found.beside(nominal, nominal, (), WHITE)
    return rms(both.weighed) < NUMBERS.unlikely * rms(nominal.weighed)


def _moves_on(nominal: Fit, levels: np.ndarray) -> bool:
    """Whether the model moves, while the reading stays on one of its ``levels`` (n,), by more than the
    reading does. A second effect may hide that its steps bring the model closer."""
    segment = nominal.problem.segment
    stay = np.cumsum((np.diff(levels, prepend=levels[0]) != 0.0) | (segment.run.rest != 0)) - 1
    made, count = nominal.problem.simulate(nominal.vector), np.bincount(stay)
    middle = np.bincount(stay, made) / count
    return rms(made - middle[stay]) > rms(segment.y - levels)
