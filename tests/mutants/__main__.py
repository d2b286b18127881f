"""``python -m tests.mutants``: measure the tests once, then try changes; what was tried is kept."""

from __future__ import annotations

import argparse
import json
import shutil
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from tests.mutants.change import Change, read
from tests.mutants.known import Known, copy_to, known, measure
from tests.mutants.sample import ROOMS, all_changes, drawn
from tests.mutants.table import table
from tests.mutants.trying import Tried, restored, tried, warm

_UNTRIED = {"outcome": "survived", "patience": 0.0, "asked": []}


def main() -> None:
    asked = _asked()
    place, folder = asked.folder / "sources", asked.folder
    if asked.again or not (folder / "seen.jsonl").exists():
        measure(copy_to(place), folder)
        (folder / "tried.jsonl").unlink(missing_ok=True)
    if not asked.report:
        warm()
        for patience in asked.patience:
            _try_all(place, folder, asked, patience)
    weights = {room: len({(c.file, c.begin) for c in all_changes(place, room)}) for room in asked.rooms}
    text = table(_results(folder), weights)
    (folder / "table.md").write_text(text + "\n", encoding="utf-8")
    print(text)


def _asked() -> argparse.Namespace:
    given = argparse.ArgumentParser(prog="make mutants")
    given.add_argument("--count", type=int, default=320, help="changes in all, the rooms in turn")
    given.add_argument("--seed", type=int, default=1)
    given.add_argument("--rooms", nargs="+", default=list(ROOMS), choices=list(ROOMS))
    given.add_argument("--patience", type=float, nargs="+", default=[15.0, 60.0], metavar="SECONDS",
                       help="of tests that a change is worth; survivors are given the next")  # fmt: skip
    given.add_argument("--folder", type=Path, default=Path("build/mutants"), help="kept from run to run")
    given.add_argument("--again", action="store_true", help="measure the tests and begin anew")
    given.add_argument("--report", action="store_true", help="only print what was tried")
    asked = given.parse_args()
    asked.folder = asked.folder.resolve()
    return asked


def _results(folder: Path) -> list[dict]:
    """What was tried, each change as it stood last."""
    path = folder / "tried.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    return list({line["key"]: line for line in lines}.values())


def _try_all(place: Path, folder: Path, asked: argparse.Namespace, patience: float) -> None:
    """Every change of the sample that was not tried so long yet."""
    restored(place)
    tests, results = known(folder), {r["key"]: r for r in _results(folder)}
    killed = Counter((r["room"], r["by"]) for r in results.values() if r["outcome"] == "killed")
    for room, change in drawn(place, asked.seed, asked.count, tuple(asked.rooms)):
        before = results.get(change.key(read(place, change.file)), _UNTRIED)
        if before["outcome"] == "survived" and before["patience"] < patience:
            told = Counter({test: count for (where, test), count in killed.items() if where == room})
            line = {"room": room, **_tried(place, tests, told, change, before["asked"], patience)}
            killed[room, line["by"]] += line["outcome"] == "killed"
            with open(folder / "tried.jsonl", "a", encoding="utf-8") as out:
                out.write(json.dumps(line) + "\n")
            print(f"{line['outcome']:10} {line['seconds']:6.1f} s  {line['file']}:{line['line']}", flush=True)
    shutil.rmtree(place / "scratch", ignore_errors=True)


def _tried(
    place: Path, tests: Known, told: Counter[str], change: Change, asked: list[str], patience: float
) -> dict:
    """A change given to what was not ``asked`` of it before, and what came of it."""
    text = read(place, change.file)
    chosen = [t for t in tests.tests(change, text, told, patience) if t not in asked]
    most = 60.0 + 4.0 * sum(tests.seconds[t] for t in chosen)
    found = tried(place, change, chosen, most) if chosen or not asked else Tried("survived", 0.0)
    line = {"key": change.key(text), **asdict(change), "line": change.line(text), **asdict(found)}
    return {**line, "patience": patience, "asked": sorted({*asked, *chosen})}


if __name__ == "__main__":
    main()
