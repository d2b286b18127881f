"""Dry friction on what moves: a force against the velocity in the actuator's own equation."""

from dataclasses import replace

from focgen.rig.effects._effect import Effect, Form, Parameter
from focgen.rig.dynamics import Friction


def _coulomb(x, values, run):
    return replace(x, drag=x.drag + Friction(values[0], values[0]))


def _breakaway(x, values, run):
    force, more = values
    return replace(x, drag=x.drag + Friction(force, force + more))


# what drives the actuator bears it: K(p) p, or the input of a num/den actuator
_FORCE = Parameter("force", level=1, lower=0.0, upper=0.9, starts=(0.05, 0.2), zero=0.0, at="drive")
_MORE = Parameter("breakaway", level=1, lower=0.0, upper=0.9, starts=(0.03, 0.1), zero=0.0, at="drive")

EFFECT = Effect(
    name="friction",
    stage="actuator",
    meaning="dry friction on what moves: a force against the velocity, which holds the motion below it",
    reveals="slow motion that turns round, rests at several levels, small steps: it stays where it was",
    confused_with=("hysteresis", "dead_zone", "valve_stiction", "sensor_hysteresis", "sensor_nonlinearity"),
    needs=lambda e: None if e.reversals or e.unloads else "the input never turns round",
    forms=[
        Form("coulomb", "dynamics", (_FORCE,), _coulomb),
        Form("breakaway", "dynamics", (_FORCE, _MORE), _breakaway),
    ],
)
