"""``focgen replay``: a rig, effects included, run on logged inputs."""

from __future__ import annotations

import argparse

from focgen.cli.outcome import Outcome
from focgen.rig.replay import replay

EXAMPLE = """example:
  focgen replay diagnosis/refitted.toml new.csv
  focgen replay diagnosis/augmented.toml new.csv
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("rig", metavar="RIG", help="the rig, with or without [[effects]]")
    parser.add_argument("logs", metavar="LOG", nargs="+", help="experiments of one session, in order")
    parser.add_argument(
        "--from", dest="first", type=float, metavar="S", help="from S seconds into each experiment"
    )
    parser.add_argument(
        "--to", dest="last", type=float, metavar="S", help="to S seconds into each experiment"
    )


def run(args: argparse.Namespace) -> Outcome:
    """Do it."""
    found = replay(args.rig, args.logs, args.first, args.last)
    lines = [f"{name}: GOF {one.gof:.4f}, RMSE {one.rmse:.4g}" for name, one in found.logs.items()]
    lines += [f"warning: {w}" for w in found.warnings] + [f"note: {n}" for n in found.notes]
    return Outcome({"logs": found.logs, "warnings": found.warnings, "notes": found.notes}, "\n".join(lines))
