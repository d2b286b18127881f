"""``focgen study memory``: what memory form and length cost, and what they do to accuracy and loop."""

from __future__ import annotations

import argparse

from focgen.cli.outcome import Outcome
from focgen.cli.shown import add_report, check_report, drawn, is_page, write_report
from focgen.control.controller import ARITHMETICS, MEMORIES
from focgen.report.pages.study import study_page
from focgen.report.study import study_pictures
from focgen.report.study_summary import study_text
from focgen.studies.study import SUBJECTS, study
from focgen.studies.write import payload

EXAMPLE = """examples:
  focgen study memory controller.toml --out memory
  focgen study memory controller.toml --out memory --lengths 100 1000 --arithmetic q31 --target cortex-m4
  focgen study memory controller.toml --out memory --scheduler tcp://10.0.0.5:8786

  writes study.json, report.html and pictures, and ends with the shortest memory that serves. The closed loop
  is that of the rig the controller was designed from, where that file lies beside it; else name it with
  --rig. An interrupted study goes on from what is in the folder.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("subject", choices=SUBJECTS, help="what to study")
    parser.add_argument(
        "controller", metavar="CONTROLLER", help="controller.toml, designed or written by hand"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder of the study")
    parser.add_argument(
        "--rig", metavar="RIG", help="closes the loop (default: what the controller was designed from)"
    )
    _add_variants(parser)
    parser.add_argument("--target", metavar="CORE", help="count cycles and flash for this core")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes at a time (default: the cores)")
    add_report(parser)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="do the work on this Dask cluster")


def _add_variants(parser: argparse.ArgumentParser) -> None:
    """What is varied, and the set points that every variant is tried at."""
    parser.add_argument("--memory", nargs="+", choices=MEMORIES, help="forms (default: both)")
    parser.add_argument(
        "--lengths",
        nargs="+",
        type=int,
        metavar="L",
        help="of short memory, past samples (default: 10 … 5000 and the controller's)",
    )
    parser.add_argument(
        "--tolerances",
        nargs="+",
        type=float,
        metavar="E",
        help="of exponential memory (default: 0.1 … 1e-6, and the controller's)",
    )
    parser.add_argument(
        "--horizon",
        type=int,
        metavar="N",
        help="of exponential memory, samples at the controller's sample time (default: the controller's)",
    )
    parser.add_argument("--arithmetic", nargs="+", choices=ARITHMETICS, help="default: all")
    parser.add_argument(
        "--sample-times",
        nargs="+",
        type=float,
        metavar="S",
        help="s (default: half, once and twice the controller's)",
    )
    parser.add_argument(
        "--setpoints",
        nargs="+",
        type=float,
        metavar="Y",
        help="outputs the loop steps to (default: tenths 1 … 7 of the range)",
    )


def run(args: argparse.Namespace) -> Outcome:
    """Study, and say what came out."""
    given = [path for path in (args.controller, args.rig) if path]
    check_report(args.report, given, args.out if is_page(args.report) else None)
    found = study(
        args.subject,
        args.controller,
        args.out,
        rig=args.rig,
        memory=args.memory,
        lengths=args.lengths,
        tolerances=args.tolerances,
        horizon=args.horizon,
        arithmetic=args.arithmetic,
        sample_times=args.sample_times,
        setpoints=args.setpoints,
        target=args.target,
        jobs=args.jobs,
        scheduler=args.scheduler,
    )
    shown = drawn(args.report, lambda: study_page(found), lambda: study_pictures(found))
    told = write_report(args.report, shown, given)
    return Outcome(payload(found), f"{study_text(found)}\n\nwritten to {args.out}\n{told}")
