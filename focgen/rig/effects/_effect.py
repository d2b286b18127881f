"""What an effect is: a family of forms, each nested in the nominal chain.

A file of this package that defines ``EFFECT`` adds a family to the library; nothing else needs to know its
name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from focgen.arrays import Array, Bytes, Complex
from focgen.fractional.transfer import Polynomial
from focgen.logs.begin import Begin
from focgen.rig.effects._sizes import Size

SLOTS = {
    "regulator": ("command", "chamber", "supply"),
    "actuator": ("load", "drive", "spring", "dynamics", "response", "place"),
    "sensor": ("strain", "filter", "reading"),
}
"""Where on the way a form acts. ``command``: into the regulator; ``chamber``: the regulator's own equation;
``supply``: what leaves it; ``load``: the pressure entering the actuator; ``drive``: K(p) p; ``spring``: how
much further a spring that gives way is bent at rest, as a function of how far it was; ``dynamics``: the
actuator's own equation; ``response``: what leaves that; ``place``: the same with the offset; ``strain``: into
the sensor; ``filter``: the sensor's own equation; ``reading``: what leaves it."""

EQUATIONS = {"regulator": "chamber", "actuator": "dynamics", "sensor": "filter"}
"""The slots where no signal passes, by stage: what acts there changes the equation of its stage."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a form.

    Its unit is level^``level`` · time^``time``; ``lower``, ``upper`` and ``starts`` are in multiples of
    references taken from the data: the largest magnitude at the slot, and the time ``clock``: the rig's
    "response" time, the "sample" time or the "record" (one experiment; "session": all). ``zero`` is the
    value that gives the nominal chain, None where another parameter's zero does. ``log``: searched on a
    logarithmic scale. ``at``: the slot whose level is meant, where it is not the form's own.
    """

    name: str
    level: float = 0
    time: int = 0
    lower: float = -np.inf
    upper: float = np.inf
    starts: tuple[float, ...] = (0.1,)
    clock: str = "response"
    zero: float | None = None
    log: bool = False
    at: str = ""


LARGEST = Parameter("scale", level=1, lower=1.0, upper=1.0 + 1e-9, starts=(1.0,))
"""The largest level seen where a form acts: a unit to it, not a thing to fit."""

PERIOD = "period"
"""The name of a parameter that is the period of a form's own tone."""

DELAY = "delay"
"""The name of a parameter that is a dead time."""

STEP = "step"
"""The name of a parameter that is the step between two levels, of those that a signal is rounded to."""

PLACE = "place"
"""The name of a parameter that says where something lay when an experiment began elsewhere than at rest."""


_STILL = 0.01  # of its largest value: an input that is 0 but for noise


