"""Effects that a segment is fitted with, and what their parameters are multiples of."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.rig.effects import Effect, Form, Parameter, library


@dataclass(frozen=True)
class CandidateEffect:
    """An effect to be fitted: family, form, and the stage it is put in."""

    effect: str
    form: Form
    stage: str

    @property
    def name(self) -> str:
        """Family and form."""
        return f"{self.effect}/{self.form.name}"

    @property
    def family(self) -> Effect | None:
        """Its family, None where none of the library is."""
        return library().get(self.effect)


@dataclass(frozen=True)
class References:
    """What multiples are taken of: a level by slot, and the clocks in s."""

    levels: dict[str, float]
    clocks: dict[str, float]

    def scale(self, parameter: Parameter, slot: str) -> float:
        """The physical size of 1 in units of this parameter."""
        made: float = (
            self.levels[parameter.at or slot] ** parameter.level
            * self.clocks[parameter.clock] ** parameter.time
        )
        return made
