"""What a run under coverage has seen, by room: ``make coverage`` prints it as a table of Markdown."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

_KEYS = ("num_statements", "covered_lines", "num_branches", "covered_branches")


def rooms(files: dict[str, dict]) -> dict[str, list[int]]:
    """Statements and branches, there and run, by room; "files beside" are those in none."""
    found: dict[str, list[int]] = defaultdict(lambda: [0] * len(_KEYS))
    for path, file in files.items():
        parts = Path(path).parts[1:]
        room = parts[0] if len(parts) > 1 else "files beside"
        found[room] = [a + file["summary"][key] for a, key in zip(found[room], _KEYS)]
    return dict(sorted(found.items()))


def table(files: dict[str, dict]) -> str:
    """Markdown."""
    counts = rooms(files)
    counts["all"] = [sum(column) for column in zip(*counts.values())]
    lines = ["| room | lines | run | branches | run |", "|---|---|---|---|---|"]
    for room, (lines_there, lines_run, there, run) in counts.items():
        shares = _share(lines_run, lines_there), _share(run, there)
        lines.append(f"| {room} | {lines_there} | {shares[0]} | {there} | {shares[1]} |")
    return "\n".join(lines)


def _share(run: int, there: int) -> str:
    return f"{100.0 * run / there:.1f} %" if there else "–"


def main() -> None:
    target = Path("build/coverage.json")
    subprocess.run([sys.executable, "-m", "coverage", "json", "-q", "-o", str(target)], check=True)
    print(table(json.loads(target.read_text(encoding="utf-8"))["files"]))


if __name__ == "__main__":
    main()
