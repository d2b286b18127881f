"""What the experiments of a session left in the rig, where it rested too short between two to forget them.

The clock of the session says how long ago each earlier experiment was, and what the input was then is in the
logs. Between two logs it counts as 0, and a signal further on is what that drives it to. Where each has a
clock of its own, the pause ahead of it is the one of several that suits the logs best. A fractional actuator
forgets by a power of time only: after a rest of five response times its output is still off by some per cent.
Experiments that are simulated in a row go on from one another. For one by itself the input's past is given as
levels, means over windows that are the longer, the longer they are ago: what is left of it changes no faster.

A log that begins a sample behind the end of the last one, its output where that was, goes on from
it: one recording was cut in two. Its past is known, whatever its input is then.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, starmap

import numpy as np

from focgen.arrays import Array, Bools
from focgen.logs.begin import Begin
from focgen.logs.experiment import Experiment
from focgen.rig.carried import FIRST, carried
from focgen.rig.engine import Chain, between_of
from focgen.rig.initial import NOTE as ESTIMATED
from focgen.rig.placed import Placed
from focgen.rig.response import integrations, longest, response_time
from focgen.rig.rig import Rig
from focgen.rig.session import entering, joined, run_of
from focgen.rig.stages import ENTERS, LEAVES, STAGES
from focgen.rig.stood import standing

NOTE = "begins before the rig has come to rest: the experiments before are simulated ahead of it"
_RECALLED = 0.98  # of the mean square that is left without: more is no sign that the rig remembers
_CONTRADICTED = 1.02  # of the same, or of a variance: less does not speak against what is known
_LONGEST = 250.0  # response times: what is longer ago counts as 0
_WIDTH = 0.1  # of how long ago it is: a window
_NOTHING = 0.06  # of the input's largest magnitude: what counts as 0, as in focgen.rig.initial
_NEXT = 1.4  # samples after the last one of another log: what begins there goes on from it
_SEEN = 5e-4  # of the output's largest magnitude, in root mean square: less does not show
_PAUSES = (0.0, *(2.0**k for k in range(-2, 8)))  # response times: of what is longer ago ever less is left
_CLOSER = (2.0**0.5, 2.0**0.25, 2.0**0.125)  # times longer, or shorter, than the best of those


def with_recalled(
    rig: Rig,
    logs: Sequence[Experiment],
    left: Callable[[Sequence[Experiment]], float],
    placed: Sequence[Placed] = (),
    held: bool = False,
) -> tuple[Experiment, ...]:
    """The experiments as :func:`recalled` has them where that leaves less by ``left``, a mean square; else as
    they are. Where the pauses between them are not known, each is as long as suits them best. That a log goes
    on from another is known, and has only to leave no more. ``held``: as of :func:`recalled`."""
    logs = _with_cut(rig, logs, left, placed)
    paused = any(log.paused for log in logs)
    response = response_time(rig, logs[0].sample_time, longest(logs)) if paused else 0.0

    def tried(pause: float, own: frozenset[int] = frozenset()) -> _Tried:
        session = _spaced(logs, pause * response)
        known = recalled(rig, session, placed, held=own if held else None)
        asked = any(a is not b for a, b in zip(known, session))
        return _Tried(left(known) if asked else np.inf, pause, own, known)

    best = min(map(tried, _PAUSES if paused else (0.0,)), key=lambda t: t.left)
    for step in _CLOSER if best.pause and np.isfinite(best.left) else ():
        best = min([best, tried(best.pause * step), tried(best.pause / step)], key=lambda t: t.left)
    moved = _moved_since(_spaced(logs, best.pause * response)) if held and np.isfinite(best.left) else []
    for number in moved:
        best = min([best, tried(best.pause, best.own | {number})], key=lambda t: t.left)
    return best.logs if np.isfinite(best.left) and best.left < _RECALLED * left(logs) else tuple(logs)


def with_earlier(
    rig: Rig,
    logs: Sequence[Experiment],
    left: Callable[[Sequence[Experiment]], float],
    placed: Sequence[Placed] = (),
) -> tuple[Experiment, ...]:
    """The experiments by :func:`with_recalled`, asked once more where some begin elsewhere than at 0."""
    found = with_recalled(rig, logs, left, placed)
    estimated = any(not begin.known for log in found[1:] for begin in log.begins.values())
    return with_recalled(rig, found, left, placed, held=True) if estimated else found


@dataclass(frozen=True)
class _Tried:
    """A session with pauses of so many response times, its ``logs`` with what that puts ahead of them, what
    these have ``left``, and those whose input moved since the last one as their ``own`` begins tell."""

    left: float
    pause: float
    own: frozenset[int]
    logs: tuple[Experiment, ...]


def _with_cut(
    rig: Rig,
    logs: Sequence[Experiment],
    left: Callable[[Sequence[Experiment]], float],
    placed: Sequence[Placed],
) -> Sequence[Experiment]:
    """The experiments, those that go on from others with what was before them, unless that leaves more."""
    cut = [goes_on(log, logs[:n]) for n, log in enumerate(logs)]
    if not any(cut):
        return logs
    found = [a if on else b for on, a, b in zip(cut, recalled(rig, logs, placed, closer=False), logs)]
    return found if left(found) < _CONTRADICTED * left(logs) else logs


def _spaced(logs: Sequence[Experiment], pause: float) -> tuple[Experiment, ...]:
    """The session with a pause, s, wherever its clock does not tell how long that was."""
    if not pause:
        return tuple(logs)
    ahead = np.cumsum([log.paused for log in logs])
    return tuple(replace(log, start=log.start + pause * n) for log, n in zip(logs, ahead))


def recalled(
    rig: Rig,
    logs: Sequence[Experiment],
    placed: Sequence[Placed] = (),
    closer: bool = True,
    held: Collection[int] | None = None,
) -> tuple[Experiment, ...]:
    """The experiments, each that begins with an input of 0, or goes on from the last, with what the earlier
    ones put in; as they are where that would not show, or come no ``closer``, or in a rig that integrates
    elsewhere than once, in its regulator. ``held``: those that begin elsewhere, too. Then the input was
    between two what it is as the later one begins, but since the last one, for these numbers, what their own
    begins tell; and ``closer`` is for the caller to ask."""
    once = rig.integrator == "regulator" and integrations(rig) == 1
    if len(logs) < 2 or not all(map(len, logs)) or ((integrations(rig) or rig.integrator) and not once):
        return tuple(logs)
    past, chain = memory(rig, logs), Chain(rig, tuple(placed))
    found = tuple(
        _recalled(chain, log, _earlier(log, logs), past, None if held is None else n in held)
        for n, log in enumerate(logs)
    )
    if rig.integrator:  # what was put in tells where a pump stood but for what errors add up to
        found = tuple(standing(rig, log, placed, ESTIMATED) for log in found)
    return found if _shows(rig, placed, logs, found, closer and held is None) else tuple(logs)


def all_ahead(rig: Rig, logs: Sequence[Experiment]) -> list[tuple[Experiment, ...]]:
    """The experiments with the earlier ones ahead of them, whether the rig has forgotten these or not: what
    is slow in it has not. Rests longer than it remembers, and than all logs together, are forgotten by
    that, too. Where no clock tells how long ago those were, once for each pause that may have been between
    two, the shortest first. Not at all of one log, or in a rig that integrates."""
    if len(logs) < 2 or integrations(rig) or rig.integrator:
        return []
    past = max(memory(rig, logs), sum(len(log) * log.sample_time for log in logs))
    response, chain = response_time(rig, logs[0].sample_time, longest(logs)), Chain(rig)
    pauses = _PAUSES if any(log.paused for log in logs) else (0.0,)
    sessions = (_spaced(logs, pause * response) for pause in pauses)
    return [tuple(_recalled(chain, log, _earlier(log, s), past, False) for log in s) for s in sessions]


def memory(rig: Rig, logs: Sequence[Experiment]) -> float:
    """How long ago, s, an input counts as 0. What a pump was told before is where it stood, which its log
    tells."""
    return _LONGEST * response_time(rig, logs[0].sample_time, longest(logs))


def ended(log: Experiment) -> float:
    """When the last sample of an experiment was, on the session's clock, s."""
    return log.start + (len(log) - 1) * log.sample_time


