"""``focgen identify``: from logs to the fractional model of a rig."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from focgen.cli.outcome import Outcome
from focgen.cli.shown import add_report, check_report, drawn, write_with_report
from focgen.custody import identified_from
from focgen.identification.identify import identify
from focgen.output import check_apart
from focgen.report.identification import identification_pictures
from focgen.report.identification_summary import identification_payload, identification_text
from focgen.report.pages.identification import identification_page
from focgen.rig.files import check_replaces_rig, rig_text

EXAMPLE = """example:
  focgen identify logs/steps.csv --rig rig.toml --out identified.toml --report pictures \\
    --unseen logs/sines.csv

  fits one K(p), T and alpha to all experiments at once and writes the rig with them to identified.toml. Fits
  each experiment by itself as well, and prints the goodness of fit of every model from 1 pole to 3 poles and
  2 zeros (Table I).

  focgen identify pump.csv --rig rig.toml --stages regulator,actuator --delay --out identified.toml

  identifies the regulator from command and pressure, too, and the actuator with a dead time."""


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument(
        "logs", nargs="+", metavar="LOG", help=".csv, .txt, .tsv (also .gz), .lvm, .tdms, .mat or .parquet"
    )
    parser.add_argument("--rig", required=True, metavar="RIG", help="rig.toml: columns, regulator and sensor")
    parser.add_argument("--out", required=True, metavar="NEW_RIG", help="the rig.toml to write")
    parser.add_argument(
        "--from", dest="first", type=float, metavar="S", help="begin here, s within each experiment"
    )
    parser.add_argument(
        "--to", dest="last", type=float, metavar="S", help="end here, s within each experiment"
    )
    parser.add_argument(
        "--gain-degree", type=int, default=1, metavar="N", help="degree of K(p) (default: 1, a line)"
    )
    parser.add_argument(
        "--unseen", nargs="+", default=(), metavar="LOG", help="logs to show the rig against, not fitted"
    )
    add_report(parser)
    parser.add_argument(
        "--stages",
        type=_stages,
        default=("actuator",),
        metavar="STAGE,…",
        help="which to identify: regulator (command to pressure), actuator, sensor (curvature to output); "
        "default: actuator",
    )
    parser.add_argument("--delay", action="store_true", help="fit the actuator's dead time as well")
    parser.add_argument(
        "--no-integer", action="store_true", help="leave out the integer-order models beside each fit"
    )


def _stages(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())


def _next(complete: bool, looped: bool, args: Namespace) -> str:
    if looped:
        logs = " ".join(str(log) for log in args.logs)
        return f"next: focgen diagnose {args.out} {logs}, for the rig with its loop"
    if complete:
        return f"next: focgen design {args.out} --out controller.toml"
    return f"next: focgen identify LOG --rig {args.out} --out NEW_RIG, for the actuator"


def _options(args: Namespace) -> dict[str, Any]:
    """What the rig's numbers depend on beside the files."""
    return {
        "from": args.first,
        "to": args.last,
        "gain_degree": args.gain_degree,
        "stages": list(args.stages),
        "delay": args.delay,
    }


def run(args: Namespace) -> Outcome:
    given = (*args.logs, args.rig, *args.unseen)
    check_apart([args.out], given)
    check_replaces_rig(args.out)
    check_report(args.report, given, args.out)
    found = identify(
        args.rig,
        args.logs,
        None,
        args.first,
        args.last,
        args.gain_degree,
        args.unseen,
        args.stages,
        args.delay,
        not args.no_integer,
    )
    written = rig_text(found.rig) + identified_from(given, args.out, _options(args))
    text = f"{identification_text(found)}\n\nwrote {args.out}\n"
    shown = drawn(args.report, lambda: identification_page(found), lambda: identification_pictures(found))
    text += write_with_report(args.out, written, args.report, shown, given)
    looped = found.joint is not None and found.joint.play > 0.0
    text += _next(found.rig.actuator is not None, looped, args)
    return Outcome(identification_payload(found) | {"new_rig": args.out}, text)
