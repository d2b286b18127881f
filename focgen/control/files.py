"""``controller.toml``: reading, checking and writing a controller.

name = "spba"
sample_time = 0.01                       # s
integrator = true                        # trapezoidal, clamped to ranges.output
slew_limit = 5.0                         # optional, with an integrator: units of the output a second
setpoint_filter = 0.2                    # optional: time constant of a lag ahead of the error, s; 0 for none
length = 1000                            # memory length L, samples
memory = "short"                         # or "exponential", with
tolerance = 1e-4                         # optional: relative error of its weights, up to
horizon = 1000000                        # optional: so many samples
operator = "gl"                          # optional; "continuous": s^α itself, within tolerance over
band = [0.01, 10.0]                      # optional: these frequencies, rad/s; with it there is no horizon
arithmetic = "q31"

[transfer]                               # eq. (8): terms [coefficient, order of s]
num = [[1.32, 0.6], [1.0, 0.0]]
den = [[1.0, 0.0]]                       # optional

[gain]                                   # or simply: gain = 2.5
breakpoints = [0.0, 0.1, 0.2]            # of the scheduling signal
gains = [480.0, 420.0, 350.0]

[ranges]                                 # physical; formats are planned for these
reference = [0.0, 0.02]
measurement = [0.0, 0.02]
output = [0.0, 10.0]                     # the output limits
schedule = [0.0, 0.25]                   # with a gain schedule only

[tunable]                                # optional: the box of generate --tunable, each key optional
gain = [0.5, 2.0]                        # factors on the gains, 1 among them
output_low = [0.0, 1.0]                  # the lower limit, ranges.output's among them
output_high = [5.0, 10.0]                # the upper limit, likewise

[units]                                  # optional, for comments
measurement = "1/mm"
output = "V"
schedule = "bar"

[designed_from]                          # optional
file = "rig.toml"
sha256 = "…"
options = { settling = 1.5, delay = 1 }  # of design
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import tomlkit

from focgen.arguments import checked
from focgen.control.controller import (
    ARITHMETICS,
    MEMORIES,
    NOTHING,
    TOLERANCES,
    Controller,
    ControllerRanges,
    GainSchedule,
    Option,
    Source,
    Tunable,
    Units,
)
from focgen.control.given import plain, table_of
from focgen.errors import ControllerError
from focgen.fractional.continuous import OPERATORS
from focgen.fractional.terms import read_transfer, terms_of
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_file
from focgen.tomlfile import Table, check_replaced, is_written

ControllerLike = Controller | str | Path | Mapping[str, Any]
"""A controller, the path of its controller.toml, or a dictionary of the same shape."""
_FACTORS = 1e-3, 1e3
"""What a factor on a gain can be."""
MOST_POINTS = 4096
"""Breakpoints of a schedule: a step looks for its own one by one."""


def controller_from(given: ControllerLike) -> Controller:
    """The controller that an argument is, held to the same whichever way it comes. Raises ControllerError
    where it is none, or cannot be used."""
    if isinstance(given, Controller):
        return _of_object(given)
    if not isinstance(given, (str, os.PathLike, Mapping)):
        remedy = "give a Controller, a controller.toml or a dictionary like it"
        raise ControllerError("controller", f"is {type(given).__name__}", remedy)
    return read_controller(given)


def _of_object(given: Controller) -> Controller:
    """An equal one, of Python's own numbers, where its file could be read."""
    where = "controller"
    made = controller_of(Table(table_of(given, where), where, ControllerError), where)
    unused = Table({"horizon": plain(given.horizon)}, where, ControllerError)  # of "continuous", for "gl"
    return replace(made, horizon=_whole(unused, "horizon", 1))


@checked
def read_controller(path: str | Path | Mapping[str, Any]) -> Controller:
    """Read a controller from its file, or from a dictionary of the same shape. Raises ControllerError naming
    file, table, key and remedy."""
    if isinstance(path, Mapping):
        return controller_of(Table(path, "controller", ControllerError), "controller")
    return controller_of(Table.read(path, ControllerError), Path(path).stem)


def controller_of(top: Table, name: str) -> Controller:
    """The controller that a table describes, ``name`` where it has none. Raises ControllerError."""
    gain, integrator = _gain(top), top.flag("integrator", False)
    ranges = _ranges(top, isinstance(gain, GainSchedule))
    controller = Controller(
        name=top.text("name", name),
        sample_time=top.number("sample_time", above=0.0),
        transfer=_transfer(top),
        gain=gain,
        integrator=integrator,
        ranges=ranges,
        length=_whole(top, "length", 1000),
        memory=_choice(top, "memory", "short", MEMORIES),
        arithmetic=_choice(top, "arithmetic", "q31", ARITHMETICS),
        units=_units(top.table("units")),
        designed_from=_source(top.table("designed_from")),
        horizon=_whole(top, "horizon", 1_000_000),
        **_operator(top),
        tunable=_tunable(top.table("tunable"), gain, ranges),
        slew_limit=_slew_limit(top, integrator),
        setpoint_filter=_setpoint_filter(top),
    )
    top.done()
    return controller


