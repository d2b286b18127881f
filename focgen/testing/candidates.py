"""What may be compared: a folder, an object in counts, a class of such, a plain step; and how it is run."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Numbers
from focgen.errors import InputError
from focgen.plan.plan import Plan
from focgen.plan.scenario import Params, Reset, Scenario, Track, Tune
from focgen.running.controller import LoadedController
from focgen.running.load import load

_WANTED = "give a folder, an object with reset, step and track in counts, or a function that steps"


class Steps(Protocol):
    """A candidate, in counts; it may have ``init()``, ``track(u)`` and ``flags``, a value or a method; and
    ``tune(params)``, which takes ``gain``, ``u_min`` and ``u_max`` of :class:`focgen.plan.scenario.Params`.
    """

    def reset(self, ref: Any, meas: Any, u0: Any) -> None:
        """Start at the output ``u0``, all in counts."""

    def step(self, ref: Any, meas: Any, *sched: Any) -> Any:
        """One sample in counts; the output in counts."""


def tunes(candidate: Candidate) -> bool:
    """Whether a candidate takes parameters."""
    one = candidate.make()
    return bool(one.tunable if isinstance(one, LoadedController) else hasattr(one, "tune"))


@dataclass(frozen=True, eq=False)
class Candidate:
    """Something to compare: ``make`` gives it anew before every run. ``plain``: a function that steps and
    cannot begin anew. ``isolated``: C, to be run in a process of its own.
    """

    label: str
    make: Callable[[], Steps]
    plain: bool = False
    isolated: bool = False


@dataclass(frozen=True, eq=False)
class Played:
    """What a candidate has answered, shape (lanes, samples); ``flags`` None where it has none."""

    u: Numbers
    flags: Numbers | None


def candidate_of(given: Any, plan: Plan) -> Candidate:
    """What to make of an argument. Raises InputError for what cannot be compared with ``plan``."""
    if isinstance(given, (str, Path)):
        loaded = load(given, raw=True, edited=True)
        return Candidate(str(given), _checked(loaded, plan, str(given)).new, isolated=True)
    if isinstance(given, LoadedController):
        return Candidate(repr(given), _checked(given, plan, repr(given)).counts, isolated=True)
    if not isinstance(given, type) and hasattr(given, "step"):
        _check_object(given, plan)
        return Candidate(repr(given), lambda: given, isolated=_is_c(given))
    if not callable(given):
        raise InputError("the candidate", f"is {given!r}", _WANTED)
    name = getattr(given, "__name__", repr(given))
    if isinstance(given, type) or not _required(given):
        made = given()
        _check_object(made, plan)
        return Candidate(name, given, isolated=_is_c(made))
    return Candidate(name, lambda: _Function(given), plain=True)


def _is_c(made: Any) -> bool:
    """Whether what steps is compiled C, whoever made it."""
    return isinstance(made, LoadedController) or bool(getattr(made, "isolated", False))


class _Function:
    """A plain step."""

    def __init__(self, step: Callable[..., Any]) -> None:
        self.step = step

    def init(self) -> None:
        """It stands where it should: it is asked for one run only."""

    def reset(self, ref: Any, meas: Any, u0: Any) -> None:
        raise AssertionError("a plain step is never reset")


def _required(given: Callable[..., Any]) -> int:
    """How many arguments a call needs."""
    try:
        parameters = inspect.signature(given).parameters.values()
    except (TypeError, ValueError):
        return 1
    named = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return sum(p.kind in named and p.default is inspect.Parameter.empty for p in parameters) + sum(
        p.kind is inspect.Parameter.VAR_POSITIONAL for p in parameters
    )


def _checked(given: LoadedController, plan: Plan, label: str) -> LoadedController:
    """That it speaks of the same counts."""
    made = given.plan
    wanted, found = (
        (p.arithmetic, p.error.lsb, p.output.lsb, p.schedule and p.schedule.signal.lsb) for p in (plan, made)
    )
    if wanted != found:
        what = f"is {found[0]} with other counts than the reference, which is {wanted[0]}"
        raise InputError(label, what, "compare folders of the same arithmetic and ranges")
    if plan.tuning and not given.tunable:
        raise InputError(label, "takes no parameters, and the reference does", "generate it with --tunable")
    return given


def _check_object(given: Any, plan: Plan) -> None:
    missing = [name for name in ("reset", "step") if not callable(getattr(given, name, None))]
    if plan.integrator and not callable(getattr(given, "track", None)):
        missing.append("track")
    if missing:
        raise InputError("the candidate", f"{given!r} has no {missing[0]}", _WANTED)
    if getattr(given, "scheduled", None) not in (None, plan.schedule is not None):
        takes, does = ("a", "does not") if given.scheduled else ("no", "does")
        what = f"{given!r} takes {takes} scheduling signal, and the reference {does}"
        raise InputError("the candidate", what, "compare it with the controller that it is of")


# ------------------------------------------------------------------------------------------------- running


def played(candidate: Candidate, plan: Plan, scenarios: Sequence[Scenario]) -> list[Played]:
    """Run every lane of every scenario of raw inputs, call by call."""
    return [_scenario(candidate, plan, scenario) for scenario in scenarios]


def _scenario(candidate: Candidate, plan: Plan, scenario: Scenario) -> Played:
    lanes = [_lane(candidate.make(), plan, scenario, lane) for lane in range(scenario.lanes)]
    flags = None if any(f is None for _, f in lanes) else np.array([f for _, f in lanes], np.int64)
    return Played(np.array([u for u, _ in lanes], float), flags)


def _lane(one: Steps, plan: Plan, scenario: Scenario, lane: int) -> tuple[list[float], list[int] | None]:
    events = events_of(scenario, lane)
    begin = getattr(one, "init", None) or (lambda: one.reset(*at_rest(plan)))
    begin()
    inputs = [x[lane].tolist() for x in (scenario.ref, scenario.meas, scenario.sched) if x is not None]
    flagged = hasattr(one, "flags")
    u: list[float] = []
    flags: list[int] = []
    for k, given in enumerate(zip(*inputs)):
        try:
            for event in events.get(k, ()):
                _happen(one, event)
            u.append(float(_answer(one.step(*given), Real, "step", "a number")))
            if flagged:
                now = getattr(one, "flags")  # noqa: B009 - which a candidate may have
                said = now() if callable(now) else now
                flags.append(int(_answer(said, Integral, "flags", "a whole number")))
        except Exception as error:
            now = events.get(k, "no event")
            error.add_note(f"at sample {k} of run {lane}, with the inputs {given}, after {now}")
            raise
    return u, flags if flagged else None


def _answer(value: Any, kind: type, of: str, wanted: str) -> Any:
    """A candidate's answer, where it is a number: text of one, for instance, is none."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, kind) or isinstance(value, bool):
        what = f"gives a value of the type {type(value).__name__} as its {of}"
        raise InputError("the candidate", what, f"return {wanted}")
    return value


