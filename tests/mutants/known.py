"""What is known of the tests: which of them run a line, which read a template, how long each takes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from tests.mutants.change import Change
from tests.mutants.of_python import lines_of

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("focgen", "templates", "c_runtime", "tests", "examples", "docs", "tools")
"""What a scratch copy holds, besides the files of the root."""
ASKED = (
    "fractional", "plan", "codegen", "verification", "control", "running", "targets", "testing", "equality",
)  # fmt: skip
"""Folders of tests that are measured: those of the rooms, and of what runs their C."""
ASIDE = ("golden", "same_bytes", "mutants", "docs", "distribution", "misra", "lto", "twin_headers")
"""Tests that tell of any change, a right one as well, or of none in what is computed: they do not judge."""
_START = 0.3
"""Seconds that are counted for each test beside its own: what opens its file, and chance."""


@dataclass(frozen=True)
class Known:
    """``seconds`` of each test, by its name; ``runs``: file, then line, then tests; ``reads`` likewise for
    files as a whole."""

    seconds: dict[str, float]
    runs: dict[str, dict[int, list[str]]]
    reads: dict[str, list[str]]

    def tests(self, change: Change, text: str, killed: Counter[str], patience: float) -> list[str]:
        """Those that could tell of a change, the best first, as many as ``patience`` (seconds) allows.

        ``killed``: how many changes of the same room each test has told of already.
        """
        if change.file.endswith(".py"):
            lines = self.runs.get(change.file, {})
            found = {t for line in lines_of(text, change.line(text)) for t in lines.get(line, ())}
            if not found:  # run when it is imported, by whoever imports it
                found = {t for tests in lines.values() for t in tests}
        else:
            found = set(self.reads.get(change.file, ()))
        chosen, spent = [], 0.0
        for test in self._in_turn(found, killed):
            if not chosen or spent + self.seconds[test] <= patience:
                chosen.append(test)
                spent += self.seconds[test]
        return chosen

    def _in_turn(self, tests: Iterable[str], killed: Counter[str]) -> Iterator[str]:
        """The best test of each file, the best file first, then the second of each …: a file tells of what
        the others do not look at. Best is what has told of most, a second that it takes; one that has told of
        nothing yet counts as if it had told of one."""

        def worth(told: int, test: str) -> tuple[float, str]:
            return -(1.0 + told) / (_START + self.seconds[test]), test

        files: dict[str, list[str]] = {}
        for test in sorted(tests, key=lambda t: worth(killed[t], t)):
            files.setdefault(test.split("::")[0], []).append(test)
        of_file = Counter({name: sum(killed[t] for t in own) for name, own in files.items()})
        ordered = sorted(files.items(), key=lambda one: worth(of_file[one[0]], one[1][0]))
        return (test for turn in zip_longest(*(own for _, own in ordered)) for test in turn if test)


def copy_to(place: Path) -> Path:
    """The sources and their tests in a folder of their own, whole and new."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for name in COPIED:
        shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("__pycache__", "build"))
    for path in ROOT.iterdir():
        if path.is_file() and not path.name.startswith("."):
            shutil.copy(path, place)
    subprocess.run([sys.executable, "-m", "compileall", "-q", "focgen", "tests"], cwd=place, check=False)
    return place


def measure(place: Path, folder: Path) -> None:
    """Run the tests of a copy once, under coverage, and write to ``folder`` what they run and read."""
    folder.mkdir(parents=True, exist_ok=True)
    seen, data = folder / "seen.jsonl", folder / ".coverage"
    for path in (seen, data):
        path.unlink(missing_ok=True)
    options = ["--branch", "--source=focgen", f"--data-file={data}"]
    unwanted = " and ".join(f"not {name}" for name in ASIDE)
    command = ["coverage", "run", *options, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", unwanted]
    command += [f"tests/{folder}" for folder in ASKED]
    env = {**os.environ, "FOCGEN_SEEN": str(seen), "PYTHONPATH": f"{place}{os.pathsep}{_path()}"}
    subprocess.run(
        [sys.executable, "-m", *command, "-p", "tests.mutants.seen"], cwd=place, env=env, check=False
    )


def _aside(test: str) -> bool:
    return any(name in test.split("::", maxsplit=1)[0] for name in ASIDE)


def _path() -> str:
    return os.environ.get("PYTHONPATH", "")


def known(folder: Path) -> Known:
    """Read what :func:`measure` has written."""
    from coverage import CoverageData

    told = [json.loads(line) for line in (folder / "seen.jsonl").read_text().splitlines()]
    told = [t for t in told if not t.get("failed") and not _aside(t["test"])]
    seconds, reads = {t["test"]: t["seconds"] for t in told}, {}
    for t in told:
        for file in t["files"]:
            reads.setdefault(file, []).append(t["test"])
    data = CoverageData(str(folder / ".coverage"))
    data.read()
    runs: dict[str, dict[int, list[str]]] = {}
    for path in data.measured_files():
        file = path[path.rfind("/focgen/") + 1 :]
        lines = data.contexts_by_lineno(path)
        runs[file] = {line: [t for t in tests if t in seconds] for line, tests in lines.items()}
    return Known(seconds, runs, reads)