def _transfer(top: Table) -> TransferFunction:
    table = top.section("transfer", "give num and den as [coefficient, order of s] terms")
    transfer = read_transfer(table)
    table.done()
    return transfer


def _gain(top: Table) -> float | GainSchedule:
    if not isinstance(top.values.get("gain"), dict):
        return top.number("gain", 1.0)
    table = top.section("gain", "")
    points, gains = table.numbers("breakpoints"), table.numbers("gains")
    table.done()
    if len(points) != len(gains):
        raise table.fail(
            "gains", f"has {len(gains)} values for {len(points)} breakpoints", "give one gain for each"
        )
    if len(points) > MOST_POINTS:
        raise table.fail("breakpoints", f"has {len(points)} values", f"give at most {MOST_POINTS}")
    if len(points) < 2 or any(b <= a for a, b in pairwise(points)):
        raise table.fail("breakpoints", f"is {list(points)}", "give at least two, rising strictly")
    return GainSchedule(points, gains)


def _ranges(top: Table, scheduled: bool) -> ControllerRanges:
    table = top.section("ranges", "give reference, measurement and output as [low, high]")
    needed = ["reference", "output"] + ["schedule"] * scheduled
    for key in needed:
        table.required(key)
    ranges = _spans(table, [*needed, "measurement"])
    if "schedule" in table and not scheduled:
        raise table.fail("schedule", "is given, but the gain is not scheduled", "remove it or add [gain]")
    table.done()
    return ranges


def _spans(table: Table, keys: Sequence[str]) -> ControllerRanges:
    spans: dict[str, Any] = {key: table.span(key) for key in keys}
    spans["measurement"] = spans["measurement"] or NOTHING
    return ControllerRanges(**spans)


def _tunable(table: Table | None, gain: float | GainSchedule, ranges: ControllerRanges) -> Tunable | None:
    """The box; what it does not name stays as it is."""
    if table is None:
        return None
    low, high = ranges.output
    box = Tunable(
        table.span("gain") or (1.0, 1.0),
        table.span("output_low") or (low, low),
        table.span("output_high") or (high, high),
    )
    table.done()
    if box == Tunable((1.0, 1.0), (low, low), (high, high)):
        raise table.fail(None, "names nothing", "give gain, output_low or output_high as [low, high]")
    _check_factors(table, box.gain)
    for key, span, end in (("output_low", box.output_low, low), ("output_high", box.output_high, high)):
        if end != (span[0] if key == "output_low" else span[1]):
            remedy = f"let it {'begin' if key == 'output_low' else 'end'} at {end:g}, which ranges.output has"
            raise table.fail(key, f"is {list(span)}", remedy)
    if box.output_low[1] >= box.output_high[0]:
        what = f"reaches {box.output_low[1]:g}, and output_high {box.output_high[0]:g}"
        raise table.fail("output_low", what, "keep the two apart, so that the limits cannot cross")
    if "gain" in table and isinstance(gain, GainSchedule) and ranges.schedule:
        _check_inside(table, gain, ranges.schedule)
    return box


def _slew_limit(top: Table, integrator: bool) -> float | None:
    if "slew_limit" not in top:
        return None
    if not integrator:
        remedy = "set integrator = true, or limit the output behind the controller and track it"
        raise top.fail("slew_limit", "is given without an integrator, which alone can keep it", remedy)
    return top.number("slew_limit", above=0.0)


def _setpoint_filter(top: Table) -> float | None:
    seconds = top.number("setpoint_filter", 0.0)
    if seconds < 0.0:
        raise top.fail("setpoint_filter", f"is {seconds:g}", "give a time constant in seconds, or 0 for none")
    return seconds or None


def _check_factors(table: Table, span: tuple[float, float]) -> None:
    if not (_FACTORS[0] <= span[0] <= 1.0 <= span[1] <= _FACTORS[1]):
        remedy = f"give factors from {_FACTORS[0]:g} to {_FACTORS[1]:g}, with 1 among them"
        raise table.fail("gain", f"is {list(span)}", remedy)


def _check_inside(table: Table, gain: GainSchedule, span: tuple[float, float]) -> None:
    """A factor belongs to a breakpoint, so every breakpoint must be one that the signal reaches."""
    beyond = [point for point in gain.breakpoints if not span[0] <= point <= span[1]]
    if beyond:
        what = f"cannot be applied at the breakpoint {beyond[0]:g}, beyond ranges.schedule"
        raise table.fail("gain", what, "move the breakpoint, or widen ranges.schedule")


def _whole(top: Table, key: str, default: int) -> int:
    count = top.raw(key, default)
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise top.fail(key, f"is {count!r}", f"give a memory {key} of at least 1 sample")
    return count


