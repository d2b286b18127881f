"""What identification finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from focgen.arrays import Array
from focgen.identification.integer import IntegerFit
from focgen.identification.past import Past
from focgen.identification.stages import StageFit
from focgen.rig.rig import Rig
from focgen.shown import Shown

Span = tuple[float, float]


@dataclass(frozen=True, eq=False)
class ExperimentFit:
    """K/(T s^alpha + 1) fitted to one experiment by itself.

    ``K`` in output per pressure units, ``T`` in s^alpha, ``level`` the pressure it was stepped to, or
    released from; ``ci95`` maps K, T and alpha to 95 % intervals. ``fitted`` and ``driven_by`` are the roles
    fitted and driving.
    ``time`` (n,) in s, ``pressure``, ``measured`` and ``simulated`` (n,). ``step`` says whether it is a step,
    ``past`` whether an unknown past was estimated. ``integer``: the integer-order models, if asked for.
    """

    name: str
    K: float
    T: float
    alpha: float
    offset: float
    level: float
    ci95: dict[str, Span]
    gof: float
    fitted: str
    driven_by: str
    time: Array = field(repr=False)
    pressure: Array = field(repr=False)
    measured: Array = field(repr=False)
    simulated: Array = field(repr=False)
    integer: tuple[IntegerFit, ...] = field(repr=False)
    step: bool
    past: bool


@dataclass(frozen=True, eq=False)
class Joint:
    """One K(p), T, alpha and dead time for all experiments: the actuator that is written.

    ``delay`` in s. ``ci95`` maps T, alpha, delay and gain to 95 % intervals. ``gain_r2`` is that of the line
    through the single fits' K, None with fewer than two of them. ``simulated``, by experiment: its output,
    offset and initial state included. ``pasts``: the experiments that began with an unknown past.
    ``closed_loop``: whether a loop was closed, so that a noise model was fitted along. ``play``: the half
    width of the loop that T, alpha and gain stand beside, units of the input, and that is not in
    ``simulated``; 0 where there is none.
    """

    T: float
    alpha: float
    delay: float
    gain: tuple[float, ...]
    gain_r2: float | None
    ci95: dict[str, Span | tuple[Span, ...]]
    simulated: dict[str, Array] = field(repr=False)
    pasts: Mapping[str, Past] = field(repr=False)
    closed_loop: bool
    play: float = 0.0


@dataclass(frozen=True, eq=False)
class Unseen:
    """A log that was not fitted beside the identified rig's answer, all (n,); ``swings``: it is no step."""

    name: str
    pressure: Array = field(repr=False)
    measured: Array = field(repr=False)
    simulated: Array = field(repr=False)
    gof: float
    swings: bool


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Shown):
    """The identified ``rig``, what it rests on, and how it compares with integer-order models.

    ``gof`` maps a model ("fom", "iom_1p", …, "rig" for the joint one) to experiment → GOF, with "mean";
    ``bic`` likewise for Schwarz's criterion (smaller is better). ``warnings``: what these logs cannot show.
    ``unseen``: logs it was not fitted to. ``stages``: regulator and sensor, where asked for. ``joint`` is
    None where the actuator was not.
    """

    experiments: tuple[ExperimentFit, ...]
    joint: Joint | None
    rig: Rig
    gof: dict[str, dict[str, float]]
    bic: dict[str, dict[str, float]]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    unseen: tuple[Unseen, ...] = ()
    stages: dict[str, StageFit] = field(default_factory=dict)
