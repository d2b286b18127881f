"""How long the functions and files of a package are, and how complex: ``python tools/house.py [FOLDER …]``.

A row a folder: lines of functions, docstrings included, and their cyclomatic complexity, each as median /
ninth decile / largest; the longest file; what mypy --strict finds (with ``--types``; it takes half a
minute). With ``--most N`` also the N longest functions, the N most complex ones and the N longest files.
Complexity is McCabe's: one, and one more for each branch, loop, handler, comprehension, its conditions,
case and ``and`` or ``or``. A nested function counts by itself, and its lines also in the one around it.
"""

from __future__ import annotations

import argparse
import ast
import re
import statistics
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

_FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)
_BRANCH = (ast.If, ast.IfExp, ast.For, ast.AsyncFor, ast.While, ast.ExceptHandler, ast.match_case)
HEAD = ("", "function length", "complexity", "longest file", "mypy --strict")


@dataclass(frozen=True)
class Function:
    """``where``: file, line and name; ``length`` in lines from ``def`` to its last one."""

    where: str
    length: int
    complexity: int


def functions(file: Path) -> Iterator[Function]:
    """Those of a file, methods and nested ones among them."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, _FUNCTION):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            yield Function(f"{file}:{node.lineno} {node.name}", length, 1 + sum(map(_decisions, _own(node))))


def _own(function: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a function without those of functions inside it."""
    for child in ast.iter_child_nodes(function):
        if not isinstance(child, _FUNCTION):
            yield child
            yield from _own(child)


def _decisions(node: ast.AST) -> int:
    """How many ways a node adds."""
    if isinstance(node, ast.BoolOp):
        return len(node.values) - 1
    if isinstance(node, ast.comprehension):
        return 1 + len(node.ifs)
    return int(isinstance(node, _BRANCH))


def sizes(folder: Path) -> tuple[list[Function], dict[Path, int]]:
    """The functions of a folder, and its files with their numbers of lines."""
    files = sorted(folder.rglob("*.py"))
    lines = {file: len(file.read_text(encoding="utf-8").splitlines()) for file in files}
    return [function for file in files for function in functions(file)], lines


def spread(values: Sequence[int]) -> str:
    """Median / ninth decile / largest."""
    tenths = statistics.quantiles(values, n=10, method="inclusive")
    return f"{statistics.median(values):.0f} / {tenths[-1]:.0f} / {max(values)}"


def strict_errors(folder: Path) -> str:
    """How many errors mypy --strict finds in a folder, by its own defaults."""
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", "", "--ignore-missing-imports"]
    done = subprocess.run([*command, str(folder)], capture_output=True, text=True)
    found = re.search(r"Found (\d+) error", done.stdout)
    return found.group(1) if found else "0" if done.returncode == 0 else "not run"


def row(folder: Path, types: bool) -> tuple[str, ...]:
    """The folder's row of the table."""
    found, lines = sizes(folder)
    shown = (spread([f.length for f in found]), spread([f.complexity for f in found]))
    return (folder.name, *shown, str(max(lines.values())), strict_errors(folder) if types else "–")


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table, and on request what is largest."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", metavar="FOLDER", nargs="*", type=Path, default=[Path("focgen")])
    parser.add_argument("--types", action="store_true", help="count the errors of mypy --strict, too")
    parser.add_argument("--most", type=int, default=0, metavar="N", help="list what is largest")
    asked = parser.parse_args(argv)
    rows = [HEAD, ("---",) * len(HEAD), *(row(folder, asked.types) for folder in asked.folders)]
    print("\n".join("| " + " | ".join(cells) + " |" for cells in rows))
    for folder in asked.folders if asked.most else ():
        found, lines = sizes(folder)
        for what in ("length", "complexity"):
            most = sorted(found, key=lambda f: -getattr(f, what))[: asked.most]
            print(f"\n{what}:", *(f"{getattr(f, what):5d}  {f.where}" for f in most), sep="\n")
        print(
            "\nlines:",
            *(f"{n:5d}  {f}" for f, n in sorted(lines.items(), key=lambda x: -x[1])[: asked.most]),
            sep="\n",
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
