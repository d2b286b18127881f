"""``focgen diagnose``: where the gap to the real rig lies, which effect causes it, how far it shrinks."""

from __future__ import annotations

import argparse

from focgen.cli.outcome import Outcome
from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.model import Diagnosis
from focgen.errors import FocgenError
from focgen.progress import led_by

HELP = "where the gap to the real rig lies, which effect causes it, and how far it shrinks"

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
    """Do it."""
    if args.plan:
        from focgen.diagnosis.plan import plan

        found = plan(args.rig, args.logs)
        return Outcome(found, found.text())
    if not args.logs:
        raise FocgenError("diagnose", "no log is given", "name at least one log")
    if args.out is None:
        raise FocgenError("diagnose", "--out is missing", "name the folder for the diagnosis")
    with led_by("diagnose: the signals from "):
        found = diagnose(
            args.rig, args.logs, args.out, args.controller, args.first, args.last, args.bootstrap
        )
    return Outcome(found, in_words(found, args.out))


def in_words(found: Diagnosis, out: str) -> str:
    """The diagnosis for people."""
    lines = [
        f"verdict: {found.verdict}",
        f"stage: {found.where.stage or 'cannot be told'}" + (" (inferred)" if found.where.inferred else ""),
    ]
    for cause in found.causes:
        names = ", ".join(f"{c.effect} {100 * c.confidence:.0f} %" for c in cause.candidates)
        whole = "its departure from the ideal one" if cause.stage == "controller" else "the gap"
        lines.append(f"  {cause.stage}: {names}; {100 * cause.shrink:.0f} % of {whole}")
    gap = found.gap
    lines.append(
        f"gap of {gap.unit}: {gap.as_given:.4g} as given, {gap.refitted:.4g} refitted, "
        f"{gap.explained:.4g} explained, {gap.floor:.4g} noise"
    )
    lines.append(
        f"GOF: {gap.gof['as given']:.3f} as given, {gap.gof['refitted']:.3f} refitted, "
        f"{gap.gof['explained']:.3f} explained, of a possible {gap.gof['possible']:.3f}"
    )
    if found.shrink is not None:
        low, high = found.shrink_interval
        lines.append(
            f"promised for new experiments: {100 * found.shrink:.0f} % of what could be explained "
            f"({100 * low:.0f} to {100 * high:.0f} %)"
        )
    for place, what in found.unexplained.items():
        lines.append(f"unexplained, {place}: depends on {', '.join(what['depends_on'])}")
    if found.next_experiment:
        lines.append(f"next experiment: {found.next_experiment.what}, for {found.next_experiment.why}")
    lines += [f"warning: {w}" for w in found.warnings] + [f"note: {n}" for n in found.notes]
    return "\n".join([*lines, f"written to {out}"])
