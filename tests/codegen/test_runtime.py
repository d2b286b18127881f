"""Every function of the runtime against Python's unbounded integers: exhaustively where 16 bits allow it.

Red when a shift, a product or a saturation of the runtime differs from exact integers anywhere.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cffi import FFI

from focgen.compiler import compile_shared
from focgen.resources import shipped


def _loop(function: str, x: str, y: str, *parameters: str) -> tuple[str, str]:
    """Prototype and C of a function over arrays, so that millions of values take no time."""
    name = function.removeprefix("foc_").removeprefix("ring_")
    prototype = f"void {name}({', '.join([f'const {x} *x', 'int32_t n', *parameters, f'{y} *y'])})"
    arguments = ", ".join(["x[i]", *(parameter.split()[-1] for parameter in parameters)])
    return prototype, f"{prototype} {{ int32_t i; for (i = 0; i < n; i++) y[i] = {function}({arguments}); }}"


_LOOPS = (
    _loop("foc_clamp16", "int16_t", "int16_t", "int16_t low", "int16_t high"),
    _loop("foc_clamp32", "int32_t", "int32_t", "int32_t low", "int32_t high"),
    _loop("foc_clamp64", "int64_t", "int64_t", "int64_t low", "int64_t high"),
    _loop("foc_sat16", "int32_t", "int16_t"),
    _loop("foc_sat32", "int64_t", "int32_t"),
    _loop("foc_shift32", "int32_t", "int32_t", "uint8_t by"),
    _loop("foc_shift64", "int64_t", "int64_t", "uint8_t by"),
    _loop("foc_mul32x16", "int32_t", "int64_t", "int16_t by"),
    _loop("foc_ring_next", "uint16_t", "uint16_t", "uint16_t size"),
    _loop("foc_ring_slot", "uint16_t", "uint16_t", "uint16_t size", "uint16_t lag"),
)


def _sum(arithmetic: str, x: str, total: str) -> str:
    return f"{total} dot_{arithmetic}(const {x} *, uint16_t, const {x} *, uint16_t, uint16_t, uint16_t)"


def _schedule(arithmetic: str, x: str, shifts: str = "") -> str:
    return f"{x} schedule_{arithmetic}({x}, const {x} *, const {x} *, const {x} *, {shifts}uint16_t)"


_SUMS = (
    _sum("q15", "int16_t", "int32_t"),
    _sum("q31", "int32_t", "int64_t"),
    _sum("f32", "float", "float"),
    _sum("f64", "double", "double"),
)
_GAINS = (
    _schedule("q15", "int16_t", "const uint8_t *, "),
    _schedule("q31", "int32_t", "const uint8_t *, "),
    _schedule("f32", "float"),
    _schedule("f64", "double"),
)

I16, I32, I64 = (np.iinfo(kind) for kind in (np.int16, np.int32, np.int64))


def _forwarded(prototype: str) -> str:
    """C that hands all arguments of a prototype on to the runtime's function of the same name."""
    head, _, arguments = prototype.partition("(")
    kinds = arguments.rstrip(")").split(", ")
    named = ", ".join(f"{kind} a{i}" for i, kind in enumerate(kinds))
    passed = ", ".join(f"a{i}" for i in range(len(kinds)))
    return f"{head}({named}) {{ return foc_{head.split()[-1]}({passed}); }}"


@pytest.fixture(scope="module")
def c(tmp_path_factory):
    """The runtime as a library: (ffi, library)."""
    folder = tmp_path_factory.mktemp("runtime")
    text = "\n".join(['#include "foc_rt.h"', *(code for _, code in _LOOPS), *map(_forwarded, _SUMS + _GAINS)])
    (folder / "rt.c").write_text(text)
    flags = ["-std=c99", "-O1", "-ffp-contract=off"]
    compile_shared([folder / "rt.c"], folder / "rt.so", flags, [shipped("c_runtime")])
    ffi = FFI()
    ffi.cdef("".join(f"{prototype};" for prototype in (*(head for head, _ in _LOOPS), *_SUMS, *_GAINS)))
    return ffi, ffi.dlopen(str(folder / "rt.so"))


def mapped(c, name: str, x: np.ndarray, *args, out: type) -> np.ndarray:
    ffi, library = c
    y = np.empty(len(x), out)
    pointer = lambda a: ffi.cast(f"{a.dtype.name}_t *", a.ctypes.data)
    getattr(library, name)(pointer(np.ascontiguousarray(x)), len(x), *args, pointer(y))
    return y


