"""``focgen diagnose``: where the gap to the real rig lies, which effect causes it, how far it shrinks."""

from __future__ import annotations

import argparse
from pathlib import Path

from focgen.cli.outcome import Outcome
from focgen.cli.shown import add_report, check_report, drawn, is_page, write_report
from focgen.control.units import units_of_rig
from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.write import PICTURES
from focgen.errors import FocgenError
from focgen.progress import led_by
from focgen.report.diagnosis_summary import diagnosis_text
from focgen.report.paths import page_of
from focgen.rig.files import read_rig

EXAMPLE = """example:
  focgen diagnose rig.toml logs/*.csv --out diagnosis
  focgen replay diagnosis/augmented.toml new.csv
  focgen diagnose --plan rig.toml logs/*.csv      what these experiments could tell apart
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("rig", metavar="RIG", help="the nominal rig (rig.toml)")
    parser.add_argument(
        "logs", metavar="LOG", nargs="*", help="one session of the real rig, a file an experiment"
    )
    parser.add_argument("--out", metavar="DIR", help="folder for diagnosis.json, the rigs and the pictures")
    parser.add_argument(
        "--controller", metavar="FILE", help="the controller of closed-loop logs (controller.toml)"
    )
    add_report(parser)
    parser.add_argument(
        "--plan", action="store_true", help="only say which effects the experiments could tell apart"
    )
    parser.add_argument(
        "--bootstrap",
        type=int,
        default=0,
        metavar="N",
        help="set the threshold by N simulated sessions of the nominal rig (default: built in)",
    )
    parser.add_argument(
        "--from", dest="first", type=float, metavar="S", help="from S seconds into each experiment"
    )
    parser.add_argument(
        "--to", dest="last", type=float, metavar="S", help="to S seconds into each experiment"
    )


def run(args: argparse.Namespace) -> Outcome:
    """Diagnose and write, or with --plan say what the logs could tell.

    Raises FocgenError for an argument that is missing.
    """
    if args.plan:
        from focgen.diagnosis.proposals.identifiability import plan

        planned = plan(args.rig, args.logs)
        return Outcome(planned, planned.text())
    if not args.logs:
        raise FocgenError("diagnose", "no log is given", "name at least one log")
    if args.out is None:
        raise FocgenError("diagnose", "--out is missing", "name the folder for the diagnosis")
    given = [path for path in (args.rig, *args.logs, args.controller) if path]
    check_report(args.report, given, args.out if is_page(args.report) else None)
    with led_by("diagnose: the signals from "):
        found = diagnose(
            args.rig, args.logs, args.out, args.controller, args.first, args.last, args.bootstrap
        )
    text = diagnosis_text(found, units_of_rig(read_rig(args.rig)), args.out)
    folder = Path(args.out)
    shown = drawn(args.report, lambda: page_of([folder]), lambda: _pictures(folder))
    return Outcome(found, f"{text}\n{write_report(args.report, shown, given)}")


def _pictures(folder: Path) -> dict[str, bytes]:
    """Those that the diagnosis has written."""
    return {name: (folder / name).read_bytes() for name in PICTURES if (folder / name).is_file()}
