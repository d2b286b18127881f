"""The compiled loops of the chain simulator (``kernels.c``, ``bending.c``, ``plant.c``,
``pace.c``, ``lever.c``, ``weak.c``) as functions.

The C is compiled on first use (half a second) into a temporary folder and loaded with cffi; nothing is left
behind. Every function takes a session's signal, shape (n,), and ``rest`` (n,), 1 where an experiment begins
and the loop starts at rest at 0, BALANCED where it starts in equilibrium with that sample, as if that had
been held for ever, and else 0; it returns a new array of shape (n,).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.compiler import compile_shared
from focgen.errors import BuildError
from focgen.scratch import temporary_folder

BALANCED = 2
_NEVER = np.zeros(1, np.uint8)  # of what has no past
_AT_ONCE = 1024  # samples that a compiled loop looks at many times: AT_ONCE in ``kernels.c``
_REGISTERS = 3  # a filter of order 2 is the quickest: one of order 1 is run as such
_SOURCES = [
    Path(__file__).with_name(f"{name}.c") for name in ("kernels", "bending", "plant", "pace", "lever", "weak")
]
_FLAGS = ["-O3", "-fno-math-errno", "-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"]


@cache
def _library() -> tuple[Any, Any]:
    from cffi import FFI

    ffi = FFI()
    ffi.cdef(Path(__file__).with_name("kernels.h").read_text())
    with temporary_folder() as folder:
        target = str(folder / "kernels.so")
        try:
            compile_shared(_SOURCES, target, [*_FLAGS, "-march=native"])
        except BuildError:
            compile_shared(_SOURCES, target, _FLAGS)
        library = ffi.dlopen(target)
    library.focgen_keep_memory()
    return ffi, library


def _call(name: str, x: Array, rest: Bytes, *others: Any) -> Array:
    ffi, library = _library()
    x = np.ascontiguousarray(x, float)
    y = np.empty_like(x)
    getattr(library, name)(
        len(x),
        ffi.from_buffer("double[]", x),
        ffi.from_buffer("double[]", y),
        ffi.from_buffer("unsigned char[]", rest),
        *others,
    )
    return y


def _doubles(*arrays: Array) -> list[Any]:
    """Pointers to arrays of doubles; each keeps what it points to, a copy where one is needed."""
    ffi, _ = _library()
    return [ffi.from_buffer("double[]", np.ascontiguousarray(a, float)) for a in arrays]


def modes(
    x: Array,
    rest: Bytes,
    a: Array,
    b0: Array,
    b1: Array,
    pair: Array,
    through: float,
    switching: bool,
    place: float = 0.0,
    stiffness: float = 0.0,
    slide: float = 0.0,
    stick: float = 0.0,
    held: bool = False,
) -> Array:
    """Sum of first-order modes; ``a``, ``b0``, ``b1`` (2, m) and ``pair`` (2, 6), rows loading and
    unloading; beyond ``place`` an obstacle takes ``stiffness`` times how far from ``x``, which runs in lines
    between samples, or is ``held``."""
    *pointers, room = _doubles(a, b0, b1, pair, np.empty(a.shape[1]))
    return _call(
        "focgen_modes",
        x,
        rest,
        a.shape[1],
        *pointers,
        float(through),
        int(held),
        int(switching),
        float(place),
        float(stiffness),
        float(slide),
        float(stick),
        room,
    )


def lag(x: Array, rest: Bytes, h: float, up: float, down: float) -> Array:
    """A first-order lag with time constants ``up`` while rising and ``down`` while falling, s (0: none)."""
    return _call("focgen_lag", x, rest, *_doubles(*(np.array(_lag(h, float(t))) for t in (up, down))))


def chamber(
    x: Array,
    rest: Bytes,
    h: float,
    lags: tuple[float, float],
    rates: tuple[float, float],
    throats: tuple[float, float],
    most: float,
    held: bool,
) -> Array:
    """A chamber that fills and vents towards ``x`` with these ``lags``, s, no faster than ``rates``, units of
    x per s, and to no more than ``most``; through ``throats``, in the unit of x, whose flow goes with the
    root of larger differences. x runs in lines, or is ``held``, from one sample to the next."""
    rows = []
    for tau, rate, throat in zip(lags, rates, throats):
        a, past, now = _lag(h, tau)
        of_x = (past + now, 0.0) if held else (past, now)
        rows.append(np.array([a, *of_x, tau, rate, throat if np.isfinite(throat) else 0.0]))
    return _call("focgen_chamber", x, rest, h, *_doubles(*rows), 0.0 if held else 0.5, float(most))


def _lag(h: float, tau: float) -> tuple[float, float, float]:
    if tau < 1e-4 * h:
        return 0.0, 0.0, 1.0
    a = np.exp(-h / tau)
    mean = -np.expm1(-h / tau) * tau / h
    return a, mean - a, 1.0 - mean


def orifice(x: Array, rest: Bytes, h: float, fill: float, vent: float, scale: float) -> Array:
    """A chamber filled and vented through orifices; ``fill``, ``vent`` in s for a step of ``scale``."""
    return _call("focgen_orifice", x, rest, h, float(fill), float(vent), float(scale), 2)


def rate_limit(x: Array, rest: Bytes, h: float, rate: float, tau: float = 0.0, soft: bool = False) -> Array:
    """Follow ``x`` with |dy/dt| ≤ ``rate`` (units of x per s), through a lag ``tau`` in s."""
    return _call("focgen_rate", x, rest, h, float(rate), float(tau), int(soft), 4 if soft else 1)


def drawn(x: Array, rest: Bytes, h: float, full: float, draw: float, refill: float) -> Array:
    """Follow ``x`` as far as a tank allows: it holds ``full``, units of x, gives ``draw`` of every rise, and
    is refilled by ``refill``, units of x per s."""
    return _call("focgen_drawn", x, rest, h, float(full), float(draw), float(refill))


def play(x: Array, rest: Bytes, width: float, start: float = 0.0) -> Array:
    """Backlash of half width ``width``, units of x."""
    return _call("focgen_play", x, rest, float(width), float(start))


def pressed(x: Array, rest: Bytes, even: float, growing: float) -> Array:
    """Backlash of half width ``even``, units of x, and ``growing`` of the magnitude of x more."""
    return _call("focgen_pressed", x, rest, float(even), float(growing))


def stick(
    x: Array, rest: Bytes, band: float, left: float, anew: bool = False, place: float = np.nan
) -> Array:
    """Stick–slip: held within ``band`` of ``x``, then slips to ``left`` from it, and follows at that distance
    until x turns round, or ``anew`` is held at once. ``place``: how far below x it lies where an experiment
    begins in equilibrium (not a number: where coming from 0 leaves it); units of x."""
    return _call("focgen_stick", x, rest, float(band), float(left), int(anew), float(place))


def bouc_wen(x: Array, rest: Bytes, width: float) -> Array:
    """Bouc–Wen's hysteretic variable in [−1, 1], of power 1 and as stiff wherever it unloads; ``width`` is
    the input's travel to reverse it, units of x."""
    return _call("focgen_bouc_wen", x, rest, float(width))


