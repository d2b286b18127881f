"""Reading TOML with every value checked, so that a fault names its file, table and key."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sized
from contextlib import suppress
from pathlib import Path
from typing import Any, overload

from focgen.errors import InputError
from focgen.textfile import LARGEST_SETTING, read_regular

SMALLEST, LARGEST = 1e-60, 1e60
"""The size of a number in a file of TOML, but for 0."""
MOST_ORDER = 20.0
"""The size of an order of s: powers of what is fast in a slow rig stay numbers."""
MOST_TERMS = 256
"""Terms of a transfer function, and coefficients of a polynomial: work grows with their square."""
_SIZES = f"of a size from {SMALLEST:g} to {LARGEST:g}, or 0"
_NONE = "not a finite number, or too small or too large"


_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_DEEP = re.compile(rf"(?:^|[{{,\[])[ \t]*(?:{_PART}[ \t]*\.[ \t]*){{32}}", re.MULTILINE)
"""A key of more tables in tables than any file here has: a parser takes them apart in the square of their
number."""


def parsed(text: str) -> dict[str, Any]:
    """The content of TOML, behind the mark that some editors put ahead of UTF-8. Raises TOMLDecodeError for
    what is none, ValueError for digits without end, and RecursionError for what is nested too deeply."""
    if _DEEP.search(text):
        raise RecursionError
    return tomllib.loads(text.removeprefix("\ufeff"))


def check_replaced(path: str | Path, what: str, has: Iterable[str], lacks: Iterable[str] = ()) -> None:
    """Raise InputError, before work begins, where a result would take the place of a file that is no
    ``what``: a table with all the keys that it ``has`` and none that it ``lacks``. An empty file is nobody's.
    """
    place = Path(path)
    if place.is_file() and place.stat().st_size and not has_keys(place, has, lacks):
        raise InputError(
            str(path), f"is no {what}, and would be replaced by one", "name another --out, or move it away"
        )


def has_keys(path: Path, has: Iterable[str], lacks: Iterable[str] = ()) -> bool:
    """Whether a file is TOML with all the keys that it ``has`` and none that it ``lacks``."""
    found: dict[str, Any] = {}
    with suppress(OSError, ValueError, RecursionError, InputError):  # no TOML: none of ours
        found = parsed(read_regular(path, LARGEST_SETTING).decode("utf-8"))
    return found.keys() >= set(has) and not found.keys() & set(lacks)


class Table:
    """A TOML table that knows where it stands and which error its faults raise.

    Every ``get`` marks its key as known; :meth:`done` refuses what is left over.
    """

    def __init__(self, values: Mapping[str, Any], where: str, error: type[InputError]) -> None:
        self.values, self.where, self.error = values, where, error
        self._known: set[str] = set()

    @classmethod
    def read(cls, path: str | Path, error: type[InputError]) -> Table:
        """Read a file. Raises ``error`` where it is missing or is not TOML."""
        try:
            text = read_regular(path, LARGEST_SETTING, error).decode("utf-8")
            return cls(parsed(text.replace("\r\n", "\n")), str(path), error)
        except OSError as reason:
            raise error(str(path), f"cannot be read ({reason.strerror})", "check the path") from None
        except UnicodeDecodeError:
            raise error(str(path), "is not UTF-8 text", "save it as UTF-8") from None
        except tomllib.TOMLDecodeError as reason:
            fault = str(reason).replace("\n", " ")
            raise error(str(path), f"is not TOML: {fault}", "correct the syntax") from None
        except RecursionError:
            raise error(str(path), "is nested too deeply", "write it flatter") from None
        except ValueError:  # of a path with a null character, and of digits without end
            raise error(str(path), "has a number of too many digits, or is no path", "correct it") from None

    def fail(self, key: str | None, what: str, remedy: str) -> InputError:
        """Return (not raise) the error for a fault at ``key``."""
        place = self.where if key is None else f"{self.where} [{key}]"
        return self.error(place, what, remedy)

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def raw(self, key: str, default: Any = None) -> Any:
        """The value as read, unchecked."""
        self._known.add(key)
        return self.values.get(key, default)

    def required(self, key: str) -> Any:
        """The value as read; raises where it is absent."""
        if key not in self.values:
            raise self.fail(None, f"lacks {key!r}", f"add {key!r}")
        return self.raw(key)

    @overload
    def text(self, key: str, default: str) -> str: ...

    @overload
    def text(self, key: str, default: None = None) -> str | None: ...

    def text(self, key: str, default: str | None = None) -> str | None:
        """A string, or ``default`` where absent."""
        value = self.raw(key, default)
        if key not in self:
            return default
        if not isinstance(value, str):
            raise self.fail(key, f"is {value!r}, not text", "put it in quotes")
        if not is_written(value):
            raise self.fail(key, f"is {value!r}, half a character", "give text that can be written as UTF-8")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """A truth value, or ``default`` where absent."""
        value = self.raw(key, default)
        if not isinstance(value, bool):
            raise self.fail(key, f"is {value!r}", "write true or false")
        return value

    def number(self, key: str, default: float | None = None, *, above: float = -math.inf) -> float:
        """A finite number > ``above``; required where ``default`` is None."""
        value = self.required(key) if default is None else self.raw(key, default)
        if not _is_number(value):
            raise self.fail(key, f"is {value!r}, {_NONE}", f"give a number {_SIZES}")
        if value <= above:
            raise self.fail(key, f"is {value:g}", f"give a number above {above:g}")
        return float(value)

    def numbers(self, key: str) -> tuple[float, ...]:
        """A non-empty list of finite numbers."""
        value = self.required(key)
        if not isinstance(value, list) or not value or not all(map(_is_number, value)):
            raise self.fail(key, f"is {value!r}", f"give a list of finite numbers {_SIZES}")
        return tuple(map(float, value))

    def span(self, key: str) -> tuple[float, float] | None:
        """A pair [low, high] with low < high, or None where absent."""
        if key not in self.values:
            return None
        pair = self.numbers(key)
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise self.fail(key, f"is {list(pair)}", "give [low, high] with low < high")
        return pair[0], pair[1]

    def terms(self, key: str, default: list[Any] | None = None) -> list[tuple[float, float]]:
        """Pairs of a coefficient and an order of s; ``default`` where they are absent and may be."""
        value = self.required(key) if default is None else self.raw(key, default)
        right = (
            isinstance(value, list)
            and value
            and all(isinstance(t, list) and len(t) == 2 and all(map(_is_number, t)) for t in value)
        )
        if not right:
            raise self.fail(key, f"is {value!r}", "give a list of [coefficient, order of s] terms")
        self.check_count(key, value)
        highest = max((order for _, order in value), key=abs)
        if abs(highest) > MOST_ORDER:
            what = f"has the order {highest:g}"
            raise self.fail(key, what, f"give orders from {-MOST_ORDER:g} to {MOST_ORDER:g}")
        return [(float(c), float(o)) for c, o in value]

    def check_count(self, key: str, values: Sized) -> None:
        """Raise for more terms than :data:`MOST_TERMS`."""
        if len(values) > MOST_TERMS:
            raise self.fail(key, f"has {len(values)} terms", f"give at most {MOST_TERMS}")

    def table(self, key: str) -> Table | None:
        """A sub-table, or None where absent."""
        value = self.raw(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            raise self.fail(key, f"is {value!r}, not a table", f"write it as [{key}]")
        return Table(value, f"{self.where} [{key}]", self.error)

    def section(self, key: str, remedy: str) -> Table:
        """A sub-table; raises with ``remedy`` where it is absent."""
        table = self.table(key)
        if table is None:
            raise self.fail(None, f"lacks the table [{key}]", remedy)
        return table

    def done(self) -> None:
        """Raise for keys that nothing asked for: a misspelt key must not be a silent default."""
        unknown = sorted(set(self.values) - self._known)
        if unknown:
            known = ", ".join(sorted(self._known))
            raise self.fail(None, f"has the unknown key {unknown[0]!r}", f"known here: {known}")


def is_written(text: str) -> bool:
    """Whether a text is one of UTF-8: Python's own may hold halves of characters, which no file can."""
    return not any("\ud800" <= character <= "\udfff" for character in text)


def _is_number(value: Any) -> bool:
    """Whether a value is a number that can be computed with: powers and products of larger ones overflow, and
    what is divided by smaller ones."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return value == 0 or SMALLEST <= abs(value) <= LARGEST