def _earlier(log: Experiment, logs: Sequence[Experiment]) -> list[Experiment]:
    """Those that had ended as a log began, the first of them first."""
    ended_then = (other for other in logs if ended(other) <= log.start)
    return sorted(ended_then, key=lambda other: other.start)


def _moved_since(logs: Sequence[Experiment]) -> list[int]:
    """The numbers of the experiments whose own begins tell of a step since the last one."""
    gaps = [log.start - max(map(ended, _earlier(log, logs)), default=log.start) for log in logs]
    steps = [[t for begin in log.begins.values() if not begin.known for t in begin.ago] for log in logs]
    return [n for n, (gap, ago) in enumerate(zip(gaps, steps)) if any(t < gap for t in ago)]


def _recalled(
    chain: Chain, log: Experiment, earlier: Sequence[Experiment], past: float, own: bool | None
) -> Experiment:
    """A log with its inputs' pasts; ``own``: whether one that is not known was since the last of the
    ``earlier`` logs what its own begin tells, or where it begins; None where it is left as it is. One whose
    driving signal's past is told was between the logs what the ``chain`` makes of that."""
    roles = [role for role in ENTERS if role in log and all(role in other for other in earlier)]
    begins: dict[str, Begin] = {}
    for ahead, role in zip((None, *roles), roles):
        known = _is_known(chain.rig, log, earlier, role)
        told = begin_after(log, earlier, role, past) if known else None
        if earlier and not (told and told.known) and ahead and _drives(chain, ahead, begins):
            told = _driven(chain, log, earlier, ahead, begins[ahead], role, past)
        elif earlier and told is None and own is not None:
            told = _held(log, earlier, role, past, own)
        begins |= {role: told} if told else {}
    begins = {role: begin for role, begin in begins.items() if not begin.at_rest}
    if not begins:
        return log
    notes = (note for note in log.notes if note != ESTIMATED)
    return replace(log, begins=begins, notes=(*notes, NOTE))


