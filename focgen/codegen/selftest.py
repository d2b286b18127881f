"""The self-test that a board runs: what is fed in, and what the reference answers to it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import focgen
from focgen.codegen.literals import literal, rows
from focgen.codegen.render import render
from focgen.codegen.state import size_of
from focgen.plan.execute import execute
from focgen.plan.plan import FLAG_HIGH, FLAG_LOW, Plan
from focgen.plan.scenario import Params, Reset, Scenario, Track, Tune, nearest_raw
from focgen.plan.sums import Count, Format
from focgen.plan.tuning import default_params
from focgen.present import present

RESET, TRACK, TUNE = 1, 2, 3
_FEWEST, _MOST = 240, 900  # steps; in between, twice the memory
_QUIET = 0.3  # of the steps that may stand at a limit, so that most show what they sum
_HALVINGS = 20


@dataclass(frozen=True)
class Row:
    """An event ahead of the first of ``steps`` steps with the same raw inputs.

    ``given``: ref, meas and u0 of a reset, u of a track and nothing, the factor on every gain and the limits
    of a tune; ``bad``: bit i stands for argument i of
    (``given``, ``inputs``) being no usable number. Inputs are ref, meas and the schedule (0 without one).
    """

    inputs: tuple[int | float, ...]
    steps: int = 1
    event: int = 0
    given: tuple[int | float, ...] = (0, 0, 0)
    bad: int = 0


@dataclass(frozen=True)
class SelftestContext:
    """Everything ``selftest.c.jinja`` and ``selftest.h.jinja`` ask for."""

    name: str
    version: str
    arithmetic: str
    sha256: str
    fixed: bool
    scheduled: bool
    bits: str
    nan: str
    infinity: str
    rows: list[str]
    outputs: list[str]
    flags: list[str]
    samples: int
    tunable: bool


def selftest_files(plan: Plan, sha256: str) -> dict[str, str]:
    """NAME_selftest.h and NAME_selftest.c; ``sha256`` is of the controller's file."""
    context = selftest_context(plan, sha256)
    return {f"{plan.name}_selftest.{end}": render(f"selftest.{end}.jinja", context) for end in ("h", "c")}


