"""A user's text in generated files: comment, string, format, Markdown and XML have each their rule.

A name or a unit stands in :class:`UserText` until it is printed. That has no form of its own: a template that
prints it says by a filter (``comment``, ``string``, ``printf``, ``markdown``, ``xml``) where it stands, or
fails.
Names in C have no rule of escaping; :func:`focgen.codegen.names.check_name` refuses what cannot be one.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from xml.sax.saxutils import escape

_REPLACED = {"µ": "u", "μ": "u", "°": "deg ", "Ω": "Ohm", "²": "^2", "³": "^3", "·": " ", "–": "-", "ü": "ue"}
_ESCAPED = {'"': '\\"', "\\": "\\\\", "?": "\\?"}  # the last would begin a trigraph
_MARKUP = re.compile(r"([\\`*_\[\]<>|$&~])")


@dataclass(frozen=True)
class UserText:
    """Text from a file or an argument, in no form yet. Empty text is false."""

    text: str

    def __bool__(self) -> bool:
        return bool(self.text)

    def __str__(self) -> str:
        raise TypeError("a user's text is printed through a filter that says where it stands")


def comment(text: str | UserText) -> str:
    """Text that is safe within a C comment: ASCII, one line, no trigraph and no end of the comment in it."""
    text = _of(text)
    for found, instead in _REPLACED.items():
        text = text.replace(found, instead)
    plain = re.sub(r"[^ -~]", "?", _line(text)).replace("\\", "/")
    return _line(re.sub(r"\?+", "?", plain).replace("*/", "* /").replace("/*", "/ *"))


def string(text: str | UserText) -> str:
    """Text between the quotes of a C string, on one line: what is not ASCII as the bytes of its UTF-8."""
    return "".join(_ESCAPED.get(char, char) if char.isascii() else _octal(char) for char in shown(text))


def printf(text: str | UserText) -> str:
    """Text within a format of printf, which prints it as :func:`string` would."""
    return string(text).replace("%", "%%")


def markdown(text: str | UserText) -> str:
    """Text within a line or a cell of a table in Markdown, which shows it as it is."""
    return _MARKUP.sub(r"\\\1", shown(text))


def xml(text: str | UserText) -> str:
    """Text between the quotes of an attribute in XML."""
    return escape(shown(text), {'"': "&quot;"})


def _of(text: str | UserText) -> str:
    return text.text if isinstance(text, UserText) else text


def _line(text: str) -> str:
    return " ".join(text.split())


def shown(text: str | UserText) -> str:
    """One line without control characters: what cannot be seen, or turns the line about, becomes "?"."""
    return "".join(char if char.isprintable() else "?" for char in _line(_of(text)))


def _octal(char: str) -> str:
    return "".join(f"\\{byte:03o}" for byte in char.encode("utf-8"))
