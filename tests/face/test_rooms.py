"""The way through the house: imports go down only, and a file's name tells its room.

Fails where a module imports from a room below its own in the table of docs/architecture.md, at its head or
within a function, by a statement or by a name in a string; where a room is missing in the table; where a
library that is an extra is needed to import a module; and where three rooms have a file of the same name.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

import focgen

ROOT = Path(focgen.__file__).parent
PAGE = (Path(__file__).parents[2] / "docs" / "architecture.md").read_text(encoding="utf-8")
ROOF = {"__init__", "__main__"}
EXTRAS = set(
    "matplotlib bokeh pandas control pyarrow nptdms h5py unicorn capstone elftools mujoco distributed".split()
)
SUBJECTS = ("cli", "report")  # a file for each command, a file for each result


def rows(heading: str) -> list[list[str]]:
    """The first cell of each row of the table under this heading, as names; rooms without their slash."""
    lines = PAGE.split(f"| {heading} |", 1)[1].splitlines()[2:]
    table = lines[: lines.index("")]
    return [[name.rstrip("/") for name in re.findall(r"`([^`]+)`", line.split("|")[1])] for line in table]


def floors(heading: str) -> dict[str, int]:
    return {name: floor for floor, names in enumerate(rows(heading)) for name in names}


FLOORS = floors("room")
SUBROOMS = floors("sub-room")
UP = set(re.findall(r"^\| `(\w+)` \| `(\w+)/` \|", PAGE, re.MULTILINE))


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def modules() -> dict[str, Path]:
    return {module_of(path): path for path in sorted(ROOT.rglob("*.py"))}


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(tree: ast.AST) -> set[str]:
    """The modules of the package that a file names: in imports at any depth, and in strings."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "focgen":
            found |= {f"focgen.{focgen._HOME.get(name.name, name.name)}" for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide where they lead"
            found |= {f"{node.module}.{name.name}" for name in node.names} | {str(node.module)}
        elif isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found |= {node.value}
    return found & modules().keys()


def room_of(module: str, depth: int) -> str:
    parts = module.split(".")
    return parts[depth] if len(parts) > depth else "__init__"


def climbs(module: str, path: Path) -> list[str]:
    """What a file imports from further down, at the level of rooms and of the diagnosis' sub-rooms."""
    found, here = [], room_of(module, 1)
    for other in imported(tree_of(path)):
        there = room_of(other, 1)
        if there in ROOF or here in ROOF or (here, there) in UP:
            continue
        if FLOORS[there] > FLOORS[here]:
            found.append(f"{module} imports {other}")
        if here == there == "diagnosis":
            inner, outer = room_of(module, 2), room_of(other, 2)
            if not {inner, outer} & ROOF and SUBROOMS[outer] > SUBROOMS[inner]:
                found.append(f"{module} imports {other}")
    return found


def test_imports_go_down_only():
    assert [climb for module, path in modules().items() for climb in climbs(module, path)] == []


TEXTS = (
    "from focgen.report.page import Page",
    "def f():\n    import focgen.report.page",
    "from focgen import report",
    "from importlib import import_module\nimport_module('focgen.report.page')",
)


def test_a_climb_is_seen(tmp_path):
    """At a file's head, within a function, through the package's own face, and by a name in a string."""
    for count, text in enumerate(TEXTS):
        (tmp_path / f"{count}.py").write_text(text)
        assert climbs("focgen.diagnosis.write", tmp_path / f"{count}.py"), text
    (tmp_path / "one.py").write_text("from focgen.diagnosis.verdict.floor import floor")
    assert climbs("focgen.diagnosis.fitting.fit", tmp_path / "one.py")
    assert not climbs("focgen.diagnosis.verdict.where", tmp_path / "one.py")


def test_every_room_is_in_the_table():
    rooms = {room_of(module, 1) for module in modules()} - ROOF
    assert rooms == set(FLOORS), rooms ^ set(FLOORS)
    inner = {room_of(module, 2) for module in modules() if module.startswith("focgen.diagnosis.")}
    assert inner == set(SUBROOMS), inner ^ set(SUBROOMS)


def test_no_extra_is_needed_to_import():
    """Statements at a file's head; what a type checker alone reads stands in a block of its own."""
    for path in modules().values():
        if path.is_relative_to(ROOT / "trials" / "engine"):
            continue  # a simulator of its own, which is loaded where it is asked for
        for node in tree_of(path).body:
            names = [name.name for name in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            assert not EXTRAS & {name.split(".")[0] for name in names}, path


def test_no_three_rooms_have_a_file_of_the_same_name():
    rooms = defaultdict(set)
    for module, path in modules().items():
        room = room_of(module, 1)
        if room not in SUBJECTS and path.stem not in ROOF:
            rooms[path.stem].add(room)
    assert {name: where for name, where in rooms.items() if len(where) > 2} == {}
