"""``rig.toml``: reading, checking and writing a rig."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from focgen.arguments import checked
from focgen.custody import TABLE
from focgen.errors import RigError
from focgen.fractional.terms import read_transfer, terms_of
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.logs.between import Between
from focgen.logs.experiment import ROLES
from focgen.logs.scales import Scale
from focgen.output import write_file
from focgen.rig.ahead import FARTHEST
from focgen.rig.rig import (
    UNITY,
    Actuator,
    Delays,
    LinearActuator,
    Origins,
    Ranges,
    Relative,
    Rig,
    Signals,
    Uncertainty,
)
from focgen.tomlfile import MOST_ORDER, Table, check_replaced

_STAGES = ("regulator", "actuator", "sensor")
_ROLES = ("time", "output", "command", "pressure", "curvature", "reference")
LEAST_ORDER = 0.01
"""The least order of s that a stage of a rig may have beside 0."""
_LONGEST = 1e6  # samples that a nominal delay may have
_WHICH = "say which log column plays which role"


def read_rig(path: str | Path | Mapping[str, Any]) -> Rig:
    """Read a rig from its file, or from a dictionary of the same shape. Raises RigError naming file, table,
    key and remedy."""
    if isinstance(path, Mapping):
        top, usual = Table(path, "rig", RigError), "rig"
    else:
        top, usual = Table.read(path, RigError), Path(path).stem
    sample_time = top.number("sample_time", above=0.0)
    stages = {stage: top.table(stage) for stage in _STAGES}
    delays = Delays(**{stage: _delay(table, sample_time) for stage, table in stages.items()})
    zero = 0.0 if stages["sensor"] is None else stages["sensor"].number("offset", 0.0)
    rig = Rig(
        name=top.text("name", usual),
        sample_time=sample_time,
        signals=_signals(top),
        actuator=_actuator(stages["actuator"]),
        regulator=_stage(stages["regulator"]),
        sensor=_stage(stages["sensor"], "offset"),
        zero=zero,
        ranges=_ranges(top.table("ranges")),
        effects=_effects(top),
        delays=delays,
        uncertainty=_uncertainty(top.table("uncertainty")),
        between=_between(top.section("signals", _WHICH)),
        lead=_lead(top.section("signals", _WHICH), top),
        downwards=_downwards(top.section("signals", _WHICH)),
        origins=_origins(top.section("signals", _WHICH)),
    )
    _check_origins(top, rig)
    top.table(TABLE)  # tells where the rig is from, and nothing of what it is
    top.done()
    return rig


def _signals(top: Table) -> Signals:
    table = top.section("signals", _WHICH)
    for role in ("time", "output"):
        table.required(role)
    named = {role: _column(table, role) for role in _ROLES}
    found = {role: column for role, (column, _) in named.items()} | {"run": table.text("run")}
    for key in ("between", "lead", "downwards", "origins"):
        table.raw(key)
    table.done()
    if found["command"] is None and found["pressure"] is None:
        raise table.fail(None, "has neither 'command' nor 'pressure'", "name the column of the input")
    _check_columns(table, found)
    scales = {role: scale for role, (_, scale) in named.items() if scale is not None}
    columns: dict[str, Any] = dict(found)
    signals = Signals(**columns, scales=scales, units=_units(top.table("units")))
    for role, scale in scales.items():
        try:
            scale.applied(np.zeros(1), "s" if role == "time" else signals.units.get(role))
        except ValueError as reason:
            remedy = f"correct it, or name the unit of {role} in [units]"
            raise table.fail(role, f"cannot be converted: {reason}", remedy) from None
    return signals


def _between(table: Table) -> Between | None:
    """What the first input does between its samples, where the file says so."""
    word = table.text("between")
    if word is None:
        return None
    if word.upper() not in Between.__members__:
        known = ", ".join(repr(way.name.lower()) for way in Between)
        raise table.fail("between", f"is {word!r}", f"give one of {known}, or leave it to the logs")
    return Between[word.upper()]


def _lead(table: Table, top: Table) -> float:
    """By how many s a command was sent ahead of its row."""
    lead = table.number("lead", 0.0)
    if abs(lead) > FARTHEST * top.number("sample_time", 0.0):
        what = f"is {lead:g} s, over {FARTHEST} samples"
        raise table.fail("lead", what, "put the command into the rows in which it acts")
    return lead


def _downwards(table: Table) -> frozenset[str]:
    """The roles whose signals effects count from 0 down."""
    roles = table.raw("downwards", [])
    if not isinstance(roles, list) or not all(role in ROLES for role in roles):
        raise table.fail("downwards", f"is {roles!r}", f"give a list of {', '.join(ROLES)}")
    return frozenset(roles)


def _origins(table: Table) -> Origins:
    """Where effects count signals from."""
    given = table.table("origins")
    if given is None:
        return Origins()
    found = Origins(**{role: given.number(role, 0.0) for role in vars(Origins())})
    given.done()
    return found


def _check_origins(top: Table, rig: Rig) -> None:
    """Raise RigError where effects count the curvature from a place that no rig of this kind rests at."""
    if not rig.origins.curvature:
        return
    remedy = "remove the curvature from [signals.origins]"
    if rig.actuator is None:
        raise top.fail("signals", "counts the curvature from an origin, and there is no [actuator]", remedy)
    if not np.isfinite(rig.sensor.dc_gain):
        raise top.fail("signals", "counts the curvature from an origin, and the sensor integrates", remedy)


def _column(table: Table, role: str) -> tuple[str | None, Scale | None]:
    """A role's column, by its name or as a table that says how it is scaled too."""
    if not isinstance(table.raw(role), dict):
        return table.text(role), None
    given = table.section(role, "")
    given.required("column")
    name = given.text("column")
    scale = Scale(given.number("scale", 1.0), given.number("offset", 0.0), given.text("unit"))
    given.done()
    if scale.unit is not None and ("scale" in given or "offset" in given):
        raise given.fail("unit", "is given beside 'scale' or 'offset'", "give the unit, or the numbers")
    if scale.scale == 0.0:
        raise given.fail("scale", "is 0", "give what the column is multiplied by")
    told = scale != Scale() or "scale" in given  # of 1: the numbers are what they look like
    return name, scale if told else None


