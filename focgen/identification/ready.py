"""Experiments made ready for the fit of the actuator: what its input was before them, and what a command does
between their samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from focgen.errors import FitError
from focgen.identification.between_samples import Tried, at_rest, likeliest_way, ways_of
from focgen.identification.excitation import Excitation, possible_rests, prepare
from focgen.identification.fractional import FractionalFit, fit_fractional
from focgen.identification.gain import feasible_degree
from focgen.identification.past import worth_it
from focgen.identification.sure import has_numbers
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.engine import between_of
from focgen.rig.rig import Rig


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
    experiments: Sequence[Experiment], befores: Sequence[float | None], rig: Rig, degree: int
) -> tuple[list[Excitation], tuple[str, ...]]:
    """The experiments, with what the input was before each, made ready for a K(p) of the ``degree``, or of
    one that they show, which it says."""
    ready = [prepare(e, rig, degree + 1, before) for e, before in zip(experiments, befores)]
    possible, lowered = feasible_degree(ready, degree)
    return [x.with_powers(possible + 1) for x in ready], lowered


def as_it_runs(
    experiments: Sequence[Experiment],
    befores: Sequence[float | None],
    rig: Rig,
    degree: int,
    delay: bool,
    play: float = 0.0,
) -> tuple[Rig, dict[str, Any]]:
    """The rig with what its command does between samples, where that drives the fit, and by how much each of
    the numbers found is another where it may do something else. Pasts are left to the fit itself: they take
    longest. ``play``: the half width of a loop that all this is behind, units of the input."""

    def tried(way: Between) -> Tried[FractionalFit]:
        plain, _ = ready_for(experiments, befores, replace(rig, between=way), degree)
        ready = [x.behind(play) for x in plain]
        fit = fit_fractional(ready, delay, pasts=[None] * len(ready))
        left = np.concatenate([(x.measured - y) / x.spread for x, y in zip(ready, fit.simulated)])
        return Tried(way, fit, left)

    commands = [e["command"] for e in experiments if "pressure" not in e]
    ways = ways_of(rig.between, commands) if len(commands) == len(experiments) else ()
    if len(ways) < 2:
        return rig, {}
    try:
        way = likeliest_way(ways, tried, at_rest(commands))
    except FitError:  # without numbers nothing tells the ways apart: the fit itself says so, or finds a loop
        return rig, {}
    if way.rival is None or not has_numbers(way.rival):
        return running(rig, way.known), {}
    names = ("T", "alpha", "delay", "gain")[: 4 if len(way.fit.gain) == len(way.rival.gain) else 3]
    return rig, {n: np.abs(getattr(way.fit, n) - getattr(way.rival, n)) for n in names}


def running(rig: Rig, between: Between | None) -> Rig:
    """The rig with what its command does between samples, where its file does not say it, and that is known
    and not what a rig that says nothing is taken for everywhere: a regulator whose command is held."""
    usual = between == Between.HELD == between_of(rig, "command")
    return rig if between is None or usual or rig.between is not None else replace(rig, between=between)
