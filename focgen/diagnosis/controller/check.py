"""The controller's stage: how the running one departs from the one that its file describes, from closed-loop
logs.

The controller is replayed on the logged reference and measurement. What it should have commanded is compared
with the logged command; what a shorter memory, coarser arithmetic or an output limit would have commanded
tells which of them it was. Lost and late samples show in the time stamps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.control.controller import Controller
from focgen.diagnosis.controller.quantisation import count_of
from focgen.diagnosis.controller.replayed import LASTING, Replayed, replayed
from focgen.diagnosis.controller.stamps import LOST, UNSTEADY, lost, unsteadiness
from focgen.diagnosis.controller.word_length import WordLength, with_word_length
from focgen.errors import ControllerError, PlanError
from focgen.logs.experiment import Experiment
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.formats import WORDS
from focgen.plan.scenario import physical_trace, to_raw

CONTROLLER_EFFECTS = ("short_memory", "fixed_point", "sample_jitter", "missed_samples", "output_saturation")
_LEAST, _LENGTHS = 10, 13  # samples of memory, and how many lengths are tried from there
_HALVINGS = 3  # of the distance between two of the lengths
_WORDS = tuple(WordLength(bits / 2, down) for bits in range(14, 33) for down in (False, True))
_GOOD = 0.5  # of the command's mean square departure that a cause has to explain
_NEARLY = 0.9  # of it: nothing is left for another
_ROUNDED = 1.5  # counts: a departure that only the output's rounding makes stays within
_TIED = 1.5  # times what the best cause leaves unexplained: who leaves less may be the cause as well
_RESOLVED = 5e-5  # of the command's range: departures below are the log's resolution
_LARGE = 0.01  # of it: so much that the loop is not the one of the file
_BIT = 1.0  # bits: words of about the stated length are those
_STEADY = 0.2  # what a departure that stays counts beside one from sample to sample
_STAYS = 5  # samples at one end of what the command runs over: there may be a limit


@dataclass(frozen=True)
class Departure:
    """One cause: ``share`` of the departure it explains, its parameter with unit."""

    effect: str
    share: float
    parameter: str
    value: float
    unit: str


@dataclass(frozen=True)
class ControllerCheck:
    """``departure``: root-mean-square of logged less ideal command, per sample, in its unit; ``causes``: for
    each, those that may be it, the likeliest first. ``unexplained``: that it is more than the log resolves,
    and none of them explains half of it; then ``large`` says whether it is a hundredth of the command's
    range."""

    departure: float
    resolved: bool
    causes: tuple[tuple[Departure, ...], ...]
    unexplained: bool = False
    large: bool = False


_Suspect = tuple[Departure, list[np.ndarray]]
"""A cause, its share not known yet, and what it would have commanded (2, n) in every experiment."""


def check_controller(controller: Controller, logs: Sequence[Experiment]) -> ControllerCheck:
    """Compare the logged command with the described controller's.

    Raises ControllerError where the logs lack reference or command, a scheduling signal, or samples.
    """
    logged = [log for log in logs if _closed(log)]
    if not logged:
        raise ControllerError(
            controller.name, "the logs lack reference or command", "name both columns in [signals]"
        )
    stamps = tuple((d,) for d in _late_or_lost(logged, controller.sample_time))
    replay = replayed(controller, logged)
    departure = float(np.sqrt(replay.gap))
    steady = max(float(np.sqrt(np.mean(a**2))) for a in replay.apart)
    resolved = max(departure, _STEADY * steady) >= _RESOLVED * replay.span
    found = _explained(replay) if resolved else []
    counted = _counted(replay, found)
    tied = (counted,) if counted is not None else _tied(found)
    unexplained = bool(resolved) and not (stamps or tied)
    tied = tuple(d for d in tied if not _stated(controller, d))
    large = unexplained and departure > _LARGE * replay.span
    return ControllerCheck(departure, bool(resolved), (*stamps, tied) if tied else stamps, unexplained, large)


def _stated(controller: Controller, departure: Departure) -> bool:
    """Whether the controller's own file says as much: arithmetic of these words is no departure from it."""
    own = WORDS.get(controller.arithmetic)
    return departure.effect == "fixed_point" and own is not None and departure.value >= own.bits - _BIT


def _closed(log: Experiment) -> bool:
    """Whether the log has what a replay of the controller takes: open-loop ones may lack the reference."""
    return "command" in log and "reference" in log and bool(np.all(np.isfinite(log["reference"])))


