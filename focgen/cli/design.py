"""``focgen design``: from a rig to a controller."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from focgen.cli.outcome import Outcome
from focgen.cli.shown import add_report, check_report, drawn, write_with_report
from focgen.control.controller import ARITHMETICS
from focgen.control.files import check_replaces_controller, controller_text
from focgen.loop.design import design
from focgen.output import check_apart
from focgen.report.control import design_pictures
from focgen.report.control_summary import design_payload, design_text
from focgen.report.pages.control import design_page
from focgen.rig.files import read_rig

EXAMPLE = """example:
  focgen design identified.toml --out controller.toml --settling 1.5 --report pictures

  writes controller.toml and prints the schedule, the steps from rest to seven set points in the closed loop,
  and the margins: ideal, and as it will run. --settling is the mean settling time (to within 5 %) over these
  set points. If it is not feasible, the error says what is."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("rig", metavar="RIG", help="rig.toml with an [actuator]")
    parser.add_argument("--out", required=True, metavar="CONTROLLER", help="the controller.toml to write")
    parser.add_argument(
        "--settling",
        type=float,
        metavar="S",
        help="mean settling time over the operating points, s (default: 1.5, or the fastest feasible)",
    )
    parser.add_argument(
        "--overshoot",
        type=float,
        metavar="PCT",
        help="largest overshoot at any operating point, %% (default: 5; alone: as fast as it allows)",
    )
    parser.add_argument(
        "--arithmetic", default="q31", choices=ARITHMETICS, help="what it will run in (default: q31)"
    )
    parser.add_argument(
        "--length",
        type=int,
        metavar="L",
        help="memory length, past samples (default: the shortest with 1 %% error at the crossover)",
    )
    parser.add_argument(
        "--setpoints",
        type=float,
        nargs="+",
        metavar="Y",
        help="outputs that are the operating points (default: tenths 1 … 7 of the output's range)",
    )
    parser.add_argument(
        "--delay", type=int, default=1, choices=(0, 1), help="computation delay, samples (default: 1)"
    )
    add_report(parser)


def run(args: Namespace) -> Outcome:
    check_apart([args.out], [args.rig])
    check_replaces_controller(args.out)
    check_report(args.report, [args.rig], args.out)
    specified = (args.settling, args.overshoot, args.arithmetic, args.length)
    result = design(args.rig, None, *specified, delay=args.delay, setpoints=args.setpoints)
    rig = read_rig(args.rig)
    shown = drawn(args.report, lambda: design_page(result, rig), lambda: design_pictures(result, rig))
    told = write_with_report(args.out, controller_text(result.controller), args.report, shown, [args.rig])
    text = f"{design_text(result)}\n\nwrote {args.out}\n{told}"
    text += f"next: focgen simulate {args.rig} {args.out}\n"
    text += f"      focgen generate {args.out} --out DIR --arithmetic {args.arithmetic}"
    return Outcome(design_payload(result) | {"controller": args.out}, text, result.holds)
