"""Dry friction on what moves: a force against the velocity in the actuator's own equation."""

from dataclasses import replace

from focgen.rig.dynamics import Dynamics, Friction, Rise
from focgen.rig.effects._effect import Effect, Form, Parameter, Values
from focgen.rig.effects._sizes import own


def _coulomb(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, drag=x.drag + Friction(values[0], values[0]))


def _breakaway(x: Dynamics, values: Values, run: None) -> Dynamics:
    force, more = values
    return replace(x, drag=x.drag + Friction(force, force + more))


def _rising(x: Dynamics, values: Values, run: None) -> Dynamics:
    force, rise, speed = values
    return replace(x, drag=x.drag + Friction(force, force), rise=Rise(rise, speed))


def _turning(x: Dynamics, values: Values, run: None) -> Dynamics:
    """Of what turns on, whose output is the speed itself: it stands against that, and holds it at 0."""
    return replace(x, preload=x.preload + values[0])


# what drives the actuator bears it: K(p) p, or the input of a num/den actuator
_FORCE = Parameter("force", level=1, lower=0.0, upper=0.9, starts=(0.05, 0.2), zero=0.0, at="drive")
# below 0, friction falls with the speed: what is left stays a friction
_RISE = Parameter("rise", level=1, lower=-0.4, upper=0.9, starts=(0.05, -0.02), zero=0.0, at="drive")
_SPEED = Parameter("speed", level=1, time=-1, lower=1e-3, upper=3.0, starts=(0.1, 0.1), log=True)
_MORE = Parameter("breakaway", level=1, lower=0.0, upper=0.9, starts=(0.03, 0.1), zero=0.0, at="drive")

EFFECT = Effect(
    name="friction",
    stage="actuator",
    meaning="dry friction on what moves: a force against the velocity, which holds the motion below it",
    reveals="slow motion that turns round, rests at several levels, small steps: it stays where it was",
    confused_with=("hysteresis", "dead_zone", "valve_stiction", "sensor_hysteresis", "sensor_nonlinearity"),
    needs=lambda e: None if e.reversals or e.unloads else "the input never turns round",
    remembers=True,
    sizes=(own("force"),),
    forms=[
        Form("coulomb", "dynamics", (_FORCE,), _coulomb),
        Form("rising", "dynamics", (_FORCE, _RISE, _SPEED), _rising),
        Form("breakaway", "dynamics", (_FORCE, _MORE), _breakaway),
        # where nothing goes back, a seat and a spring on it are no other to any log
        Form("turning", "dynamics", (_FORCE,), _turning, both_ways=True),
    ],
)
