"""Mutations of bytes, of words and lines, and of the values in TOML and JSON."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Sequence
from random import Random

LARGEST = 1 << 16
"""Bytes of an input: what takes longer than its size tells is found with few."""
NUMBERS = """0 -0.0 1 -1 2 0.5 1e-9 1e9 1e308 -1e308 5e-324 1e-320 1e999 nan -nan inf -inf 0x10 1_000 1,5 .5
 255 256 32767 32768 65536 2147483647 2147483648 4294967296 9223372036854775807 9223372036854775808
 99999999999999999999 1e400 1e-400 00 +1 ٣ 1e 1e+ --1 true false null""".split()
TEXTS = (
    "",
    " ",
    "\0",
    "\n",
    "../x",
    "/",
    "C:\\x",
    "con",
    "NULL",
    "a" * 300,
    "%s%n",
    '"); system("id"); ("',
    "*/",
    "??/",
    "<script>alert(1)</script>",
    "</script>",
    "$\\frac{$ x",
    "`id`",
    "$(id)",
    "{{ 7*7 }}",
    "{% raw %}",
    "|",
    "\u202e",
    "\ud800",
    "ﬀ",
    "Ω²",
    "9**9**9",
    "m**9**9**9",
    "1e400 m",
    "\x1b[31m",
    "__class__",
    "=1+1",
    "-",
    "--",
    "--json",
)
_NUMBER = re.compile(rb"[-+]?\d[\d.eE+-]*")
_QUOTED = re.compile(rb'"[^"\n]*"')
ODD = (
    None,
    True,
    False,
    0,
    -1,
    1,
    0.5,
    -0.0,
    1e308,
    5e-324,
    float("inf"),
    float("nan"),
    10**25,
    10**400,
    "",
    "x",
    [],
    [[]],
    {},
    {"a": 1},
    [0.0] * 50,
    [1.0, 0.0],
    [0.0, 1.0],
    [[1.0, 0.0]],
    [[1.0, 0.5], [1.0, 0.0]],
)


def mutated(data: bytes, other: bytes, words: Sequence[bytes], form: str, rng: Random) -> bytes:
    """One to four mutations of ``data``; ``other`` is spliced in, ``words`` are put in, ``form`` is
    "toml", "json" or "" for anything else."""
    if form and rng.random() < 0.5:
        found = _in_structure(data, form, rng)
        if found is not None:
            data = found
            if rng.random() < 0.8:
                return data[:LARGEST]
    for _ in range(rng.choice((1, 1, 2, 4))):
        data = rng.choice(_WAYS)(data, other, words, rng)
    return data[:LARGEST]


def _flip(data, other, words, rng):
    if not data:
        return b"\0"
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def _byte(data, other, words, rng):
    at = rng.randrange(len(data) + 1)
    return (
        data[:at]
        + bytes([rng.choice((0, 9, 10, 13, 32, 34, 44, 59, 92, 127, 255, rng.randrange(256)))])
        + data[at + 1 :]
    )


def _cut(data, other, words, rng):
    at = rng.randrange(len(data) + 1)
    return data[:at] + data[at + rng.choice((1, 2, 4, 16, rng.randrange(len(data) + 1))) :]


def _doubled(data, other, words, rng):
    at = rng.randrange(len(data) + 1)
    part = data[at : at + rng.choice((1, 4, 16, 64))]
    return data[:at] + part * rng.choice((2, 2, 3, 50)) + data[at:]


def _word(data, other, words, rng):
    at = rng.randrange(len(data) + 1)
    word = (
        rng.choice(words)
        if words and rng.random() < 0.6
        else rng.choice(TEXTS).encode("utf-8", "surrogatepass")
    )
    return data[:at] + word + data[at + rng.choice((0, len(word))) :]


def _number(data, other, words, rng):
    found = list(_NUMBER.finditer(data))
    if not found:
        return _word(data, other, words, rng)
    one = rng.choice(found)
    return data[: one.start()] + rng.choice(NUMBERS).encode() + data[one.end() :]


def _text(data, other, words, rng):
    found = list(_QUOTED.finditer(data))
    if not found:
        return _word(data, other, words, rng)
    one = rng.choice(found)
    return (
        data[: one.start() + 1] + rng.choice(TEXTS).encode("utf-8", "surrogatepass") + data[one.end() - 1 :]
    )


def _line(data, other, words, rng):
    lines = data.split(b"\n")
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.randrange(3)
    if how == 0:
        del lines[at]
    elif how == 1:
        lines.insert(to, lines[at])
    else:
        lines[at], lines[to] = lines[to], lines[at]
    return b"\n".join(lines)


def _spliced(data, other, words, rng):
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def _whole(data, other, words, rng):
    """Numbers of binary formats: sizes and offsets of four or eight bytes."""
    at = rng.randrange(len(data) + 1)
    size = rng.choice((2, 4, 8))
    value = rng.choice((0, 1, -1, 255, 1 << 15, 1 << 31, 1 << 62, rng.randrange(1 << 16))) % (1 << (8 * size))
    return data[:at] + value.to_bytes(size, "little") + data[at + size :]


_WAYS = (_flip, _byte, _cut, _doubled, _word, _number, _number, _text, _line, _spliced, _whole)


def _in_structure(data: bytes, form: str, rng: Random) -> bytes | None:
    """One value or key changed; None where the data have no structure."""
    try:
        text = data.decode("utf-8")
        content = json.loads(text) if form == "json" else tomllib.loads(text)
    except (ValueError, RecursionError):
        return None
    holders = _holders(content)
    if not holders:
        return None
    holder = rng.choice(holders)
    key = rng.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    how = rng.random()
    if how < 0.2:
        del holder[key]
    elif how < 0.35 and isinstance(holder, dict):
        holder[rng.choice(TEXTS)] = copy.deepcopy(holder[key])
    elif how < 0.5:
        from_elsewhere = rng.choice(holders)
        holder[key] = copy.deepcopy(from_elsewhere if rng.random() < 0.3 else _any(from_elsewhere, rng))
    else:
        holder[key] = rng.choice(ODD) if rng.random() < 0.7 else rng.choice(TEXTS)
    try:
        made = json.dumps(content) if form == "json" else _toml(content)
        return made.encode("utf-8", "surrogatepass")
    except (ValueError, RecursionError):
        return None


def _any(holder, rng):
    return rng.choice(list(holder.values()) if isinstance(holder, dict) else holder)


def _holders(content) -> list:
    found, waiting = [], [content]
    while waiting and len(found) < 2000:
        one = waiting.pop()
        if isinstance(one, (dict, list)) and one:
            found.append(one)
            waiting += one.values() if isinstance(one, dict) else one
    return found


def _toml(content: dict) -> str:
    """A key a line; tables inline."""
    return "".join(f"{json.dumps(key)} = {_inline(value)}\n" for key, value in content.items())


def _inline(value) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_inline(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if isinstance(value, float):
        return {"Infinity": "inf", "-Infinity": "-inf", "NaN": "nan"}.get(json.dumps(value), repr(value))
    return '""' if value is None else json.dumps(value) if isinstance(value, (str, bool)) else str(value)