def _units(table: Table | None) -> dict[str, str]:
    if table is None:
        return {}
    found = {role: table.text(role, "") for role in _ROLES if role in table}
    table.done()
    if found.pop("time", "s") != "s":
        raise table.fail(
            "time", "is not s", "the rig's time is in s: give the column's own unit in [signals]"
        )
    return found


def _check_columns(table: Table, columns: dict[str, str | None]) -> None:
    """Refuse a column with two roles: the stage between them would be taken for 1 without a word."""
    roles: dict[str, str] = {}
    for role, column in columns.items():
        if column is None:
            continue
        if column in roles:
            remedy = "give each role its own column, and leave out what is not logged"
            raise table.fail(role, f"is the column {column!r}, as {roles[column]!r} is", remedy)
        roles[column] = role


def _delay(table: Table | None, sample_time: float) -> float:
    """The stage's dead time, s; 0 where it has none."""
    if table is None:
        return 0.0
    delay = table.number("delay", 0.0)
    if delay < 0.0:
        raise table.fail("delay", f"is {delay:g}", "give a time of 0 s or more")
    if delay > _LONGEST * sample_time:
        raise table.fail("delay", f"is {delay:g} s, over a million samples", "give it in seconds")
    return delay


def _is_static(table: Table, *alone: str) -> bool:
    """Whether the stage has no dynamics: it is a pure delay, or what else may stand ``alone``."""
    given = any(key in table for key in ("delay", *alone))
    return given and not any(key in table for key in ("num", "den", "T", "alpha", "gain"))


def _stage(table: Table | None, *alone: str) -> TransferFunction:
    if table is None:
        return UNITY
    transfer = UNITY if _is_static(table, *alone) else _proper(table)
    table.done()
    return transfer


def _actuator(table: Table | None) -> Actuator | LinearActuator | None:
    if table is None:
        return None
    offset = table.number("offset", 0.0)
    if "num" in table or _is_static(table):
        transfer = UNITY if _is_static(table) else _proper(table)
        linear = LinearActuator(transfer, offset, table.number("bias", 0.0))
        table.done()
        return linear
    gain = table.numbers("gain")
    table.check_count("gain", gain)
    actuator = Actuator(table.number("T", above=0.0), _alpha(table), gain, offset)
    table.done()
    return actuator


def _proper(table: Table) -> TransferFunction:
    transfer = read_transfer(table)
    if not transfer.num:
        raise table.fail("num", "is zero", "give what the stage lets pass, or leave the stage out")
    if not transfer.is_proper:
        raise table.fail("num", "has a higher order than the denominator", "give a proper transfer function")
    for key, terms in (("num", transfer.num), ("den", transfer.den)):
        _check_orders(table, key, terms)
    return transfer


def _check_orders(table: Table, key: str, terms: Polynomial) -> None:
    """Raise where a response to a term could not be computed."""
    for term in terms:
        if term.order != 0.0 and not LEAST_ORDER <= term.order <= MOST_ORDER:
            what, span = f"has a term of order {term.order:g}", f"{LEAST_ORDER:g} to {MOST_ORDER:g}"
            raise table.fail(key, what, f"give orders of 0, or of {span}")


def _alpha(table: Table) -> float:
    alpha = table.number("alpha", above=0.0)
    if alpha >= 2.0:
        raise table.fail(
            "alpha", f"is {alpha:g}", "give an order in (0, 2); beyond it 1/(T s^alpha + 1) is unstable"
        )
    if alpha < LEAST_ORDER:
        raise table.fail("alpha", f"is {alpha:g}", f"give an order of at least {LEAST_ORDER:g}")
    return alpha


def _ranges(table: Table | None) -> Ranges:
    if table is None:
        return Ranges()
    ranges = Ranges(table.span("command"), table.span("pressure"), table.span("output"))
    table.done()
    return ranges


