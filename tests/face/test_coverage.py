"""The table of ``make coverage``: lines and branches added up by room.

Red when a file is counted for the wrong room, or not at all.
"""

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_files_are_added_up_by_room():
    table = runpy.run_path(str(ROOT / "tools" / "coverage_by_room.py"))["table"]
    keys = ("num_statements", "covered_lines", "num_branches", "covered_branches")
    files = {
        "focgen/plan/a.py": (10, 9, 4, 1),
        "focgen/plan/b.py": (30, 30, 0, 0),
        "focgen/cache.py": (5, 0, 0, 0),
    }
    made = table({path: {"summary": dict(zip(keys, counts))} for path, counts in files.items()}).splitlines()
    assert made[2:] == [
        "| files beside | 5 | 0.0 % | 0 | – |",
        "| plan | 40 | 97.5 % | 4 | 25.0 % |",
        "| all | 45 | 86.7 % | 4 | 25.0 % |",
    ]
