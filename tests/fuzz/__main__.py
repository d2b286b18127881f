"""``make fuzz-inputs``: led mutations of all that is read, for as long as is asked; a table of what was
run."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from tests.fuzz import corpus
from tests.fuzz.campaign import supervised
from tests.fuzz.groups import GROUPS

_PARTS = {"inputs": 0.5, "readers": 0.25, "commands": 0.25}  # of the time


def main() -> int:
    """Run, say how many, and exit 1 where anything was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument(
        "--turn", type=float, default=900.0, help="s that a group runs before the next one does"
    )
    parser.add_argument("--only", nargs="+", choices=[g.name for g in GROUPS])
    parser.add_argument("--folder", type=Path, default=Path("build/fuzz"))
    parser.add_argument(
        "--keep", action="store_true", help="write the corpus, minimised, to tests/fuzz/corpus"
    )
    args = parser.parse_args()
    groups = [g for g in GROUPS if not args.only or g.name in args.only]
    if args.keep:
        return corpus.keep(groups, args.folder)
    left, known = args.seconds, corpus.known()
    while left > 1.0:
        for group in groups:
            part = _PARTS[group.name] / sum(_PARTS[g.name] for g in groups)
            supervised(group, args.folder, part * min(left, args.turn), known)
        left -= args.turn
    return told(args.folder)


def told(folder: Path) -> int:
    """Print the table of all runs in a folder; 1 where anything was found."""
    counts = json.loads((folder / "counts.json").read_text())
    print("| input | run | taken | in the corpus |\n|---|---|---|---|")
    for group in GROUPS:
        for target in group.targets:
            one = counts.get(target.name, {"inputs": 0, "taken": 0})
            kept = folder / "corpus" / target.name
            size = len(list(kept.iterdir())) if kept.is_dir() else 0
            print(f"| {target.name} | {one['inputs']} | {one['taken']} | {size} |")
        run = sum(counts.get(target.name, {"inputs": 0})["inputs"] for target in group.targets)
        print(f"| **{group.name}** | {run} | | |")
    found = sorted((folder / "found").glob("*.txt")) if (folder / "found").is_dir() else []
    for path in found:
        print(f"{path.with_suffix('.bin')}: {path.read_text().strip().splitlines()[-1]}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
