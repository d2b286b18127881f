"""A stage whose pace depends on its level, on time or on its speed: no effect of the library, and yet what
many a rig does a little."""

from __future__ import annotations

from dataclasses import replace

from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.problem.problem import Problem
from focgen.rig.changeable import fits_in
from focgen.rig.dynamics import Dynamics, Pace
from focgen.rig.effects import EQUATIONS, Form, Parameter

UNEVEN = "uneven_pace"
_RATE = Parameter("rate", lower=-1.5, upper=2.5, starts=(0.3, -0.3), zero=0.0)
_CURVE = Parameter("curve", lower=-1.5, upper=2.5, starts=(0.0,), zero=0.0)


def uneven_paces(problem: Problem) -> list[CandidateEffect]:
    """Every pace that may be uneven: of each stage whose own equation no effect of the problem changes."""
    changed = {c.stage for c in problem.candidates if c.form.slot in (*EQUATIONS.values(), "spring")}
    return [
        CandidateEffect(UNEVEN, form, stage)
        for stage in problem.segment.stages
        if stage not in changed
        for form in _forms(EQUATIONS[stage])
        if fits_in(form, stage, problem.nominals.rig)
    ]


def _forms(slot: str) -> list[Form]:
    """A regulator that is the slower the faster it goes is one whose flow is limited, and an effect."""
    quicker = replace(_RATE, upper=0.0, starts=(-0.3,)), replace(_CURVE, upper=0.0)
    return [
        _form("level", slot, _RATE, _CURVE),
        _form("time", slot, _RATE, _CURVE),
        _form("speed", slot, *(quicker if slot == EQUATIONS["regulator"] else (_RATE, _CURVE))),
    ]


def _form(by: str, slot: str, *parameters: Parameter) -> Form:
    def act(x: Dynamics, values: tuple[float, ...], run: None) -> Dynamics:
        return replace(x, pace=Pace(by, *values))

    return Form(by, slot, parameters, act)