def _late_or_lost(logs: Sequence[Experiment], step: float) -> Iterator[Departure]:
    """What the raw time stamps show."""
    missing, uneven = lost(logs, step), unsteadiness(logs, step)
    if missing > LOST:
        yield Departure("missed_samples", 1.0, "share", missing, "")
    if uneven > UNSTEADY * step:
        yield Departure("sample_jitter", 1.0, "deviation", uneven, "s")


def _explained(replay: Replayed) -> list[Departure]:
    """Every suspect with its share of the departure."""
    least = max(replay.gap, 1e-300)
    return [replace(d, share=1.0 - replay.departure(made) / least) for d, made in _suspects(replay)]


def _tied(found: Sequence[Departure]) -> tuple[Departure, ...]:
    """Of every effect the best, of those the ones that explain about as much as the best of all, if that is
    enough."""
    best: dict[str, Departure] = {}
    for d in sorted(found, key=lambda d: -d.share):
        best.setdefault(d.effect, d)
    kept = [d for d in best.values() if d.share > _GOOD]
    return tuple(d for d in kept if 1.0 - d.share <= _TIED * (1.0 - kept[0].share))


def _counted(replay: Replayed, found: Sequence[Departure]) -> Departure | None:
    """Integer arithmetic, of whatever design, where the command goes in whole counts and departs by more than
    those, and no other cause explains that."""
    count = count_of(replay.commands) if found else None
    others = max((d.share for d in found if d.effect != "fixed_point"), default=0.0)
    if count is None or others > _NEARLY:
        return None
    if max(float(np.ptp(a)) for a in replay.apart) < _ROUNDED * count:
        return None
    words = max((d.share for d in found if d.effect == "fixed_point"), default=0.0)
    low, high = replay.controller.ranges.output
    bits = round(float(np.log2((high - low) / count)), 3)
    return replace(_coarse(bits), share=max(words, 1.0 - max(others, 0.0)))


def _suspects(replay: Replayed) -> Iterator[_Suspect]:
    yield from _forgetful(replay)
    yield from _generated(replay)
    yield from _worded(replay)
    yield from _limited(replay)


def _forgetful(replay: Replayed) -> Iterator[_Suspect]:
    """Memories shorter than the stated one: a few lengths, then ever closer ones about the best of them."""
    made: dict[int, list[np.ndarray]] = {}
    left: dict[int, float] = {}

    def tried(lengths: Iterable[int]) -> list[int]:
        for n in set(lengths) - set(left):
            made[n] = replay.with_memory(n)
            left[n] = replay.departure(made[n])
        return sorted(left)

    most = max(min(LASTING * max(map(len, replay.commands)), replay.controller.length - 1), _LEAST)
    lengths = tried(map(int, np.geomspace(_LEAST, most, _LENGTHS)))
    for _ in range(_HALVINGS):
        at = lengths.index(min(left, key=lambda n: left[n]))
        beside = lengths[max(at - 1, 0) : at + 2]
        lengths = tried(round((near * lengths[at]) ** 0.5) for near in beside)
    for n in lengths:
        yield Departure("short_memory", 0.0, "length", float(n), "samples"), made[n]


def _generated(replay: Replayed) -> Iterator[_Suspect]:
    """The C that would be generated for words of 16 bits; those of 32 depart less than logs resolve."""
    try:
        plan = build_plan(replay.controller, "q15")
    except PlanError:
        return
    made = [physical_trace(plan, execute(plan, to_raw(plan, s))).u for s in replay.scenarios]
    yield _coarse(16.0), made


def _worded(replay: Replayed) -> Iterator[_Suspect]:
    """Other arithmetic in words of few bits."""
    made = [with_word_length(replay.controller, s, _WORDS) for s in replay.scenarios]
    for words, *parts in zip(_WORDS, *made):
        yield _coarse(words.bits), parts


def _coarse(bits: float) -> Departure:
    return Departure("fixed_point", 0.0, "bits", bits, "bit")


def _limited(replay: Replayed) -> Iterator[_Suspect]:
    """Outputs that stop short of the controller's own limits, whether the integrator is told or winds up."""
    controller, joined = replay.controller, np.concatenate(replay.commands)
    low, high = controller.ranges.output
    unit = controller.units.output or "command unit"
    for end, own in ((float(joined.max()), high), (float(joined.min()), low)):
        stays = np.sum(np.abs(joined - end) < 1e-4 * (high - low))
        if stays >= _STAYS and abs(end - own) > 2e-3 * (high - low):
            ends = (low, end) if own == high else (end, high)
            told = replace(controller, ranges=replace(controller.ranges, output=ends))
            for made in (replay.with_memory(replay.length, told), [np.clip(u, *ends) for u in replay.ideal]):
                yield Departure("output_saturation", 0.0, "limit", end, unit), made
