"""``focgen report``: one page of a chain, a study or a diagnosis."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

import focgen
from focgen.cli.outcome import Outcome

EXAMPLE = """examples:
  focgen report gap --out gap.html
  focgen report identified.toml logs/steps.csv controller.toml firmware verification.json --out chain.html

  A path is a rig, a controller, a log to replay with the rig, a folder of generate, study or diagnose, or
  what `focgen verify DIR --json > verification.json` wrote. The page loads nothing from elsewhere: mail it
  as it is. Nothing is compiled."""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("paths", metavar="PATH", nargs="+", help="what to show, in any order")
    parser.add_argument("--out", required=True, metavar="FILE.html", help="the page to write")


def run(args: Namespace) -> Outcome:
    """Write the page."""
    made = focgen.report(args.paths, args.out)
    size = made.stat().st_size
    return Outcome(
        {"page": made, "bytes": size}, f"wrote {made} ({size / 1e6:.1f} MB); open it in any browser"
    )