def spline(x: Array, c: Array) -> Array:
    """A spline over even parts of 0 to 1, level beyond, at ``x`` (n,); ``c`` (4, parts) as scipy has it."""
    return _call("focgen_spline", x, _NEVER, c.shape[1], *_doubles(c))


def power_creep(x: Array, rest: Bytes, h: float, tau: float, scale: float, power: float) -> Array:
    """What creeps after ``x`` at the rate ``scale``/``tau`` |distance/``scale``|^``power``; ``power`` > 1."""
    return _call("focgen_power_creep", x, rest, float(h), float(tau), float(scale), float(power))


def rational(x: Array, rest: Bytes, b: Array, a: Array) -> Array:
    """A discrete filter with numerator ``b`` and denominator ``a`` (a[0] = 1), of any length."""
    order, pointers = _padded((b, a), _REGISTERS)
    return _call("focgen_filter", x, rest, order, *pointers)


def _padded(sides: Sequence[Array], least: int = 1) -> tuple[int, list[Any]]:
    """The order of a discrete filter, and pointers to its ``sides`` of one length, ``least`` or more, and to
    room as long; the first keeps what all of them point to."""
    order = max(*map(len, sides), least) - 1
    table = np.zeros((len(sides) + 1, order + 1))
    for row, values in zip(table, sides):
        row[: len(values)] = values
    (first,) = _doubles(table)
    return order, [first, *(first + k * (order + 1) for k in range(1, len(table)))]


def plant(
    x: Array,
    rest: Bytes,
    course: tuple[Array, ...],
    levels: tuple[int, int, int, int],
    kept: bool,
    numbers: Array,
) -> Array:
    """A plant with dry friction and a hysteretic spring; what the arguments are is said in ``plant.c``.

    ``course``: ``line``, ``bend`` and ``twist`` (n,); ``levels``: the order, and the levels ``base``,
    ``fine`` and ``last``.
    """
    library, (_, base, _, last) = _library()[1], levels
    tables = np.empty((library.TABLES, last - base + 1, library.COUNTS))
    *parts, own, room = _doubles(*course, numbers, tables)
    return _call("focgen_plant", x, rest, *parts, *levels, int(kept), own, room)


def bent_modes(
    x: Array,
    rest: Bytes,
    a: Array,
    b0: Array,
    b1: Array,
    pair: Array,
    through: float,
    switching: bool,
    spring: Sequence[float],
    held: bool = False,
) -> Array:
    """As :func:`modes`, with the input less what ``spring`` (10,) takes: see ``bending.c``."""
    *pointers, own, room = _doubles(a, b0, b1, pair, np.array(spring, float), np.empty(a.shape[1]))
    return _call(
        "focgen_bent_modes",
        x,
        rest,
        a.shape[1],
        *pointers,
        float(through),
        int(held),
        int(switching),
        own,
        room,
    )


