"""Whether a session of logs can be that of a rig: units, signs, columns, and the unit of time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from focgen.arrays import Array
from focgen.logs import plausibility
from focgen.logs.ahead import is_answered_ahead
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.logs.plausibility import Link, Signals
from focgen.rig.effects import Run
from focgen.rig.engine import Chain, between_of
from focgen.rig.rig import UNITY, Actuator, Rig
from focgen.rig.stages import STAGES

_ROLES = ("command", "pressure", "curvature", "output")  # before each stage, and after the last
_MOST = 40_000  # samples are enough to tell a unit
_EXCHANGED = 0.6  # of the misfit of camera and sensor: it is less if they change places
_MINUTE = 60.0
_HONEST = 5.0  # times the rig's sample_time, or a fifth of it: any log may be sampled so


def doubts(rig: Rig, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """Warnings of what in a session is implausible, each with the most likely slip; none for an honest log.

    Compares the signals with the rig's ``[ranges]``, and how they answer each other with the rig's nominal
    stages. Silent are gains up to 2.5 times the nominal, signals up to 1.5 times their range, offsets, and
    other sampling rates. ``experiments`` as ``read_logs`` gives them; nothing is raised.
    """
    experiments = _enough([e for e in experiments if len(e) > 1])
    if not experiments:
        return ()
    if isinstance(rig.actuator, Actuator) and rig.actuator.slip:
        return (f"{rig.actuator.slip}; gain = [{max(rig.actuator.gain, key=abs):g}] for a constant gain?",)
    time = _time(rig, experiments)
    if time:
        return time
    twice = copied(rig, experiments)
    if twice:
        return (f"{twice[1]} holds the same samples as {twice[0]}; one column exported in both places?",)
    limits = {role: span for role, span in vars(rig.ranges).items() if span is not None}
    response = partial(links, rig, experiments)
    found = plausibility.doubts(experiments, limits, _units(rig), response)
    if found:
        return found
    if exchanged(rig, experiments):
        return ("curvature lags behind output; the columns of curvature and output exchanged?",)
    return _late(experiments)


def links(
    rig: Rig, experiments: Sequence[Experiment], signals: Signals, faster: float = 1.0
) -> tuple[Link, ...]:
    """How each logged signal answers the one before it, compared with the rig's nominal stages between them.

    ``signals``: parts (n,) by role. ``faster``: the log's clock, times this. A stage that the rig does not
    model says nothing.
    """
    roles = [role for role in _ROLES if role in signals]
    found = []
    for entry, exit in pairwise(roles):
        stages = STAGES[_ROLES.index(entry) : _ROLES.index(exit)]
        if not _modelled(rig, stages):
            continue
        expected = _simulated(rig, experiments, signals[entry], stages, between_of(rig, entry), faster)
        found.append(_link(entry, exit, expected, signals[exit]))
    return tuple(found)


def _units(rig: Rig) -> dict[str, str]:
    """What names the unit of each role: the rig's units, else its column."""
    return {**rig.signals.columns(), **rig.signals.units}


def _enough(experiments: Sequence[Experiment]) -> list[Experiment]:
    """The first experiments, up to a number of samples that tells a unit."""
    ends = np.cumsum([len(e) for e in experiments])
    return [e for e, end in zip(experiments, ends) if end <= max(_MOST, ends[0])]


def _modelled(rig: Rig, stages: Sequence[str]) -> bool:
    if all(stage == "sensor" for stage in stages):
        return rig.sensor != UNITY
    return not ("regulator" in stages and rig.regulator == UNITY) and not (
        "actuator" in stages and rig.actuator is None
    )


def _simulated(
    rig: Rig,
    experiments: Sequence[Experiment],
    parts: Sequence[Array],
    stages: Sequence[str],
    between: Between | bool,
    faster: float = 1.0,
) -> list[Array]:
    if "actuator" not in stages:  # linear: an offset of the input from the first sample on is no step
        parts = [y - y[0] for y in parts]
    step = experiments[0].sample_time * faster
    run = Run.of([len(y) for y in parts], [e.start * faster for e in experiments], step)
    made = Chain(rig).run(np.concatenate(parts), stages[0], stages[-1], run, between)
    return [made[a:b] for a, b in run.spans]


