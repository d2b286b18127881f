"""A small change of one file of the sources."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Change:
    """``old`` at ``begin`` (characters from the file's start) becomes ``new``; ``kind`` says what that is."""

    file: str
    begin: int
    old: str
    new: str
    kind: str

    def applied(self, text: str) -> str:
        """The file's text with the change in it."""
        assert text[self.begin :].startswith(self.old), f"{self.file} is not the file of this change"
        return text[: self.begin] + self.new + text[self.begin + len(self.old) :]

    def line(self, text: str) -> int:
        """The line that it begins in, from 1."""
        return text.count("\n", 0, self.begin) + 1

    def key(self, text: str) -> str:
        """A name that stays while nothing of the line changes: it holds no number of a line, but how many
        like it come before."""
        lines = text.splitlines()
        here = self.line(text) - 1
        column = self.begin - (text.rfind("\n", 0, self.begin) + 1)
        about = "\0".join([self.file, lines[here], str(column), self.old, self.new])
        before = lines[:here].count(lines[here])
        about += f"\0{before}" if before else ""
        return hashlib.sha256(about.encode()).hexdigest()[:12]


def read(root: Path, file: str) -> str:
    """A file of the sources."""
    return (root / file).read_text(encoding="utf-8")
