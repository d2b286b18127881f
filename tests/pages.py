"""The pages of the documentation as something to run: their blocks, in order, in a folder of their own."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?$")
# A fit may differ in its last digits from one processor to the next; what a page shows is rounded.
AGREES = 0.02


@dataclass(frozen=True)
class Block:
    """One fenced block of a page: its language, its text, and the line of the page that it begins in."""

    page: Path
    line: int
    language: str
    text: str


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    found = re.finditer(r"^```([a-z]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [Block(page, text[: m.start()].count("\n") + 1, m.group(1), m.group(2)) for m in found]


def run_page(page: Path, folder: Path) -> int:
    """Run the page's shell blocks in ``folder`` and hold each ``text`` block to what was printed.

    Returns how many commands were run. AssertionError names the line of the page.
    """
    said, count = "", 0
    for block in blocks(page):
        if block.language == "sh":
            said, ran = run_shell(block, folder)
            count += ran
        elif block.language == "text":
            check_shown(block, said)
    return count


def run_shell(block: Block, folder: Path) -> tuple[str, int]:
    """What the commands print, and how many were run; what sets up a machine is only checked to exist."""
    said, count = "", 0
    for line in block.text.replace("\\\n", " ").splitlines():
        command = shlex.split(line, comments=True)
        if command and not is_elsewhere(command):
            done = subprocess.run(as_here(line), shell=True, cwd=folder, env=_environment(folder), text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)  # fmt: skip
            assert done.returncode == 0, f"{block.page.name}:{block.line}: {line}\n{done.stdout}"
            said, count = said + done.stdout, count + 1
    return said, count


def as_here(line: str) -> str:
    """The line with this interpreter and this copy of the package in place of the installed command."""
    return re.sub(r"^\s*(focgen|pytest)\b", rf"{shlex.quote(sys.executable)} -m \1", line)


def is_elsewhere(command: list[str]) -> bool:
    """Whether a command sets up a machine: its extra or its target must exist, and it is not run."""
    if command[0] == "pip":
        extras = {
            name for word in command for part in re.findall(r"\[(.*)\]", word) for name in part.split(",")
        }
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        assert extras <= set(project["optional-dependencies"]), extras
    elif command[0] == "make":
        targets = re.findall(
            r"^([a-z-]+(?: [a-z-]+)*):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE
        )
        assert command[1] in {name for names in targets for name in names.split()}, command
    return command[0] in ("pip", "make", "apt-get")


def _environment(folder: Path) -> dict[str, str]:
    tools = Path(sys.executable).parent  # of Python packages
    return {
        **os.environ,
        "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "COLUMNS": "400",
        "OMP_NUM_THREADS": "1",
    }


def check_shown(block: Block, said: str) -> None:
    """Each line that the page shows was printed, numbers within two parts in a hundred."""
    printed = [line.split() for line in said.splitlines()]
    for line in filter(None, (line.split() for line in block.text.splitlines())):
        where = f"{block.page.name}:{block.line}: not printed: {' '.join(line)}\n{said}"
        assert any(_holds(line, words) for words in printed), where


def _holds(shown: list[str], printed: list[str]) -> bool:
    starts = range(len(printed) - len(shown) + 1)
    return any(all(map(_same, shown, printed[start : start + len(shown)])) for start in starts)


def _same(shown: str, printed: str) -> bool:
    one, other = shown.strip(",;:()%"), printed.strip(",;:()%")
    if NUMBER.match(one) and NUMBER.match(other):
        return abs(float(one) - float(other)) <= AGREES * abs(float(one))
    return shown.strip(",.;:") == printed.strip(",.;:")
