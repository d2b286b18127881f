"""Sentences: what a page, a help text or a message says, split so that their lengths can be counted.

A paragraph, an item of a list, a cell of a table and a heading are units: no sentence reaches across them.
Blocks of code, formulas on lines of their own and pictures are not prose. A piece of code in a line is one
word, and a link is the words that it shows.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

LONGEST = 35  # words of a sentence
_FENCED = re.compile(r"^(```|~~~).*?^\1$", re.MULTILINE | re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_LINK = re.compile(r"!?\[((?:[^\[\]]|\[[^\]]*\])*)\]\([^)]*\)")
_CODE = re.compile(r"``.*?``|`[^`]*`")
_RULE = re.compile(r"^\|[\s:|-]+\|$")
_ITEM = re.compile(r"^\s*(?:[-*]|\d+\.)\s+")
_BLANK = re.compile(r"\n\s*\n")
# A full stop after these ends no sentence.
_SHORT = re.compile(r"\b(?:e\.g|i\.e|[Ee]qs?|[Ff]igs?|vs|cf|approx|resp|al|incl|max|min)\.$")
_END = re.compile(r"[.!?…][)\"'”*]*\s+(?=[\"'“(*]*(?:[A-Z0-9]|--\w|``))")
# Only a string that reaches over lines, joined or in triple quotes, has room for a sentence too long.
_LONG_STRING = re.compile(r'["\'] *\n\s*[rbf]*["\']|[=(,\[{] *\n? *[rbf]*"""')
_DEFINITION = (ast.FunctionDef, ast.ClassDef)
_COMMAND = re.compile(r"^\s*(?:examples?:|focgen\b|--)")


@dataclass(frozen=True)
class Sentence:
    """One sentence, and where it stands: a file and the line that its unit begins in."""

    where: str
    text: str

    @property
    def words(self) -> int:
        """How many words it has; punctuation and operators that stand alone are none."""
        return sum(any(map(str.isalnum, word)) for word in self.text.split())

    def __str__(self) -> str:
        return f"{self.where}: {self.words} words: {self.text}"


def too_long(sentences: Iterable[Sentence]) -> list[str]:
    """Those with more than 35 words, to be read in a message."""
    return [str(one) for one in sentences if one.words > LONGEST]


def split(text: str, where: str) -> Iterator[Sentence]:
    """The sentences of one unit: a paragraph, a cell, an item."""
    text = " ".join(_LINK.sub(r"\1", _CODE.sub("Code", text)).replace("**", "").split())
    begin = 0
    for end in _END.finditer(text):
        if not _SHORT.search(text[: end.start() + 1]):
            yield Sentence(where, text[begin : end.end()].strip())
            begin = end.end()
    if text[begin:].strip():
        yield Sentence(where, text[begin:].strip())


def of_page(text: str, name: str) -> Iterator[Sentence]:
    """The sentences of a page in Markdown."""
    for line, unit in _units(text):
        yield from split(unit, f"{name}:{line}")


def of_docstrings(text: str, names: Collection[str]) -> Iterator[Sentence]:
    """The sentences of the docstrings of what a Python file defines under these names, methods included."""
    for thing in ast.parse(text).body:
        if isinstance(thing, _DEFINITION) and thing.name in names:
            parts = [thing, *(part for part in thing.body if isinstance(part, _DEFINITION))]
            for part in parts:
                for paragraph in _BLANK.split(ast.get_docstring(part) or ""):
                    yield from split(paragraph, f"{thing.name}:{part.lineno}")


def of_source(text: str, name: str) -> Iterator[Sentence]:
    """The sentences of a Python file's strings: helps, messages, pages. Docstrings, lists of words and C are
    none; a value that is filled in is one word; examples of commands do not count.
    """
    if not _LONG_STRING.search(text):
        return
    tree = ast.parse(text)
    silent = {id(part) for node in ast.walk(tree) for part in _silent(node)}
    for node in ast.walk(tree):
        said = None if id(node) in silent else _said(node)
        if said and said.count(" ") >= LONGEST and not re.search(r";$", said, re.MULTILINE):
            prose = "\n".join("" if _COMMAND.match(line) else line for line in said.splitlines())
            for part in _BLANK.split(prose):
                yield from split(part, f"{name}:{node.lineno}")


def _said(node: ast.AST) -> str | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(v.value) if isinstance(v, ast.Constant) else "value" for v in node.values)
    return None


def _silent(node: ast.AST) -> list[ast.AST]:
    """The strings below a node that are no texts of their own."""
    if isinstance(node, ast.JoinedStr):
        return list(node.values)
    if isinstance(node, ast.Attribute) and node.attr == "split":
        return [node.value]
    return [node.value] if isinstance(node, ast.Expr) else []


def _units(text: str) -> Iterator[tuple[int, str]]:
    """The units of a page, each with the number of its first line."""
    for unread in (_FENCED, _COMMENT):
        text = unread.sub(lambda found: "\n" * found.group().count("\n"), text)
    begin, unit = 0, []
    for number, line in enumerate([*text.splitlines(), ""], start=1):
        bare = line.strip().removeprefix(">").strip()
        formula = line.startswith("    ") and not unit
        if unit and (not bare or bare[0] in "|#" or _ITEM.match(line)):
            yield begin, " ".join(unit)
            unit = []
        if bare.startswith("|"):
            cells = [] if _RULE.match(bare) else re.split(r"(?<!\\)\|", bare.strip("|"))
            yield from ((number, cell) for cell in cells)
        elif bare.startswith("#"):
            yield number, bare.lstrip("# ")
        elif bare and not formula:
            begin = begin if unit else number
            unit.append(_ITEM.sub("", bare).strip())


def pages(root: Path) -> list[Path]:
    """Every page of the project in Markdown."""
    return sorted(page for part in ("*.md", "docs/**/*.md", "examples/**/*.md") for page in root.glob(part))
