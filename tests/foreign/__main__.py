"""What the diagnosis says of foreign rigs: a line a case, then a table. ``--sets CBA --seeds N --exact``."""

from __future__ import annotations

import argparse
import json
import sys
import time

from tests.foreign.cases import SETS, SEVERITIES
from tests.foreign.forms import MAKE
from tests.foreign.judge import Judged, judged, table


def main() -> None:
    """Judge every family, and as many sound rigs as ``--sound``, in each set."""
    parser = argparse.ArgumentParser(prog="tests.foreign", description=__doc__)
    parser.add_argument("--sets", default="".join(SETS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--sound", type=int, default=4)
    parser.add_argument("--exact", action="store_true")
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    names = [n for n in MAKE if not asked.only or n in asked.only.split(",")]
    todo = [(n, SEVERITIES[(i + asked.seed) % 3]) for i, n in enumerate(names)]
    todo += [(None, 0.0)] * (0 if asked.only else asked.sound)
    found: list[Judged] = []
    for signals in asked.sets:
        for i, (truth, severity) in enumerate(todo):
            began = time.monotonic()
            one = judged(1000 * asked.seed + i, signals, truth, severity, asked.exact)
            found.append(one)
            print(json.dumps({**one.__dict__, "s": round(time.monotonic() - began, 1)}), flush=True)
    print(table(found), file=sys.stderr)


if __name__ == "__main__":
    main()
