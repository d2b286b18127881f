"""Units: those the project knows, and which of them a column's name ends in."""

from __future__ import annotations

import json
import re

import numpy as np

SIZES = {  # what one of each unit is, in the first of its kind
    "pressure": {"bar": 1.0, "kPa": 1e-2, "mbar": 1e-3, "psi": 0.0689476, "MPa": 10.0, "Pa": 1e-5},
    "curvature": {"1/mm": 1.0, "1/cm": 0.1, "1/m": 1e-3},
    "angle": {"rad": 1.0, "deg": np.pi / 180.0},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "current": {"A": 1.0, "mA": 1e-3},
}
"""The kinds of unit that tell a role, and that are taken for one another."""
_OTHERS = frozenset("mm cm m um N mN kN Nm s ms Hz rpm K C pct".split())  # these tell no role
_SPELLED = {"permm": "1/mm", "percm": "1/cm", "perm": "1/m", "1pm": "1/m", "1pmm": "1/mm", "hpa": "mbar"}
_TURNS = frozenset("rad deg mm cm m um".split())  # a second behind one of these is one below it
_FORCES = frozenset("mN N kN".split())  # a metre behind one of these is beside it or below it
_TIMES = frozenset("ns us µs μs ms msec s sec secs seconds min mins minutes h hr hrs hours day days".split())
_ALONE = frozenset("s h min day".split())  # names of other things as well
TIME_WORDS = frozenset("t time zeit timestamp stamp clock sec seconds secs ms tiempo temps x".split())
"""Words that a column of time is named by."""
_PRESSURES = frozenset("p pressure press druck presion chamber".split())
_CURRENTS = frozenset(
    "i current strom courant corriente valve coil solenoid motor pump heater drive u cmd command".split()
)
_LETTERS = dict.fromkeys("msNKC", _PRESSURES)  # of a channel, or of a word
_ANY_CASE = ("bar", "kPa", "mbar", "psi", "rad", "deg", "1/mm", "1/cm", "1/m")  # a name in v is no voltage


def unit_of(text: str) -> tuple[str, str] | None:
    """(kind, unit) that a unit or a column's name ends in, or None where it is none of :data:`SIZES`.

    >>> unit_of("p_kPa"), unit_of("kappa_cam_per_mm"), unit_of("angle"), unit_of("p_A")
    (('pressure', 'kPa'), ('curvature', '1/mm'), None, None)
    >>> unit_of("stiffness_N_per_mm"), unit_of("N_per_mm")
    (None, ('curvature', '1/mm'))
    """
    if _is_letter(text):
        return None
    if _of_two(text) is not None:
        return None
    words = re.sub(r"_?per_?", "_per", text.replace("1/", "_per")).strip("]) ").split("_")
    last = re.split(r"[\s\[(]+", words[-1])[-1]
    last = _SPELLED.get(last.lower(), last)
    for kind, sizes in SIZES.items():
        for unit in sizes:
            if unit == last or (unit in _ANY_CASE and unit.lower() == last.lower()):
                return kind, unit
    return None


def _is_letter(column: str) -> bool:
    """Whether a name ends in a letter that is no unit of what it names: the pressure of chamber A. An A is
    ampere only where the name speaks of what a current goes through."""
    *words, last = re.split(r"[\s_]+", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", column).strip())
    bare = {word.lower().rstrip("0123456789") for word in words}
    if last == "A" and words:
        return bare.isdisjoint(_CURRENTS)
    return not bare.isdisjoint(_LETTERS.get(last, frozenset()))


def _of_two(column: str) -> str | None:
    """The unit of two that a name ends in, "" where it may be their product as well as their ratio, None
    where it ends in no two."""
    *name, over, under = re.sub(r"_per_", "_/", column).split("_") if column.count("_") > 1 else ("", "")
    known = {unit for sizes in SIZES.values() for unit in sizes} | _OTHERS
    if not name or over not in known or under.removeprefix("/") not in known:
        return None
    if under.startswith("/"):
        return over + under
    if under == "s":
        return f"{over}/s" if over in _TURNS else ""
    return "" if over in _FORCES and under in _TURNS else None


def time_unit_named(column: str) -> str | None:
    """The unit that a column of time has in its name, None without; what stands in brackets, whatever it is.

    >>> time_unit_named("t_us"), time_unit_named("Zeit [h]"), time_unit_named("TimeMs")
    ('us', 'h', 'ms')
    >>> time_unit_named("t/min"), time_unit_named("t_atoms"), time_unit_named("n U/min")
    ('min', None, None)
    """
    if bracketed := re.search(r"[\[(]([^\[\]()]+)[\])]\s*$", column):
        return bracketed[1].strip()
    words = re.split(r"[\s_.\-]+", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", column).strip())
    over, slash, under = column.rpartition("/")  # as German standards write it: t / min
    if slash and over.strip().lower() in TIME_WORDS:
        words = [over, under.strip()]
    last = words[-1].lower()
    if last in _TIMES:
        return last if len(words) > 1 or last not in _ALONE else None
    return "ms" if last.endswith("ms") and last[:-2] in TIME_WORDS else None


def in_unit(column: str, unit: str = "s") -> str:
    r"""What to write where a ``column`` of time is in a ``unit`` that nothing else tells.

    >>> in_unit("t")
    "write time = { column = 't', unit = 's' } in the rig's [signals]"
    >>> in_unit("it's", "min")
    'write time = { column = "it\'s", unit = \'min\' } in the rig\'s [signals]'
    """
    name = (
        f"'{column}'"
        if "'" not in column and column.isprintable()
        else json.dumps(column, ensure_ascii=False)
    )
    return f"write time = {{ column = {name}, unit = '{unit}' }} in the rig's [signals]"


def unit_named(column: str | None) -> str:
    """The unit of any kind that a column's name ends in, "" where none is recognised.

    >>> unit_named("p_kPa"), unit_named("rate_per_s"), unit_named("force_N"), unit_named("N")
    ('kPa', '1/s', 'N', '')
    >>> unit_named("omega_rad_s"), unit_named("stiffness_N_per_mm"), unit_named("torque_N_m")
    ('rad/s', 'N/mm', '')
    """
    if (both := _of_two(column or "")) is not None:
        return both
    known = unit_of(column or "")
    if known:
        return known[1]
    *before, last = (column or "").split("_")
    if not before or last not in _OTHERS or _is_letter(column or ""):
        return ""  # a lone letter is a name
    return f"1/{last}" if before[-1] == "per" else last