def _happen(one: Any, event: Reset | Track | Tune) -> None:
    if isinstance(event, Tune):
        _tune(one, event.params)
    elif isinstance(event, Reset):
        one.reset(_plain(event.ref), _plain(event.meas), _plain(event.u0))
    elif hasattr(one, "track"):
        one.track(_plain(event.u))


def _tune(one: Any, params: Params) -> None:
    """What is refused changes nothing; whether an error or a number says so is the candidate's affair."""
    with suppress(InputError):
        one.tune(Params(tuple(map(_plain, params.gain)), _plain(params.u_min), _plain(params.u_max)))


def _plain(value: Any) -> int | float:
    """Python's own number, as the inputs are."""
    plain: int | float = value.item() if isinstance(value, np.generic) else value
    return plain


def events_of(scenario: Scenario, lane: int) -> dict[int, list[Reset | Track | Tune]]:
    """Tunes, resets and tracks of a lane by sample, in the order in which they happen."""
    found: dict[int, list[Reset | Track | Tune]] = {}
    every: tuple[Reset | Track | Tune, ...] = (*scenario.tunes, *scenario.resets, *scenario.tracks)
    for event in every:
        if event.lane == lane:
            found.setdefault(event.sample, []).append(event)
    return found


def at_rest(plan: Plan) -> tuple[int | float, int | float, int | float]:
    """Arguments of a reset that does what init does: no error, the output at 0 or the end nearest to it."""
    low, high = max(plan.reference.low, plan.measurement.low), min(plan.reference.high, plan.measurement.high)
    both = min(max(0, low), high)
    return both, both, min(max(0, plan.output.low), plan.output.high)
