"""What a candidate rig would make of an experiment that nobody has made yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import Rival
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.proposals.menu import Choice
from focgen.present import present
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.stages import LEAVES

_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class Part:
    """A segment of a candidate rig: its problem, the parameters it has, and what of its effects outlives the
    session."""

    problem: Problem
    vector: np.ndarray
    left: list[dict[str, float]]

    @classmethod
    def of(cls, fit: Fit) -> Part:
        """The segment as fitted, after the session."""
        problem = fit.problem
        left: list[dict[str, float]] = []
        segment = problem.segment.fed
        chain = Chain(problem.rig(fit.vector), problem.placed(fit.vector))
        chain.run(segment.x, segment.stages[0], segment.stages[-1], segment.run, segment.between, left=left)
        return cls(problem, fit.vector, left)

    @property
    def stages(self) -> tuple[str, str]:
        """Its first and last stage."""
        return self.problem.segment.stages[0], self.problem.segment.stages[-1]

    def chain(self, vector: np.ndarray | None = None) -> Chain:
        """It with these parameters, or its own."""
        vector = self.vector if vector is None else vector
        rig = self.problem.rig(vector)
        every = (*rig.known, *self.problem.placed(vector))
        after = tuple(replace(p, carried=c) for p, c in zip(every, self.left, strict=True))
        return Chain(replace(rig, known=after[: len(rig.known)]), after[len(rig.known) :])


@dataclass(frozen=True, eq=False)
class CandidateRig:
    """A candidate rig: the segment where ``rival`` is the cause, with those ``before`` and ``after`` it. Once
    it has made an experiment (``run``): ``entering`` (n,) what enters that segment, ``signals`` by role all
    that leaves a stage."""

    rival: Rival
    part: Part
    before: tuple[Part, ...]
    after: tuple[Part, ...]
    run: Run | None = None
    entering: np.ndarray = field(default_factory=lambda: np.zeros(0))
    signals: dict[str, np.ndarray] = field(default_factory=dict)

    def making(self, choice: Choice) -> CandidateRig:
        """The same having made the experiment."""
        clock = float(self.part.problem.segment.run.clock[-1])
        x = np.asarray(choice.input, float)
        run = Run.of([len(x)], [clock], choice.limits.h)
        if choice.limits.rest != 0.0 and not choice.limits.integrates:
            run.rest[0] = BALANCED
        taps: dict[str, np.ndarray] = {}
        for part in self.before:
            x = part.chain().run(x, *part.stages, run, tap=taps)
        entering = x
        for part in (self.part, *self.after):
            x = part.chain().run(x, *part.stages, run, tap=taps)
        return replace(
            self, run=run, entering=entering, signals={LEAVES[stage]: y for stage, y in taps.items()}
        )

    @property
    def coarse(self) -> int:
        """Readings of the session that one sample of its own stands for."""
        return max(1, round(present(self.run).h / self.part.problem.segment.run.h))

    def left_by(self, stage: str | None) -> np.ndarray:
        """What leaves ``stage``, or the segment."""
        return self.signals[LEAVES[stage or self.part.stages[-1]]]

    def slopes(self, stage: str | None) -> list[np.ndarray]:
        """What leaves ``stage`` or the segment by each parameter of the segment."""
        vector, base = self.part.vector, self.left_by(stage)
        first, last = self.part.stages
        found = []
        for i in range(len(vector)):
            moved = vector.copy()
            moved[i] += _STEP
            made = self.part.chain(moved).run(self.entering, first, stage or last, present(self.run))
            found.append((made - base) / _STEP)
        return found


def candidate_rigs(
    explanations: Sequence[Explanation], tied: Explanation, rivals: Sequence[Rival]
) -> list[CandidateRig]:
    """The candidate rigs, one for each of the ``rivals`` in the segment ``tied``."""
    at = next(i for i, e in enumerate(explanations) if e is tied)
    before = tuple(Part.of(e.best) for e in explanations[:at])
    after = tuple(Part.of(e.best) for e in explanations[at + 1 :])
    return [CandidateRig(r, Part.of(r.fit), before, after) for r in rivals]