def _drives(chain: Chain, ahead: str, begins: Mapping[str, Begin]) -> bool:
    """Whether the signal ``ahead`` is told, was not always 0, and does not add up in the stage behind it."""
    return ahead in begins and not begins[ahead].at_rest and ENTERS[ahead] != chain.rig.integrator


def _held(log: Experiment, earlier: Sequence[Experiment], role: str, past: float, own: bool) -> Begin:
    """An input's past, had it been between any two logs where the later one begins, but since the last of the
    ``earlier`` ones, where ``own``, what its log's begin tells; and before the first what that one tells."""
    begins = [other.before(role) for other in (*earlier, log)]
    if log.start - max(map(ended, earlier)) > past:
        return begins[-1]
    behind = (*earlier[1:],) if own else (*earlier[1:], log)
    gaps = [_gap(log, a, b, past) for a, b in zip(earlier, behind)]
    rests = [(ago, np.full(len(ago), b.before(role).levels[-1])) for ago, b in zip(gaps, behind)]
    begin = begin_after(log, earlier, role, past, rests)
    since = [t for t in begins[-1].ago if t < begin.ago[-1]] if own else []
    levels = begins[0].levels[0], *begin.levels[1:-1], *begins[-1].levels[-1 - len(since) :]
    return Begin(levels, (*begin.ago, *since), after=begin.after)