@dataclass(frozen=True, eq=False)
class Run:
    """A session being simulated, its experiments one after the other in every array of shape (n,).

    ``h`` in s; ``rest`` (n,) is 0 but at each experiment's first sample: 1 where the rig comes from rest at
    0, 2 where it comes from equilibrium with that sample's input; ``clock`` (n,) is the session's time in s;
    ``duration`` of the longest experiment in s; ``carried``: what of an effect outlived an earlier session.
    ``begins``: what the input was before each experiment, in its order; none where all come from rest.
    ``lasts``: what remembers lies, as an experiment begins at rest, where its last turn left it.
    ``stands``: where a stage that integrates stood as each began; none where it was at 0 in all.
    ``rough``: what is integrated in steps may take them twice as long, for fits that are but compared.
    ``guessed``: spans (first sample, one after the last) of pasts of which no log shows anything: an input
    that leaves the plant where an experiment finds it, whatever came to pass.
    """

    h: float
    rest: Bytes
    clock: Array
    duration: float
    carried: Mapping[str, float] = field(default_factory=dict)
    begins: tuple[Begin, ...] = ()
    lasts: bool = False
    stands: tuple[float, ...] = ()
    rough: bool = False
    guessed: tuple[tuple[int, int], ...] = ()

    @cached_property
    def unbroken(self) -> Run:
        """The run in which only the first experiment begins at 0, and those whose past is told."""
        rest = self.rest.copy()
        later = np.flatnonzero(rest)[1:]
        rest[later[rest[later] == 1]] = 0
        return replace(self, rest=rest)

    def with_stands(self, stands: tuple[float, ...]) -> Run:
        """The run whose stage that integrates stood at ``stands`` as each experiment began."""
        return self._resting(self.rest, stands)

    def _resting(self, rest: Bytes, stands: tuple[float, ...]) -> Run:
        """The run of the same experiments, each resting as ``rest`` (n,) says. Where they begin is not looked
        for anew: that takes as long as running a stage."""
        made = replace(self, rest=rest, stands=stands)
        vars(made)["spans"] = self.spans
        return made

    def held(self, x: Array) -> Run:
        """The run behind what remembers, whose input is ``x`` (n,): a later experiment that begins with an
        input of 0 begins in equilibrium with what that makes of it."""
        later = self._later_from_rest
        if any(self.stands) or not len(later):
            return self
        return self._in_equilibrium(x, later, 0.0)

    @cached_property
    def _later_from_rest(self) -> Array:
        """First samples of the later experiments at which the rig comes from rest at 0."""
        firsts = np.flatnonzero(self.rest)
        later: Array = firsts[1:][self.rest[firsts[1:]] == 1]
        return later

    @cached_property
    def stood(self) -> Run:
        """The run behind a stage that integrates, at rest where that stood as each experiment began."""
        rest = self.rest.copy()
        firsts = np.flatnonzero(rest)
        rest[firsts[np.array(self.stands) != 0.0]] = 2
        return self._resting(rest, stands=())

    def lying(self, x: Array, level: float) -> Run:
        """The run behind what rests at a ``level`` of its own: an experiment in which its output ``x`` (n,)
        comes from rest and begins there begins in equilibrium with it."""
        return self._in_equilibrium(x, np.flatnonzero(self.rest == 1), level)

    def _in_equilibrium(self, x: Array, firsts: np.ndarray, level: float) -> Run:
        """The run in equilibrium wherever a signal ``x`` (n,) is at a ``level`` at one of ``firsts``."""
        rest, still = self.rest.copy(), _STILL * max(float(x.max(initial=0.0)), -float(x.min(initial=0.0)))
        rest[firsts[np.abs(x[firsts] - level) <= still]] = 2
        return self._resting(rest, self.stands)

    @property
    def stood_by_span(self) -> list[tuple[int, int, float]]:
        """Every span, and where a stage that integrates stood as it began."""
        stands = self.stands or (0.0,) * len(self.spans)
        return [(a, b, stood) for (a, b), stood in zip(self.spans, stands)]

    @cached_property
    def spans(self) -> tuple[tuple[int, int], ...]:
        """First sample and the one after the last, by experiment."""
        firsts = np.flatnonzero(self.rest).tolist()
        return tuple(zip(firsts, [*firsts[1:], len(self.rest)]))

    @classmethod
    def of(
        cls,
        lengths: Sequence[int],
        starts: Sequence[float],
        h: float,
        begins: Sequence[Begin] = (),
        lasts: bool = False,
        stands: Sequence[float] = (),
    ) -> Run:
        """The run of experiments of ``lengths`` samples beginning at ``starts`` s on the session's clock."""
        rest = np.zeros(sum(lengths), np.uint8)
        rest[np.cumsum([0, *lengths[:-1]])] = 1
        clock = np.concatenate([s + h * np.arange(n) for n, s in zip(lengths, starts)])
        begins = () if all(b.at_rest for b in begins) else tuple(begins)
        stands = tuple(stands) if any(stands) else ()
        return cls(h, rest, clock, max(lengths) * h, begins=begins, lasts=lasts, stands=stands)


Values = tuple[float, ...]
Act = Callable[[Any, Values, Any], Any]  # in a slot of EQUATIONS no signal passes: see Form

Leaves = Callable[[Array, Values, Run], dict[str, float]]