def everything16(kind: type = np.int16) -> np.ndarray:
    return np.arange(I16.min, I16.max + 1).astype(kind)


def edges(info, kind: type) -> np.ndarray:
    """The ends of a type, its neighbourhood of 0, powers of two and what lies beside them."""
    powers = [1 << n for n in range(info.bits - 1)]
    near = {p + d for p in (*powers, 0) for d in (-1, 0, 1)}
    values = {v for n in near for v in (n, -n)} | {info.min, info.min + 1, info.max, info.max - 1}
    return np.array(sorted(v for v in values if info.min <= v <= info.max), dtype=kind)


@pytest.mark.parametrize("low, high", [(-32768, 32767), (0, 0), (-5, 7), (100, 32767), (-32768, -32768)])
def test_clamp16_over_every_value(c, low, high):
    x = everything16()
    assert np.array_equal(
        mapped(c, "clamp16", x, low, high, out=np.int16), [min(max(v, low), high) for v in x.tolist()]
    )


def test_saturation_to_16_bits_over_every_value_and_beyond(c):
    x = np.concatenate([np.arange(-200_000, 200_001), edges(I32, np.int64)]).astype(np.int32)
    expected = [min(max(v, -32768), 32767) for v in x.tolist()]
    assert np.array_equal(mapped(c, "sat16", x, out=np.int16), expected)


def test_saturation_and_clamps_of_the_wide_types(c):
    x64, x32 = edges(I64, np.int64), edges(I32, np.int32)
    assert mapped(c, "sat32", x64, out=np.int32).tolist() == [
        min(max(v, I32.min), I32.max) for v in x64.tolist()
    ]
    for low, high in ((I64.min, I64.max), (-(1 << 40), 1 << 33), (5, 5)):
        assert mapped(c, "clamp64", x64, low, high, out=np.int64).tolist() == [
            min(max(v, low), high) for v in x64.tolist()
        ]
    for low, high in ((I32.min, I32.max), (-70000, 3), (5, 5)):
        assert mapped(c, "clamp32", x32, low, high, out=np.int32).tolist() == [
            min(max(v, low), high) for v in x32.tolist()
        ]


