"""``focgen init``: a first rig.toml for logs that have none."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from focgen.cli.outcome import Outcome
from focgen.rig.files import rig_table
from focgen.rig.proposal import init
from focgen.rig.rig import Rig
from focgen.terminal import for_terminal

EXAMPLE = """example:
  focgen init steps.csv --out rig.toml
  focgen identify steps.csv --rig rig.toml --out identified.toml

On a terminal it asks for each role that it is unsure of.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("logs", metavar="LOG", nargs="+", help="logs of one rig")
    parser.add_argument("--out", metavar="RIG", help="the file to write (default: it is printed)")


def run(args: argparse.Namespace) -> Outcome:
    """Do it."""
    asks = sys.stdin.isatty() and sys.stderr.isatty() and not args.json
    found = init(args.logs, args.out, _ask if asks else None)
    doubts = [f"unsure: {doubt}" for doubt in found.doubts]
    ahead = [f"{args.out}: {_roles(found.rig)}"] if args.out else [found.text]
    text = "\n".join([*ahead, *(doubts if args.out else []), f"next: {found.next}"])
    payload = {"rig": rig_table(found.rig), "doubts": found.doubts, "text": found.text, "next": found.next}
    return Outcome(payload, text)


def _roles(rig: Rig) -> str:
    roles = {"time": rig.signals.time, **rig.signals.columns()}
    return ", ".join(f"{role} = {column}" for role, column in roles.items())


def _ask(role: str, likely: str, columns: Sequence[str]) -> str:
    """The column that the user names; Enter takes the likely one, "-" none."""
    while True:
        asked = f"{role} [{likely}], one of {', '.join(columns)}, or - for none: "
        print(for_terminal(asked), end="", file=sys.stderr)
        sys.stderr.flush()
        line = sys.stdin.readline()
        answer = line.strip() or likely
        if not line or answer in columns:
            return answer
        if answer == "-":
            return ""