def _choice(top: Table, key: str, default: str, choices: tuple[str, ...]) -> str:
    value = top.text(key, default)
    if value not in choices:
        raise top.fail(key, f"is {value!r}", f"choose one of {', '.join(choices)}")
    return value


def _operator(top: Table) -> dict[str, Any]:
    """What an exponential memory follows, and how closely. A band of "gl" is refused, never ignored."""
    operator = _choice(top, "operator", "gl", OPERATORS)
    found = {"operator": operator, "tolerance": top.number("tolerance", TOLERANCES[operator], above=0.0)}
    if operator == "continuous":
        if top.text("memory", "short") != "exponential":
            raise top.fail("operator", "needs exponential memory", 'add memory = "exponential"')
        if "horizon" in top:
            raise top.fail("horizon", 'belongs to operator = "gl"', "remove it; band says where it holds")
    if "band" not in top:
        return found
    if operator == "gl":
        raise top.fail("band", 'belongs to operator = "continuous"', "add that, or remove it")
    return {**found, "band": top.span("band")}


def _units(table: Table | None) -> Units:
    if table is None:
        return Units()
    units = Units(*(table.text(key, "") for key in ("measurement", "output", "schedule")))
    table.done()
    return units


def _source(table: Table | None) -> Source | None:
    if table is None:
        return None
    table.required("file"), table.required("sha256")
    source = Source(table.text("file", ""), table.text("sha256", ""), _options(table.table("options")))
    table.done()
    return source


def _options(table: Table | None) -> tuple[tuple[str, Option], ...]:
    """What the controller was designed with: told, and nothing of what it is."""
    names = () if table is None else tuple(table.values)
    if table is not None and not all(isinstance(name, str) and is_written(name) for name in names):
        raise table.fail(None, "has a name that is no text", "give names that can be written as UTF-8")
    return tuple((name, _option(table, name)) for name in names if table is not None)


def _option(table: Table, name: str) -> Option:
    value = table.raw(name)
    if isinstance(value, list):
        return table.numbers(name)
    return (
        table.text(name, "")
        if isinstance(value, str)
        else value
        if isinstance(value, int)
        else table.number(name)
    )


def source_table(source: Source) -> dict[str, Any]:
    """As the file has it; without options where none are known."""
    given = {name: list(value) if isinstance(value, tuple) else value for name, value in source.options}
    return {"file": source.file, "sha256": source.sha256, **({"options": given} if given else {})}


def check_replaces_controller(path: str | Path) -> None:
    """Raise InputError where a controller would take the place of something else."""
    check_replaced(path, "controller", ("sample_time", "transfer"))


@checked
def write_controller(controller: Controller, path: str | Path) -> None:
    """Write a controller so that :func:`read_controller` gives an equal one.

    Raises ControllerError where it could not be read, InputError where it cannot be written.
    """
    write_file(path, controller_text(controller_from(controller)))


def controller_text(controller: Controller) -> str:
    """The controller as the text of its file; equal controllers give equal bytes."""
    return tomlkit.dumps(controller_table(controller))


def _followed(controller: Controller) -> dict[str, Any]:
    """What an exponential memory follows, and where."""
    if controller.operator == "gl":
        return {"horizon": controller.horizon}
    band = {} if controller.band is None else {"band": list(controller.band)}
    return {"operator": controller.operator, **band}


def controller_table(controller: Controller) -> dict[str, Any]:
    """The controller as plain numbers, texts and tables of them."""
    plain = ("name", "sample_time", "integrator", "length", "memory", "arithmetic")
    table: dict[str, Any] = {key: getattr(controller, key) for key in plain}
    if controller.slew_limit is not None:
        table["slew_limit"] = controller.slew_limit
    if controller.setpoint_filter is not None:
        table["setpoint_filter"] = controller.setpoint_filter
    if controller.memory == "exponential":
        table.update(tolerance=controller.tolerance, **_followed(controller))
    if not controller.scheduled:
        table["gain"] = controller.gain
    transfer = controller.transfer
    table["transfer"] = {"num": terms_of(transfer.num), "den": terms_of(transfer.den)}
    if isinstance(controller.gain, GainSchedule):
        table["gain"] = {key: list(values) for key, values in asdict(controller.gain).items()}
    spans = {key: list(s) for key, s in asdict(controller.ranges).items() if s not in (None, NOTHING)}
    table["ranges"] = spans
    if controller.tunable:
        table["tunable"] = _box(controller.tunable)
    units = {key: unit for key, unit in asdict(controller.units).items() if unit}
    if units:
        table["units"] = units
    if controller.designed_from:
        table["designed_from"] = source_table(controller.designed_from)
    return table


def _box(tunable: Tunable) -> dict[str, list[float]]:
    """The spans of [tunable]; one that holds a single value is left out."""
    spans = asdict(tunable).items()
    return {key: list(span) for key, span in spans if span[0] < span[1]}
