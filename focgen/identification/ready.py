"""Experiments made ready for the fit of the actuator: what its input was before them, and what a command does
between their samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from focgen.arrays import Array
from focgen.errors import FitError
from focgen.identification.between_samples import Tried, at_rest, likeliest_way, ways_of
from focgen.identification.excitation import Excitation, possible_rests, prepare
from focgen.identification.fractional import FractionalFit, fit_fractional
from focgen.identification.gain import feasible_degree
from focgen.identification.past import Past, worth_it
from focgen.identification.sure import has_numbers
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.engine import between_of
from focgen.rig.rig import Rig

_EARLIEST = 2  # samples that a command may be ahead of its row: more is another row's
_LATE = 0.5  # samples that an output may be late without a dead time: a row may be read before it is sent
_NONE = 0.02  # samples: less out of step is none
_FINE = 50.0  # samples in a time constant: then a part of one changes no number by what it is known to


def befores_of(experiments: Sequence[Experiment], rig: Rig, powers: int) -> list[float | None]:
    """What the input of each experiment was before its first sample: what it shows there for ever (None), or
    0 where a log begins with the step itself.

    The second is taken where it needs no further past, and the fit of all experiments leaves little less with
    the first, whatever pasts that asks for.
    """
    ways = [possible_rests(e) for e in experiments]
    firsts: list[float | None] = [way[0] for way in ways]
    if all(len(way) == 1 for way in ways):
        return firsts
    rest, zero = ([prepare(e, rig, powers, way[k]) for e, way in zip(experiments, ways)] for k in (0, -1))
    try:
        begun, rested = _fitted(zero), _fitted(rest)
    except FitError:
        return firsts
    chosen = []
    for i, (late, early, way) in enumerate(zip(zero, rest, ways)):
        left = [x.measured - fit.simulated[i] for x, fit in ((late, begun), (early, rested))]
        chosen.append(way[-1] if begun.pasts[i] is None and not worth_it(*left) else way[0])
    return chosen


def _fitted(excitations: list[Excitation]) -> FractionalFit:
    degree, _ = feasible_degree(excitations, excitations[0].powers - 1)
    return fit_fractional([x.with_powers(degree + 1) for x in excitations])


def ready_for(
    experiments: Sequence[Experiment],
    befores: Sequence[float | None],
    rig: Rig,
    degree: int,
    lead: float = 0.0,
) -> tuple[list[Excitation], tuple[str, ...]]:
    """The experiments, with what the input was before each, made ready for a K(p) of the ``degree``, or of
    one that they show, which it says; ``lead``: s by which the command is ahead of its rows."""
    ready = [prepared(e, rig, degree + 1, before, lead) for e, before in zip(experiments, befores)]
    possible, lowered = feasible_degree(ready, degree)
    return [x.with_powers(possible + 1) for x in ready], lowered


def prepared(e: Experiment, rig: Rig, powers: int, before: float | None, lead: float) -> Excitation:
    """An experiment made ready whose command was sent ``lead`` s ahead of its row: whole samples sooner, and
    late by what that is too much. Where the command moves in the first rows, whose sooner ones nobody logged,
    it stays, and all that was read comes as much later."""
    if not lead:
        return prepare(e, rig, powers, before)
    command, signals = e["command"], dict(e.signals)
    count = max(math.ceil(lead / e.sample_time), 1)
    if before is None and not np.ptp(command[: count + 1]):
        signals["command"] = np.r_[command[:1], command[count + 1 :], np.full(count, command[-1])]
    else:
        for role in ("curvature", "output"):
            if role in e:
                signals[role] = np.r_[np.full(count, e[role][0]), e[role][:-count]]
    x = prepare(replace(e, signals=signals), rig, powers, before)
    return replace(x, late=x.late + count * x.step - lead)


@dataclass(frozen=True, eq=False)
class Runs:
    """How a command runs: the ``rig`` with what it does between samples, and the s of its ``lead`` on its
    rows. ``apart``: by how much each of the numbers found is another where it may do something else;
    ``least``: how well each is known at most."""

    rig: Rig
    lead: float = 0.0
    apart: dict[str, Array | float] = field(default_factory=dict)
    least: dict[str, Array | float] = field(default_factory=dict)


@dataclass(frozen=True)
class _Trials:
    """Fits to ``experiments`` whose command runs in one way or another; the rest as of :func:`as_it_runs`."""

    experiments: Sequence[Experiment]
    befores: Sequence[float | None]
    rig: Rig
    degree: int
    delay: bool
    play: float
    pasts: Sequence[Past | None]

    def fit(self, way: Between, delay: bool | None = None, lead: float = 0.0) -> Tried[FractionalFit]:
        """The fit to a command that runs so, ``lead`` s ahead of its rows."""
        plain, _ = ready_for(
            self.experiments, self.befores, replace(self.rig, between=way), self.degree, lead
        )
        ready, delay = [x.behind(self.play) for x in plain], self.delay if delay is None else delay
        fit = fit_fractional(ready, delay, pasts=self.pasts or [None] * len(ready))
        spreads = [float(np.std(e[x.fitted_role])) for e, x in zip(self.experiments, ready)]
        left = np.concatenate([(x.measured - y) / w for x, y, w in zip(ready, fit.simulated, spreads)])
        return Tried(way, fit, left)

    def early(self, usual: FractionalFit) -> Tried[FractionalFit]:
        """The fit to a held command that is ahead of its rows; FitError where that does not show: nor does it
        where the ``usual`` fit has many samples in a time constant."""
        step = self.experiments[0].sample_time
        if usual.T ** (1.0 / usual.alpha) > _FINE * step:
            raise FitError("command", "shows no part of a sample", "take it as it was logged")
        for count in range(1, _EARLIEST + 1):
            found = self.fit(Between.HELD, True, count * step)
            if found.fit.delay > _NONE * step:
                break
        lead = count - found.fit.delay / step
        if not (_NONE < lead < _EARLIEST - _NONE or (-_LATE < lead < -_NONE and not self.delay)):
            raise FitError("command", "is out of step by no part of a sample", "take it as it was logged")
        return replace(found, numbers=1 - self.delay, lead=lead * step)


def as_it_runs(
    experiments: Sequence[Experiment],
    befores: Sequence[float | None],
    rig: Rig,
    degree: int,
    delay: bool,
    play: float = 0.0,
    pasts: Sequence[Past | None] = (),
) -> Runs:
    """How the command runs, where that drives the fit. ``play``: the half width of a loop that all this is
    behind, units of the input; ``pasts``: those of experiments that begin in motion, where they are known."""
    commands = [e["command"] for e in experiments if "pressure" not in e]
    ways = ways_of(rig.between, commands) if len(commands) == len(experiments) else ()
    steps = bool(ways) and ways[0] == Between.HELD and any(map(np.ptp, commands)) and at_rest(commands)
    if len(ways) < 2 and not steps:
        return Runs(rig)
    trials = _Trials(experiments, befores, rig, degree, delay, play, pasts)
    try:
        way = likeliest_way(ways, trials.fit, at_rest(commands), trials.early if steps else None)
    except FitError:  # without numbers nothing tells the ways apart: the fit itself says so, or finds a loop
        return Runs(rig)
    if way.lead:
        return Runs(running(rig, way.known), way.lead, least=way.fit.half)
    if way.rival is None or not has_numbers(way.rival):
        return Runs(running(rig, way.known))
    return Runs(rig, apart=apart(way.fit, way.rival))


def apart(fit: FractionalFit, other: FractionalFit) -> dict[str, Array | float]:
    """By how much each of the numbers of a fit is another in an ``other`` one; K(p) if it has as many."""
    names = ("T", "alpha", "delay", "gain")[: 4 if len(fit.gain) == len(other.gain) else 3]
    return {n: np.abs(getattr(fit, n) - getattr(other, n)) for n in names}


def running(rig: Rig, between: Between | None) -> Rig:
    """The rig with what its command does between samples, where its file does not say it, and that is known
    and not what a rig that says nothing is taken for everywhere: a regulator whose command is held."""
    usual = between == Between.HELD == between_of(rig, "command")
    return rig if between is None or usual or rig.between is not None else replace(rig, between=between)