def _link(entry: str, exit: str, expected: list[Array], measured: list[Array]) -> Link:
    """Offsets apart: each part about its mean."""
    s, y = (np.concatenate([part - part.mean() for part in parts]) for parts in (expected, measured))
    scale = float(np.linalg.norm(s) * np.linalg.norm(y))
    if not scale or not np.isfinite(scale):
        return Link(entry, exit, 1.0, 0.0)
    correlation = float(s @ y) / scale
    ratio = float(np.linalg.norm(y) / np.linalg.norm(s))
    return Link(entry, exit, float(np.copysign(ratio, correlation)), correlation)


def _signals(experiments: Sequence[Experiment]) -> Signals:
    return {
        role: [np.asarray(e[role], float) for e in experiments]
        for role in _ROLES
        if all(role in e for e in experiments)
    }


def _time(rig: Rig, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """Minutes for seconds, or row numbers: the rate is odd, the corrected one is not, and the rig's own
    dynamics, where modelled, do not contradict."""
    step = experiments[0].sample_time
    ratio = step / rig.sample_time
    slips = [("minutes instead of seconds", _MINUTE)]
    if abs(step - 1.0) < 1e-6 and ratio > 2.0 * _HONEST:
        slips = [("row numbers instead of seconds", rig.sample_time)]
    for words, factor in slips:
        likely = 1.0 / _HONEST <= ratio * factor <= _HONEST
        odd = not 1.0 / (2.0 * _HONEST) <= ratio <= 2.0 * _HONEST
        if likely and odd and _responds_better(rig, experiments, factor):
            what = f"time has samples {step:.3g} s apart where the rig's sample_time is {rig.sample_time:g} s"
            return (f"{what}; {words}?",)
    return ()


def _responds_better(rig: Rig, experiments: Sequence[Experiment], faster: float) -> bool:
    """Whether the nominal stages fit better with another clock, or say nothing."""
    signals = _signals(experiments)
    as_it_is, other = (links(rig, experiments, signals, f) for f in (1.0, faster))
    pairs = [(a.correlation, b.correlation) for a, b in zip(as_it_is, other) if a.known or b.known]
    return not pairs or sum(abs(b) - abs(a) for a, b in pairs) > 0.0


def copied(rig: Rig, experiments: Sequence[Experiment]) -> tuple[str, str] | None:
    """Two roles that hold the same samples throughout, with a stage between them that is not 1: no two gauges
    have the same noise. None where there are none."""
    roles = [role for role in _ROLES if all(role in e for e in experiments)]
    for entry, exit in pairwise(roles):
        stages = STAGES[_ROLES.index(entry) : _ROLES.index(exit)]
        passes = all(stage != "actuator" and getattr(rig, stage) == UNITY for stage in stages)
        alike = all(np.array_equal(e[entry], e[exit]) for e in experiments)
        if not passes and alike and any(np.ptp(e[entry]) for e in experiments):
            return entry, exit
    return None


def exchanged(rig: Rig, experiments: Sequence[Experiment]) -> bool:
    """Whether camera and sensor have changed places: the camera would lag behind the sensor."""
    signals = _signals(experiments)
    if rig.sensor == UNITY or not {"curvature", "output"} <= set(signals):
        return False
    camera, sensor = signals["curvature"], signals["output"]
    as_it_is, other = (
        _misfit(_simulated(rig, experiments, x, ("sensor",), False), y)
        for x, y in ((camera, sensor), (sensor, camera))
    )
    return other <= _EXCHANGED * as_it_is


def _late(experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """The command is logged late where what is measured first answers it before it comes."""
    signals = _signals(experiments)
    first = next((role for role in _ROLES[1:] if role in signals), None)
    if "command" not in signals or first is None or not is_answered_ahead(experiments, first):
        return ()
    return (f"{first} answers the command before it comes; the command logged late, or {first} early?",)


def _misfit(expected: list[Array], measured: list[Array]) -> float:
    """Share of a signal that the expected one, whatever its size and offset, does not explain."""
    correlation = _link("", "", expected, measured).correlation
    return float(np.sqrt(max(0.0, 1.0 - correlation**2)))
