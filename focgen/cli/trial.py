"""``focgen trial make|run|score``: sealed cases, diagnosed blind, then unsealed and scored."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from focgen.cli.outcome import Outcome
from focgen.cli.shown import add_report, check_report, drawn, is_page, write_report
from focgen.output import check_writable, former, write_files
from focgen.replaced import check_own
from focgen.report.pages.trials import trials_page
from focgen.report.trials import pictures
from focgen.trials.patterns import SUITES
from focgen.trials.plan import KINDS
from focgen.trials.tables import full_text, markdown
from focgen.trials.trial import ACTIONS, trial

_DRAWN = re.compile(r"reliability\.png|confusion_[ABC]_[a-z]+\.png")

EXAMPLE = """examples:
  focgen trial make trials/c --signals C --cases 200 --seed 1000
  focgen trial make trials/b --signals B --cases 200 --seed 1000
  focgen trial run trials/c trials/b
  focgen trial score trials/c trials/b --oracle --out trials/table
Seeds below 1000 are for tuning, from 1000 on for reporting.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("action", choices=tuple(ACTIONS))
    parser.add_argument("folder", metavar="DIR", nargs="+", help="run, score: also several")
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
        choices=tuple(SUITES),
        default="full",
        help="Sessions of about 600 s (full), with regulator and sensor off (off), of healthy rigs with both "
        "further off (sound), with logs cut (begun), or of 270 s (short). Loops of a known controller "
        "(closed), of an unknown one (loops). Plants that integrate, oscillate or rub (plants). Rigs moved "
        "by a physics engine (engine; it needs pip install 'focgen[engine]')",
    )
    parser.add_argument("--kinds", metavar="KIND,…", help=f"only these kinds of cases, of {', '.join(KINDS)}")
    parser.add_argument(
        "--jobs", type=int, metavar="N", help="run, score: processes at a time (default: the cores)"
    )
    parser.add_argument(
        "--minutes", type=float, metavar="M", help="run: begin no case after M minutes; a later run goes on"
    )
    parser.add_argument("--oracle", action="store_true", help="score: also diagnose knowing the effect")
    parser.add_argument(
        "--proposals",
        action="store_true",
        help="score: also make the proposed experiments, and those of the menu, and diagnose again",
    )
    parser.add_argument(
        "--no-baseline", action="store_true", help="score: leave the residual correlation out"
    )
    parser.add_argument(
        "--partial",
        action="store_true",
        help="score: leave out what has not been run instead of counting it missed",
    )
    parser.add_argument("--out", metavar="OUT", help="score: also write the table and pictures there")
    add_report(parser)


def run(args: argparse.Namespace) -> Outcome:
    """Do it."""
    return {"make": _make, "run": _run, "score": _score}[args.action](args)


def _make(args: argparse.Namespace) -> Outcome:
    kinds = tuple(args.kinds.split(",")) if args.kinds else None
    made = trial(
        "make",
        *args.folder,
        cases=args.cases,
        seed=args.seed,
        signals=args.signals,
        suite=args.suite,
        kinds=kinds,
    )
    return Outcome(made, f"{made.cases} sealed cases in {made.folder}")


def _run(args: argparse.Namespace) -> Outcome:
    ran = trial("run", *args.folder, jobs=args.jobs, minutes=args.minutes)
    text = f"{ran.now} cases diagnosed, {ran.before} had been before; {ran.failed} failed, {ran.waiting} wait"
    return Outcome(ran, text, holds=ran.failed == 0 and ran.waiting == 0)


def _score(args: argparse.Namespace) -> Outcome:
    check_report(args.report, (), args.out if is_page(args.report) else None)
    if args.out:
        _check_place(Path(args.out))
    summary = trial(
        "score",
        *args.folder,
        oracle=args.oracle,
        proposals=args.proposals,
        baseline=not args.no_baseline,
        partial=args.partial,
        jobs=args.jobs,
    )
    text = full_text(summary.sets)
    if args.out:
        files: dict[str, str | bytes] = {"scores.md": markdown(summary.sets), **pictures(summary.sets)}
        drawn_before = _drawn_before(Path(args.out))
        write_files(args.out, files, _inputs(args.folder), former(args.out, "scores.md", drawn_before, files))
        text += f"\ntable and pictures in {args.out}"
    shown = drawn(args.report, lambda: trials_page(summary.sets), lambda: pictures(summary.sets))
    text += "\n" + write_report(args.report, shown, _inputs(args.folder))
    return Outcome(summary, text, holds=summary.reached)


def _check_place(out: Path) -> None:
    """Raise InputError, before work begins, where the table or a picture would take the place of somebody
    else's file, or cannot be written."""
    check_writable(out, folder=True)
    check_own(out / name for name in ("scores.md", *_drawn_before(out)))


def _drawn_before(out: Path) -> list[str]:
    return [path.name for path in out.glob("*.png") if _DRAWN.fullmatch(path.name)]


def _inputs(folders: Sequence[str]) -> list[Path]:
    """The cases and their seals, which nothing may replace."""
    parts = ("trial.json", "cases/**/*", "sealed/**/*")
    return [path for folder in folders for part in parts for path in Path(folder).glob(part)]