def _driven(
    chain: Chain,
    log: Experiment,
    earlier: Sequence[Experiment],
    ahead: str,
    begin: Begin,
    role: str,
    past: float,
) -> Begin:
    """An input's past, had it been between any two logs what the signal ``ahead`` drives it to, whose past is
    ``begin``, from where the one log ends to where the next one begins."""
    made = carried(chain, log, ahead, begin, STAGES[STAGES.index(ENTERS[role]) - 1])
    shape = made.samples(log.sample_time)[::-1]

    def rest(before: Experiment, behind: Experiment) -> tuple[Array, Array]:
        ago = _gap(log, before, behind, past)
        if not len(ago):
            return ago, ago
        driven = shape[np.minimum(np.round(ago / log.sample_time).astype(int), len(shape)) - 1]
        start = float(np.mean(before[role][-FIRST:])) - driven[0]
        end = float(np.mean(behind[role][:FIRST])) - driven[-1]
        return ago, driven + np.linspace(start, end, len(ago))

    told = begin_after(log, earlier, role, past, list(starmap(rest, pairwise((*earlier, log)))))
    first, last = earlier[0].before(role).levels[0], float(np.mean(log[role][:FIRST]))
    return Begin((first, *told.levels[1:-1], last), told.ago, after=told.after)


def _gap(log: Experiment, before: Experiment, behind: Experiment, past: float) -> Array:
    """How long before a ``log``, s, up to ``past``, the samples (n,) would have been between two others."""
    h = log.sample_time
    first = min(log.start - ended(before) - h, past)
    return np.arange(first, log.start - behind.start + 0.5 * h, -h)


def _is_known(rig: Rig, log: Experiment, earlier: Sequence[Experiment], role: str) -> bool:
    """Whether what an input was until the experiment begins is known. That is 0 where it is so at first, or
    what it moves lies still where it does at rest, as where a log begins with its first step; or its first
    samples tell of a step then, from next to nothing. Where the log goes on from another, that one tells."""
    if goes_on(log, earlier):
        return True
    inputs = [r for r in ENTERS if r in log and all(r in other for other in earlier)]
    moved = [*inputs[inputs.index(role) :], *([] if log.begins else ["output"])]
    if any(_starts_at_rest(rig, log, earlier, r) for r in moved if r in log):
        return True
    begin, least = log.before(role), _NOTHING * _largest(log, earlier, role)
    return bool(begin.ago) and begin.ago[-1] <= log.sample_time and abs(begin.levels[-2]) <= least


def goes_on(log: Experiment, earlier: Sequence[Experiment]) -> bool:
    """Whether a log goes on where the last of the ``earlier`` ones ended, by their clock."""
    last = max((other for other in earlier if "output" in other), key=ended, default=None)
    if last is None or log.paused or "output" not in log:
        return False
    if not 0.0 < log.start - ended(last) < _NEXT * log.sample_time:
        return False
    jump = abs(float(log["output"][0]) - float(last["output"][-1]))
    return jump <= _NOTHING * _largest(log, earlier, "output")


def _starts_at_rest(rig: Rig, log: Experiment, earlier: Sequence[Experiment], role: str) -> bool:
    at = _lying(rig).get(role, 0.0)
    return abs(float(log[role][0]) - at) <= _NOTHING * _largest(log, earlier, role, at)


def _lying(rig: Rig) -> dict[str, float]:
    """Where signals of a rig at rest lie, by role, that are not 0 there."""
    if rig.integrator:
        return {"curvature": 0.0, "output": rig.zero}
    return {role: rig.own_zero(role) for role in ("curvature", "output")}


def _largest(log: Experiment, earlier: Sequence[Experiment], role: str, at: float = 0.0) -> float:
    return max(float(np.max(np.abs(each[role] - at))) for each in (log, *earlier))


