"""Text on a terminal: names and cells from files must not steer it."""

from __future__ import annotations


def for_terminal(text: str) -> str:
    """Text whose lines are shown as they stand: what would steer a terminal, or turns a line about, becomes
    "?"."""
    return "".join(char if char.isprintable() or char in "\n\t" else "?" for char in text)