@pytest.mark.parametrize("by", range(17))
def test_shift_rounds_half_up_over_every_16_bit_value(c, by):
    """floor(x / 2^n + 1/2), by integers that cannot overflow."""
    x = everything16(np.int32)
    expected = [(2 * v + (1 << by)) // (1 << (by + 1)) for v in x.tolist()]
    assert mapped(c, "shift32", x, by, out=np.int32).tolist() == expected
    assert mapped(c, "shift64", x.astype(np.int64), by, out=np.int64).tolist() == expected


@pytest.mark.parametrize("by", range(63))
def test_shift_of_64_bits(c, by):
    half = (1 << by) >> 1
    x = np.array([v for v in edges(I64, np.int64).tolist() if v + half <= I64.max], np.int64)
    assert mapped(c, "shift64", x, by, out=np.int64).tolist() == [
        (2 * v + (1 << by)) // (1 << (by + 1)) for v in x.tolist()
    ]


def test_the_split_product_is_exact(c):
    """Every 16-bit factor with each 32-bit value at an edge."""
    x = edges(I32, np.int32)
    for y in [*range(-32768, 32768, 97), -32768, 32767, -1, 0, 1]:
        assert mapped(c, "mul32x16", x, y, out=np.int64).tolist() == [v * y for v in x.tolist()]


@pytest.mark.parametrize("size", [1, 2, 3, 7, 8, 255, 256, 65535])
def test_ring_slots(c, size):
    now = np.unique(np.array([0, 1, size // 2, size - 2, size - 1]) % size).astype(np.uint16)
    assert mapped(c, "next", now, size, out=np.uint16).tolist() == [(n + 1) % size for n in now.tolist()]
    for lag in {0, 1 % size, size // 3, size - 1}:
        assert mapped(c, "slot", now, size, lag, out=np.uint16).tolist() == [
            (n - lag) % size for n in now.tolist()
        ]


_KINDS = {
    "q15": (np.int16, "int16_t"),
    "q31": (np.int32, "int32_t"),
    "f32": (np.float32, "float"),
    "f64": (np.float64, "double"),
}


@pytest.mark.parametrize("arithmetic", _KINDS)
def test_sums_over_a_ring_at_every_place(c, arithmetic):
    """Each size, slot, oldest lag and number of taps of a small ring; floating sums in the promised order."""
    ffi, library = c
    kind, ctype = _KINDS[arithmetic]
    rng = np.random.default_rng(3)
    for size in range(1, 8):
        ring = rng.integers(-30000, 30000, size).astype(kind) * kind(0.37 if kind(0.5) else 1)
        weights = (
            rng.integers(-900, 900, size).astype(kind) / kind(7)
            if kind(0.5)
            else rng.integers(-900, 900, size).astype(kind)
        )
        w, x = (ffi.cast(f"{ctype} *", a.ctypes.data) for a in (weights, ring))
        for now in range(size):
            for oldest in range(size):
                for taps in range(1, oldest + 2):
                    seen = getattr(library, f"dot_{arithmetic}")(w, taps, x, size, now, oldest)
                    past = [ring[(now - oldest + i) % size] for i in range(taps)]
                    assert seen == in_order(weights[:taps], past, kind), (size, now, oldest, taps)


def in_order(weights, past, kind):
    """Σ w x, in the type for floating values and without bound for integers."""
    if not kind(0.5):
        return sum(int(w) * int(x) for w, x in zip(weights, past))
    total = kind(0)
    for w, x in zip(weights, past):
        total = kind(total + kind(w * x))
    return total


@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
def test_the_schedule_in_integers(c, arithmetic):
    """Every 16-bit value (scaled up for 32 bits) against the formula in unbounded integers."""
    ffi, library = c
    kind, ctype = _KINDS[arithmetic]
    up = 1 if arithmetic == "q15" else 65536
    points, gains = [-30000 * up, -5 * up, 12000 * up, 32000 * up], [100 * up, -20000 * up, 30000 * up, 5]
    rises = [(g1 - g0, b1 - b0) for g0, g1, b0, b1 in zip(gains, gains[1:], points, points[1:])]
    shifts = [14, 12, 14] if up == 1 else [30, 28, 30]
    slopes = [(rise << by) // run for (rise, run), by in zip(rises, shifts)]
    arrays = [np.array(a, kind) for a in (points, gains, slopes)] + [np.array(shifts, np.uint8)]
    pointers = [ffi.cast(f"{t} *", a.ctypes.data) for t, a in zip([ctype] * 3 + ["uint8_t"], arrays)]
    call = getattr(library, f"schedule_{arithmetic}")
    for x in range(-32768 * up, 32768 * up, 7 * up):
        assert call(x, *pointers, 4) == integer_gain(x, points, gains, slopes, shifts), x


def integer_gain(x, points, gains, slopes, shifts):
    if x < points[0]:
        return gains[0]
    if x >= points[-1]:
        return gains[-1]
    i = max(j for j in range(len(slopes)) if points[j] <= x)
    return gains[i] + (2 * slopes[i] * (x - points[i]) + (1 << shifts[i])) // (1 << (shifts[i] + 1))


@pytest.mark.parametrize("arithmetic", ["f32", "f64"])
def test_the_schedule_in_floating_point(c, arithmetic):
    ffi, library = c
    kind, ctype = _KINDS[arithmetic]
    points, gains = np.array([-1.0, 0.25, 3.0], kind), np.array([4.0, -0.3, 7.0], kind)
    slopes = np.diff(gains) / np.diff(points)
    pointers = [ffi.cast(f"{ctype} *", a.ctypes.data) for a in (points, gains, slopes)]
    call = getattr(library, f"schedule_{arithmetic}")
    assert call(-5.0, *pointers, 3) == gains[0] and call(3.0, *pointers, 3) == gains[2] == call(
        1e9, *pointers, 3
    )
    for x in np.random.default_rng(1).uniform(-1.0, 3.0, 500).astype(kind):
        i = 0 if x < points[1] else 1
        assert call(float(x), *pointers, 3) == gains[i] + slopes[i] * (x - points[i])


def test_the_promise_of_the_head_of_the_file():
    """Nothing is included but stdint.h, and the licence is named."""
    text = (shipped("c_runtime") / "foc_rt.h").read_text()
    assert [line for line in text.splitlines() if line.startswith("#include")] == ["#include <stdint.h>"]
    assert "SPDX-License-Identifier: 0BSD" in text
    assert "Zero-Clause BSD" in (shipped("c_runtime") / "LICENSE").read_text()
    assert (Path(__file__).parents[2] / "LICENSE").read_text().startswith("MIT License")