def bent_rational(x: Array, rest: Bytes, b: Array, c: Array, a: Array, spring: Sequence[float]) -> Array:
    """As :func:`rational`, with ``c`` the numerator for what ``spring`` (10,) takes from the input."""
    order, (*tables, room) = _padded((b, c, a))
    return _call("focgen_bent_filter", x, rest, order, *tables, *_doubles(np.array(spring, float)), room)


Slowness = tuple[int, Sequence[float], Array]
"""What an uneven pace depends on, {gain, fast, rate, scale, curve}, and the share (n,) of time: pace.c."""


Row = tuple[Array, Array, Array, Array, float]
"""Modes of a stage: a, b0, b1 (m,), the pair (6,), and what passes at once."""


def paced_modes(x: Array, rest: Bytes, row: Row, held: bool, slowness: Slowness) -> Array:
    """As :func:`modes` of one row, of a stage whose pace is not even."""
    return _row_with("focgen_paced_modes", x, rest, row, held, slowness)


def paced_rational(x: Array, rest: Bytes, b: Array, c: Array, a: Array, slowness: Slowness) -> Array:
    """As :func:`rational`, of a stage whose pace is not even, with ``c`` the numerator for what of the
    response enters."""
    return _filter_with("focgen_paced_filter", x, rest, (b, c, a), slowness)


def _row_with(name: str, x: Array, rest: Bytes, row: Row, held: bool, law: tuple[Any, ...]) -> Array:
    """A loop over modes that take what enters as a ``law`` says: by what, its numbers, and one a sample."""
    *modes, through = row
    by, numbers, course = law
    *pointers, own, each, room = _doubles(*modes, np.array(numbers, float), course, np.empty(len(modes[0])))
    return _call(name, x, rest, len(modes[0]), *pointers, float(through), int(held), by, own, each, room)


def _filter_with(name: str, x: Array, rest: Bytes, sides: tuple[Array, ...], law: tuple[Any, ...]) -> Array:
    """The same over a discrete filter."""
    by, numbers, course = law
    order, (*tables, room) = _padded(sides)
    own, each = _doubles(np.array(numbers, float), course)
    return _call(name, x, rest, order, *tables, by, own, each, room)


def levered_modes(x: Array, rest: Bytes, row: Row, held: bool, lever: Sequence[float]) -> Array:
    """As :func:`modes` of one row, with the input as strong as ``lever`` (3,) says: ``lever.c``."""
    *modes, through = row
    count = len(row[0])
    *pointers, own, room = _doubles(*modes, np.array(lever, float), np.empty(count))
    return _call("focgen_levered_modes", x, rest, count, *pointers, float(through), int(held), own, room)


def levered_rational(x: Array, rest: Bytes, b: Array, a: Array, lever: Sequence[float]) -> Array:
    """As :func:`rational`, with the input as strong as ``lever`` (3,) says."""
    order, (*tables, room) = _padded((b, a))
    return _call("focgen_levered_filter", x, rest, order, *tables, *_doubles(np.array(lever, float)), room)


Wear = tuple[int, Sequence[float], Array]
"""What a spring gives way with, {growth, scale, before, gain}, and what else (n,) it is: see ``weak.c``."""


def weak_modes(x: Array, rest: Bytes, row: Row, held: bool, wear: Wear) -> Array:
    """As :func:`modes` of one row, of an actuator whose spring gives way."""
    return _row_with("focgen_weak_modes", x, rest, row, held, wear)


def weak_rational(x: Array, rest: Bytes, b: Array, c: Array, a: Array, wear: Wear) -> Array:
    """As :func:`rational`, of an actuator whose spring gives way, with ``c`` the numerator for what of the
    response comes back."""
    return _filter_with("focgen_weak_filter", x, rest, (b, c, a), wear)


def products(rows: Array, known: Array | None = None) -> Array:
    """Every row's product with every other, (k, k), of ``rows`` (k, n), the first of which are ``known``;
    unlike ``rows @ rows.T`` in one thread."""
    _, library = _library()
    found, first = np.zeros((len(rows), len(rows))), 0
    if known is not None:
        first = len(known)
        found[:first, :first] = known
    library.focgen_products(rows.shape[1], len(rows), first, *_doubles(rows, found))
    return found


def innovations(
    y: Array,
    made: Array,
    weight: Array,
    rest: Bytes,
    coarse: int,
    ar: Array,
    less: Array | None = None,
    per: float = 1.0,
    into: Array | None = None,
) -> Array:
    """(y − made) · weight of every experiment in means of ``coarse`` samples, whitened by ``ar``; all (n,)
    but ``ar``. With ``less`` ``per`` times what they are more than that; they are left in ``into``."""
    ffi, library = _library()
    found = np.empty(len(y)) if into is None else into
    pointers = _doubles(y, made, weight, ar, np.empty(_AT_ONCE + len(ar)))
    count = library.focgen_innovations(
        len(y),
        pointers[0],
        ffi.from_buffer("double[]", found),
        ffi.from_buffer("unsigned char[]", rest),
        *pointers[1:3],
        coarse,
        len(ar) - 1,
        pointers[3],
        ffi.NULL if less is None else ffi.from_buffer("double[]", less),
        per,
        pointers[4],
    )
    return found[:count]
