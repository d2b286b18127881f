"""``python -m tests.trust --seconds S --runs N``: the campaign and its table. Exit 1 where one fails."""

from __future__ import annotations

import argparse
import sys

from focgen.control.controller import ARITHMETICS
from focgen.verification.subprocess_call import in_subprocess
from tests.trust.campaign import campaign, table


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.trust")
    parser.add_argument("--seconds", type=float, default=180.0, help="that each fault lasts")
    parser.add_argument("--runs", type=int, default=3, help="each from a seed of its own")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--memory", choices=("short", "exponential"), default="short")
    args = parser.parse_args()
    rows = []
    for run in range(args.runs):
        for arithmetic in ARITHMETICS:
            print(f"run {run + 1}, {arithmetic} ...", file=sys.stderr, flush=True)
            rows += in_subprocess(campaign, arithmetic, args.seconds, args.seed + run, args.memory)
    print(table(rows))
    wrong = [row for row in rows if not row.holds]
    for row in wrong:
        print(f"does not hold: {row}")
    count = sum(row.samples for row in rows)
    print(f"{len(rows)} loops of {args.memory} memory, {count} samples: {len(wrong)} do not hold")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
