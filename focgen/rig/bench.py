"""One stage of a rig on the bench, with an effect and without it, to read off how large the effect is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.between import Between
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.placed import Placed
from focgen.rig.rig import Rig

_BEHIND = 3.0  # response times: then what a hold still does is slow


@dataclass(frozen=True, eq=False)
class Bench:
    """The stage that the effects ``placed`` are in. ``inputs`` (n,): what entered it in a session, ``step`` s
    apart, from ``begin`` to ``end`` on the session's clock; ``response``: the rig's response time, s."""

    rig: Rig
    placed: tuple[Placed, ...]
    inputs: Array
    step: float
    begin: float
    end: float
    response: float

    @property
    def stage(self) -> str:
        """Which stage it is."""
        return self.placed[0].stage

    @property
    def low(self) -> float:
        """The lowest input of the session."""
        return float(np.min(self.inputs))

    @property
    def high(self) -> float:
        """The highest input of the session."""
        return float(np.max(self.inputs))

    @property
    def hold(self) -> tuple[float, float]:
        """Two times of a hold, s, one ten times the other: behind the rig's response, as round numbers."""
        early = _BEHIND * self.response
        power = 10.0 ** np.floor(np.log10(early))
        early = power * min((1.0, 2.0, 5.0, 10.0), key=lambda n: abs(np.log(n * power / early)))
        return float(early), 10.0 * float(early)

    def number(self, name: str) -> float:
        """A parameter of the effects by its name."""
        return self.placed[0].named[name]

    @property
    def top(self) -> float:
        """The input of the session that is farthest from 0."""
        return self.high if self.high >= -self.low else self.low

    def of(self, rig: Rig, values: Sequence[Sequence[float]]) -> Bench:
        """The same with other numbers of the rig and of the effects."""
        placed = tuple(replace(p, values=tuple(v)) for p, v in zip(self.placed, values))
        return replace(self, rig=rig, placed=placed)

    def run(self, x: Array, h: float, effect: bool = True, at: float | None = None) -> Array:
        """What leaves the stage when ``x`` (n,) enters, in lines between samples of ``h`` s, from equilibrium
        with its first value; with the effects or without. ``at``: where the session's clock stands still."""
        rig = replace(self.rig, known=(), lead=0.0)
        run = self._run_of(len(x), h)
        run = run if at is None else replace(run, clock=np.full(len(x), at))
        chain = Chain(rig, self.placed if effect else ())
        return chain.run(np.ascontiguousarray(x, float), self.stage, self.stage, run, Between.STRAIGHT)

    def alone(self, x: Array) -> Array:
        """What leaves the effects themselves, without the stage."""
        run = Run.of([len(x)], [0.0], self.step)
        for placed in self.placed:
            x = placed.act(x, run)
        return x

    @staticmethod
    def _run_of(count: int, h: float) -> Run:
        run = Run.of([count], [0.0], h)
        run.rest[0] = BALANCED
        return run