def begin_after(
    log: Experiment,
    earlier: Sequence[Experiment],
    role: str,
    past: float,
    rests: Sequence[tuple[Array, Array]] = (),
) -> Begin:
    """An input's past, by the logs of the ``earlier`` experiments, up to so many s before this one, and by
    ``rests``, how long ago it was what between them; 0 where neither tells."""
    shown = [(_ago(log, other), np.asarray(other[role], float)) for other in earlier]
    ago, x = (
        (np.concatenate([np.zeros(0), *of]) for of in zip(*shown, *rests)) if shown else (np.zeros(0),) * 2
    )
    seen = ago <= past
    if not seen.any():
        return Begin()
    edges = [max(float(ago[seen].min()) - log.sample_time, log.sample_time)]
    while edges[-1] < ago[seen].max():
        edges.append(edges[-1] * (1.0 + _WIDTH) + log.sample_time)
    sums, _ = np.histogram(ago[seen], edges, weights=x[seen])
    count = np.histogram(ago[seen], edges)[0] if rests else np.diff(edges) / log.sample_time
    means = sums / np.maximum(count, 1)
    last = max(earlier, key=ended)
    since = float(last[role][-1]) if goes_on(log, earlier) else 0.0
    levels = (0.0, *map(float, means[::-1]), since)
    return Begin(levels, tuple(edges[::-1]), known=True, after=log.start - ended(last))


def _ago(log: Experiment, other: Experiment) -> Array:
    """How long before this experiment the samples of another one were, s."""
    made: Array = log.start - other.start - other.sample_time * np.arange(len(other))
    return made


def _shows(
    rig: Rig,
    placed: Sequence[Placed],
    logs: Sequence[Experiment],
    found: Sequence[Experiment],
    closer: bool,
) -> bool:
    """Whether what was before changes what is measured, and where that is asked comes ``closer`` to it while
    the input is still 0.

    A rig that was reset cannot have moved there, whatever its parameters are. Its zero may be off: by as much
    in all logs, those too that nothing was before. Where there are such ones, they tell how far.
    """
    entry = next(role for role in ENTERS if role in logs[0])
    leaves = [s for s in STAGES[STAGES.index(ENTERS[entry]) :] if all(LEAVES[s] in log for log in logs)]
    if not leaves or all(a is b for a, b in zip(logs, found)):
        return False
    y = joined(logs, LEAVES[leaves[-1]])
    before, after = (_made(rig, placed, of, entry, leaves[-1]) for of in (logs, found))
    if float(np.sqrt(np.mean((after - before) ** 2))) <= _SEEN * float(np.max(np.abs(before))):
        return False
    if not closer:
        return True
    asked = [log.before(entry).known and not goes_on(log, found[:n]) for n, log in enumerate(found)]
    if not any(asked):
        return True
    idle = np.concatenate([(_still(log, entry) | _first(log)) & a for log, a in zip(found, asked)])
    rest = np.concatenate([_still(log, entry) & log.before(entry).at_rest for log in found])
    if not rest.any():
        return bool(np.sum((y - after)[idle] ** 2) < np.sum((y - before)[idle] ** 2))
    both = idle | rest
    return bool(np.var((y - after)[both]) < _CONTRADICTED * np.var((y - before)[both]))


def _made(rig: Rig, placed: Sequence[Placed], logs: Sequence[Experiment], entry: str, leaves: str) -> Array:
    """What the rig makes (n,) of all experiments, from the input ``entry`` on."""
    way = between_of(rig, entry)
    x, chain, run = entering(logs, entry), Chain(rig, tuple(placed)), run_of(logs, entry)
    made: Array = chain.run(x, ENTERS[entry], leaves, run, way)
    return made


def _still(log: Experiment, role: str) -> Bools:
    """Which samples (n,) are ahead of the first at which the input is no longer 0."""
    x = np.abs(np.asarray(log[role], float))
    made: Bools = np.logical_and.accumulate(x <= _NOTHING * float(np.max(x)))
    return made


def _first(log: Experiment) -> Bools:
    """The first of all samples (n,), at which nothing has moved yet."""
    made: Bools = np.arange(len(log)) == 0
    return made