@dataclass(frozen=True)
class Form:
    """One formula: ``act(x, values, run)`` maps what passes its ``slot``, shape (n,), to what leaves it.

    In a slot of :data:`EQUATIONS` it maps what is changed of the stage's own equation,
    :class:`~focgen.rig.dynamics.Dynamics`, and there is no ``run``.
    ``seen(y)`` reads the values off what was measured, (n,), where that can be done at sight; None where it
    is not there. ``leaves(x, values, run)`` is what outlives the session's end, by name: ``run.carried`` of
    a later session. ``response(values, s)`` is its frequency response at s = jω (complex, 1/s) where it is
    linear, None where not. ``wanders``: it follows the session's time through free values, so that it
    predicts nothing of a later one. ``jumps``: what it gives changes in jumps as its parameters do.
    ``leads``: linear though it is, away from home it stays ahead of the actuator's gain, which may be bent.
    ``both_ways``: it is to be told from another form only where the input goes both ways.
    ``rarer``: before the data, less likely than the like of another stage.
    ``wears``: what a spring's further bend goes with: ``time`` alone, or, with its two values, as 1 + growth
    (1 − exp(−w/scale)), w the ``largest`` that it was bent by, the ``work`` done or its ``retreat`` from the
    largest; empty where it is another function.
    ``bare``: only in a stage that the rig takes for 1: dynamics have the like in their own equation.
    ``adds_up``: only in a regulator that adds up what it is told, as a pump does.
    ``itself(values, den)``: whether it is what its family says, in an actuator of this denominator.
    """

    name: str
    slot: str
    parameters: tuple[Parameter, ...]
    act: Act
    seen: Callable[[Array], Values | None] | None = None
    leaves: Leaves | None = None
    response: Callable[[Values, Complex], Complex] | None = None
    wanders: bool = False
    jumps: bool = False
    leads: bool = False
    both_ways: bool = False
    rarer: bool = False
    wears: str = ""
    bare: bool = False
    adds_up: bool = False
    itself: Callable[[Values, Polynomial], bool] = lambda values, den: True

    @property
    def begun(self) -> bool:
        """Whether it says where something lay when an experiment began elsewhere than at rest."""
        return self.has(PLACE)

    @property
    def behind(self) -> Form:
        """The same of what moves, behind the dynamics, where a sensor has it more often."""
        return replace(self, name=f"{self.name}_behind", rarer=True)

    def has(self, name: str) -> bool:
        """Whether a parameter has this name."""
        return any(p.name == name for p in self.parameters)


@dataclass(frozen=True)
class Excitation:
    """What a set of experiments does to the rig, as an identifiability check sees it.

    ``levels``: how many distinct levels (a tenth of the range apart) were held or passed; ``lowest`` of the
    range visited above zero; ``unloads``, ``reversals``: how often the input falls by a tenth of the range,
    turns round above zero; ``hold``: the longest constant input in response times; ``fastest``: the fastest
    tenth-of-range change in response times; ``experiments``; ``repeats``: of a level after a higher one;
    ``revisits``: the same where it was reached before that one, too; ``duration`` in response times;
    ``samples`` per response time.
    """

    levels: int
    lowest: float
    unloads: int
    reversals: int
    hold: float
    fastest: float
    experiments: int
    repeats: int
    revisits: int
    duration: float
    samples: float


Check = Callable[[Excitation], str | None]


@dataclass(frozen=True)
class Effect:
    """A family. ``stage`` is the usual one, ``also`` others it may sit in, where those at home leave much.

    ``needs`` is the identifiability check: what the experiments lack to show the effect, or None. ``sizes``:
    how large it is, as one would measure it.
    ``bends``: its curves leave the gain at zero as it is, and change it elsewhere. ``remembers``: it stays
    where an experiment left it, whatever rest follows. ``slow``: what it was fed is in it long after the rig
    has forgotten that. ``static``: what it changes depends on the level alone, as the error of a nominal
    curve does.
    """

    name: str
    stage: str
    meaning: str
    reveals: str
    confused_with: tuple[str, ...]
    needs: Check
    sizes: tuple[Size, ...]
    forms: Sequence[Form]
    also: tuple[str, ...] = ()
    bends: bool = False
    remembers: bool = False
    slow: bool = False
    static: bool = False

    @property
    def tonal(self) -> bool:
        """Whether it rings with one tone: each of its forms has a period of its own."""
        return all(form.has(PERIOD) for form in self.forms)

    @property
    def delays(self) -> bool:
        """Whether it is a dead time. That is at home in every stage, for a chain does not show where it lies,
        and columns out of step do the same."""
        return all(form.has(DELAY) for form in self.forms)

    @property
    def rounds(self) -> bool:
        """Whether it rounds to levels. Which way a sample is rounded cannot be predicted from the input, so
        what it leaves looks like noise."""
        return all(form.has(STEP) for form in self.forms)