def selftest_entry(plan: Plan) -> dict[str, int]:
    """What the manifest says of it: how many steps it takes, and the bytes of its tables in flash."""
    made = selftest_rows(plan)
    signal, samples = size_of(plan.output.ctype), sum(row.steps for row in made)
    head = -(-(3 if plan.floating else 2) // signal) * signal
    return {"steps": samples, "table_bytes": len(made) * (head + 6 * signal) + samples * (signal + 1)}


def selftest_context(plan: Plan, sha256: str) -> SelftestContext:
    """Prepare the self-test of a plan."""
    made = selftest_rows(plan)
    answer = execute(plan, scenario_of(plan, made))
    wide = plan.output.bits
    exponent = ((1 << wide) >> 1) - (1 << (52 if wide == 64 else 23))
    return SelftestContext(
        name=plan.name,
        version=focgen.__version__,
        arithmetic=plan.arithmetic,
        sha256=sha256,
        fixed=not plan.floating,
        scheduled=plan.schedule is not None,
        bits=f"uint{wide}_t",
        nan=f"{exponent | exponent >> 1:#x}u",
        infinity=f"{exponent:#x}u",
        rows=[_text(plan, row) for row in made],
        outputs=rows(answer.u[0].tolist(), plan.output.ctype),
        flags=rows(present(answer.flags)[0].tolist(), "uint8_t"),
        samples=answer.u.shape[1],
        tunable=plan.tuning is not None,
    )


def _text(plan: Plan, row: Row) -> str:
    number = lambda value: literal(value, plan.output.ctype)
    given, inputs = (", ".join(map(number, part)) for part in (row.given, row.inputs))
    bad = f"{row.bad}, " if plan.floating else ""
    return f"{{{row.event}, {bad}{row.steps}, {{{given}}}, {{{inputs}}}}},"


# --------------------------------------------------------------------------------------------- what is fed in


def selftest_rows(plan: Plan) -> list[Row]:
    """The rows of a plan's self-test: the largest errors that leave most outputs between their limits, then
    everything else that a controller meets.
    """
    quiet = _Maker(plan, 1.0)
    for halving in range(_HALVINGS):
        quiet = _Maker(plan, 0.5**halving)
        if _saturated(plan, quiet.moving()) <= _QUIET:
            break
    return quiet.moving() + quiet.eventful()


def _saturated(plan: Plan, made: list[Row]) -> float:
    """The share of steps that end at a limit."""
    flags = present(execute(plan, scenario_of(plan, made)).flags)
    return float(np.mean(flags & (FLAG_HIGH | FLAG_LOW) != 0))


class _Maker:
    """Rows for a plan, with errors of ``size`` times the largest."""

    def __init__(self, plan: Plan, size: float) -> None:
        self.plan, self.size, self.count = plan, size, 0

    def next(self) -> float:
        """A number in 0 … 1: equidistributed, the same on every machine."""
        self.count += 1
        return (self.count * 40503 % 65536) / 65536.0

    def signal(self, form: Format, at: float) -> Count:
        """A raw value at the share ``at`` of a range."""
        return _within(form, float(form.low) + at * (float(form.high) - float(form.low)))

    def sched(self, at: float) -> Count:
        return self.signal(self.plan.schedule.signal, at) if self.plan.schedule else 0

    def small(self, steps: int = 1) -> Row:
        """Reference and measurement near one another, anywhere between."""
        plan, size = self.plan, self.size
        low = max(float(plan.reference.low), float(plan.measurement.low))
        high = min(float(plan.reference.high), float(plan.measurement.high))
        middle, most = 0.5 * (low + high), max(abs(float(plan.error.low)), abs(float(plan.error.high)))
        half = 0.5 * size * most * (2.0 * self.next() - 1.0)
        ref, meas = _within(plan.reference, middle + half), _within(plan.measurement, middle - half)
        return Row((ref, meas, self.sched(self.next())), steps)

    def large(self, up: bool, steps: int) -> Row:
        """The largest error there is; in integers beyond the ranges."""
        ref, meas = self.plan.reference, self.plan.measurement
        beyond = 0 if self.plan.floating else 1
        ends = (ref.high + beyond, meas.low - beyond) if up else (ref.low - beyond, meas.high + beyond)
        kept = [_in_type(form, end) for form, end in zip((ref, meas), ends)]
        return Row((*kept, self.sched(1.0 if up else 0.0)), steps)

    def reset(self, row: Row, at: float) -> Row:
        """The row after a reset to its own inputs, at the share ``at`` of the output's range."""
        return replace(row, event=RESET, given=(*row.inputs[:2], self.signal(self.plan.output, at)))

    def track(self, row: Row, at: float) -> Row:
        return replace(row, event=TRACK, given=(self.signal(self.plan.output, at), 0, 0))

    def moving(self) -> list[Row]:
        """Steps that fill the memory, twice where it is short: alone, then in rows."""
        steps = min(max(2 * (max(self.plan.error_lags, self.plan.filtered_lags) + 1), _FEWEST), _MOST)
        made, done = [self.reset(self.small(), 0.5)], 1
        while done < steps:
            made.append(self.small(1 if len(made) < 40 else 5 + len(made) % 7))
            made[-1] = self.track(made[-1], self.next()) if len(made) % 16 == 0 else made[-1]
            done += made[-1].steps
        return made

    def eventful(self) -> list[Row]:
        """Both limits, the schedule from end to end, resets and tracks, bad inputs."""
        made = [self.large(True, 6), self.track(self.large(False, 6), 1.0), self.large(True, 2)]
        made += [self.reset(self.small(3), at) for at in (0.0, 1.0, 0.4)]
        for place in range(13):
            row = self.small()
            made.append(replace(row, inputs=(*row.inputs[:2], self.sched(place / 12))))
        if self.plan.floating:
            made += self.unusable()
        if self.plan.tuning:
            made += self.tuned()
        return [*made, self.track(self.small(2), 0.6), self.reset(self.small(), 0.3), self.small(4)]

    def tune(self, row: Row, factor: Count, low: Count, high: Count) -> Row:
        """The row after parameters, raw."""
        return replace(row, event=TUNE, given=(factor, low, high))

    def tuned(self) -> list[Row]:
        """Every corner of the box; parameters that are refused; limits that the output is pushed against."""
        box, made = present(self.plan.tuning), []
        for corner in range(8):
            given = [span[corner >> i & 1] for i, span in enumerate(self.box())]
            made += [self.tune(self.small(), *given), self.small(), self.large(corner % 2 == 0, 3)]
        middle = self.signal(box.factor, 0.5), box.low[1], box.high[0]
        made += [self.tune(self.small(), *middle), self.track(self.small(), 1.0)]
        beyond = [(self.beyond(box.factor.high), *middle[1:]), (middle[0], box.high[1], middle[2])]
        made += [self.tune(self.small(), *given) for given in beyond]
        if self.plan.floating:
            made.append(replace(self.tune(self.small(), *middle), bad=1))
        one = default_params(self.plan)
        return [*made, self.tune(self.small(), one.gain[0], one.u_min, one.u_max)]

    def box(self) -> list[tuple[Any, ...]]:
        """The spans of a factor and of the limits, raw."""
        box = present(self.plan.tuning)
        return [(box.factor.low, box.factor.high), box.low, box.high]

    def beyond(self, count: Count) -> Count:
        """More than a count of the box, within the type."""
        return count * 1.5 if self.plan.floating else _in_type(self.plan.output, count + 1)

    def unusable(self) -> list[Row]:
        """Each argument of each call in turn; good samples in between."""
        inputs = (8, 16, 32) if self.plan.schedule else (8, 16)
        made = []
        for bad in inputs:
            made += [replace(self.small(2), bad=bad), self.small()]
        for bad in (1, 2, 4):
            made.append(replace(self.reset(self.small(), 0.5), bad=bad))
        made += [replace(self.track(self.small(), 0.7), bad=1), replace(self.track(self.small(), 0.7), bad=8)]
        return [*made, self.small()]


def _within(form: Format, value: float) -> Count:
    """The nearest raw value within a range, as a number of its type."""
    if form.floating:
        return float(nearest_raw(min(max(value, form.low), form.high), form))
    return int(min(max(round(value), form.low), form.high))


def _in_type(form: Format, value: float) -> Count:
    top = 1 << (form.bits - 1)
    return float(value) if form.floating else int(min(max(value, -top), top - 1))


# ---------------------------------------------------------------------------------------- as a scenario


def scenario_of(plan: Plan, made: list[Row]) -> Scenario:
    """The rows as one lane for the reference."""
    kind = np.dtype({"float": np.float32, "double": np.float64}.get(plan.output.ctype, np.int64))
    columns = np.array([_argument(row, 3 + i) for row in made for i in range(3)], kind).reshape(-1, 3)
    steps = [row.steps for row in made]
    ref, meas, sched = (np.repeat(columns[:, i], steps)[None, :] for i in range(3))
    starts = np.cumsum([0, *steps])
    resets = [
        Reset(0, int(at), _argument(row, 0), _argument(row, 1), _argument(row, 2))
        for row, at in zip(made, starts)
        if row.event == RESET
    ]
    tracks = [Track(0, int(at), _argument(row, 0)) for row, at in zip(made, starts) if row.event == TRACK]
    tunes = [Tune(0, int(at), _params(plan, row)) for row, at in zip(made, starts) if row.event == TUNE]
    return Scenario(ref, meas, sched if plan.schedule else None, tuple(resets), tuple(tracks),
                    tunes=tuple(tunes))  # fmt: skip


def _params(plan: Plan, row: Row) -> Params:
    factor, low, high = (_argument(row, i) for i in range(3))
    return Params((factor,) * len(present(plan.tuning).nominal), low, high)


def _argument(row: Row, place: int) -> Count:
    """An argument as the C passes it: NaN, or infinity at odd places, where it is bad."""
    if row.bad >> place & 1:
        return float("inf") if place % 2 else float("nan")
    return (*row.given, *row.inputs)[place]
