"""``focgen trial make|run|score``: sealed cases, diagnosed blind, then unsealed and scored."""

from __future__ import annotations

import argparse

from focgen.cli.outcome import Outcome
from focgen.trials.make import make

HELP = "sealed cases: make them, diagnose them blind, unseal and score"

EXAMPLE = """examples:
  focgen trial make trials/c --signals C --cases 200 --seed 1000
  focgen trial run trials/c
  focgen trial score trials/c
Seeds below 1000 are for tuning, from 1000 on for reporting.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("action", choices=("make", "run", "score"))
    parser.add_argument("folder", metavar="DIR")
    parser.add_argument("--signals", choices=("C", "B", "A"), default="C",
                        help="C: command, pressure, curvature, output; B: no curvature; A: command and output")
    parser.add_argument("--cases", type=int, default=200, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="S")
    parser.add_argument("--suite", choices=("full", "short", "closed"), default="full",
                        help="about 600 s, 270 s, or closed-loop logs")
    parser.add_argument("--kinds", metavar="KIND,…", help="only these kinds of cases")


def run(args: argparse.Namespace) -> Outcome:
    """Do it."""
    kinds = tuple(args.kinds.split(",")) if args.kinds else None
    made = make(args.folder, cases=args.cases, seed=args.seed, signals=args.signals, suite=args.suite, kinds=kinds)
    return Outcome(made, f"{made.cases} sealed cases in {made.folder}")
