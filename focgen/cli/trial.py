"""``focgen trial make|run|score``: sealed cases, diagnosed blind, then unsealed and scored."""

from __future__ import annotations

import argparse
import os

from focgen.cli.outcome import Outcome
from focgen.trials.plan import KINDS
from focgen.trials.rows import table
from focgen.trials.trial import ACTIONS, trial

HELP = "sealed cases: make them, diagnose them blind, unseal and score"

EXAMPLE = """examples:
  focgen trial make trials/c --signals C --cases 200 --seed 1000
  focgen trial run trials/c
  focgen trial score trials/c
Seeds below 1000 are for tuning, from 1000 on for reporting.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("action", choices=tuple(ACTIONS))
    parser.add_argument("folder", metavar="DIR")
    parser.add_argument(
        "--signals",
        choices=("C", "B", "A"),
        default="C",
        help="C: command, pressure, curvature, output; B: no curvature; A: command and output",
    )
    parser.add_argument("--cases", type=int, default=200, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="S")
    parser.add_argument(
        "--suite",
        choices=("full", "short", "closed"),
        default="full",
        help="about 600 s, 270 s, or closed-loop logs",
    )
    parser.add_argument("--kinds", metavar="KIND,…", help=f"only these kinds of cases, of {', '.join(KINDS)}")
    parser.add_argument(
        "--jobs", type=int, metavar="N", help="run, score: processes at a time (default: the cores)"
    )
    parser.add_argument("--oracle", action="store_true", help="score: also diagnose knowing the effect")
    parser.add_argument(
        "--no-baseline", action="store_true", help="score: leave the residual correlation out"
    )


def run(args: argparse.Namespace) -> Outcome:
    """Do it."""
    return {"make": _make, "run": _run, "score": _score}[args.action](args)


def _make(args: argparse.Namespace) -> Outcome:
    kinds = tuple(args.kinds.split(",")) if args.kinds else None
    made = trial(
        "make",
        args.folder,
        cases=args.cases,
        seed=args.seed,
        signals=args.signals,
        suite=args.suite,
        kinds=kinds,
    )
    return Outcome(made, f"{made.cases} sealed cases in {made.folder}")


def _run(args: argparse.Namespace) -> Outcome:
    ran = trial("run", args.folder, jobs=args.jobs)
    text = f"{ran.now} cases diagnosed, {ran.before} had been before; {ran.failed} failed"
    return Outcome(ran, text, holds=ran.failed == 0)


def _score(args: argparse.Namespace) -> Outcome:
    scores = trial(
        "score",
        args.folder,
        oracle=args.oracle,
        baseline=not args.no_baseline,
        jobs=args.jobs or os.cpu_count() or 1,
    )
    head = (
        f"{scores.cases} cases, signals {scores.signals}, suite {scores.suite}, seed {scores.seed}; "
        f"{scores.failed} without a diagnosis"
    )
    return Outcome(scores, f"{head}\n{table(scores.rows)}", holds=scores.reached)