def _uncertainty(table: Table | None) -> Uncertainty:
    if table is None:
        return Uncertainty()
    usual = vars(Uncertainty())
    found = {stage: _relative(table.table(stage), usual[stage]) for stage in _STAGES}
    table.done()
    return Uncertainty(**found)


def _relative(table: Table | None, usual: Relative) -> Relative:
    """What is given of a stage's uncertainty, the default for the rest."""
    if table is None:
        return usual
    keys = [key for key, value in vars(usual).items() if value or key == "form"]
    found = Relative(**{key: table.number(key, getattr(usual, key)) for key in keys})
    table.done()
    for key, value in vars(found).items():
        if not 0.0 <= value < 1.0:
            raise table.fail(key, f"is {value:g}", "give a part of the whole: 0 or more, and below 1")
    return found


def _effects(top: Table) -> tuple[Mapping[str, Any], ...]:
    effects = top.raw("effects", [])
    if not isinstance(effects, list) or not all(isinstance(e, dict) and "name" in e for e in effects):
        raise top.fail("effects", "is not a list of tables with a 'name'", "write each effect as [[effects]]")
    return tuple(effects)


def check_replaces_rig(path: str | Path, proposed: bool = False) -> None:
    """Raise InputError where a rig would take the place of something else; ``proposed``: of a rig that has a
    model, which a proposal has not."""
    models = ("regulator", "actuator", "sensor", "effects") if proposed else ()
    check_replaced(
        path, "rig without a model" if proposed else "rig", ("sample_time", "signals"), ("transfer", *models)
    )


@checked
def write_rig(rig: Rig, path: str | Path) -> None:
    """Write a rig so that :func:`read_rig` gives an equal one.

    Raises InputError where it cannot be written.
    """
    write_file(path, rig_text(rig))


def rig_text(rig: Rig) -> str:
    """The rig as the text of its file; equal rigs give equal bytes."""
    return tomlkit.dumps(rig_table(rig))


def rig_table(rig: Rig) -> dict[str, Any]:
    """The rig as nested dictionaries, in the order of the file."""
    table: dict[str, Any] = {"name": rig.name, "sample_time": rig.sample_time}
    table["signals"] = _signals_table(rig.signals) | _input_table(rig)
    if rig.signals.units:
        table["units"] = dict(rig.signals.units)
    for key in ("regulator", "sensor"):
        stage = getattr(rig, key)
        if stage != UNITY:
            table[key] = {"num": terms_of(stage.num), "den": terms_of(stage.den)}
    if rig.actuator is not None:
        table["actuator"] = _actuator_table(rig.actuator)
    for key, delay in vars(rig.delays).items():
        if delay:
            table.setdefault(key, {})["delay"] = delay
    if rig.zero:
        table.setdefault("sensor", {})["offset"] = rig.zero
    table |= _bounds_table(rig)
    if rig.effects:
        table["effects"] = [dict(effect) for effect in rig.effects]
    return table


def _bounds_table(rig: Rig) -> dict[str, Any]:
    """Ranges, and uncertainties other than the usual; neither where there is none."""
    table: dict[str, Any] = {}
    ranges = {key: list(span) for key, span in vars(rig.ranges).items() if span is not None}
    if ranges:
        table["ranges"] = ranges
    usual = vars(Uncertainty())
    uncertain = {key: part for key, part in vars(rig.uncertainty).items() if part != usual[key]}
    if uncertain:
        table["uncertainty"] = {key: _relative_table(part, usual[key]) for key, part in uncertain.items()}
    return table


def _input_table(rig: Rig) -> dict[str, Any]:
    """What the file says of the rig's input, where it says something."""
    table: dict[str, Any] = {} if rig.between is None else {"between": rig.between.name.lower()}
    table |= {"lead": rig.lead} if rig.lead else {}
    if rig.downwards:
        table["downwards"] = [r for r in ROLES if r in rig.downwards]
    if rig.origins:
        table["origins"] = {role: at for role, at in vars(rig.origins).items() if at}
    return table


def _signals_table(signals: Signals) -> dict[str, Any]:
    named = {role: getattr(signals, role) for role in (*_ROLES, "run")}
    return {
        role: _column_table(name, signals.scales.get(role))
        for role, name in named.items()
        if name is not None
    }


def _column_table(name: str, scale: Scale | None) -> str | dict[str, Any]:
    if scale is None:
        return name
    given = {"unit": scale.unit} if scale.unit is not None else {"scale": scale.scale, "offset": scale.offset}
    return {"column": name, **given}


def _relative_table(part: Relative, usual: Relative) -> dict[str, Any]:
    return {k: v for k, v in vars(part).items() if vars(usual)[k] or (k == "form" and v)}


def _actuator_table(actuator: Actuator | LinearActuator) -> dict[str, Any]:
    table: dict[str, Any]
    if isinstance(actuator, Actuator):
        table = {"T": actuator.T, "alpha": actuator.alpha, "gain": list(actuator.gain)}
    else:
        table = {"num": terms_of(actuator.dynamics.num), "den": terms_of(actuator.dynamics.den)}
    for key in ("offset", "bias"):
        if getattr(actuator, key, 0.0):
            table[key] = getattr(actuator, key)
    return table
