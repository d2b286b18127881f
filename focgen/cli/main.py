"""``focgen COMMAND …``: parse, run one command, print, and turn errors into one line and a status."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pkgutil import iter_modules

import focgen
import focgen.cli
from focgen.errors import FocgenError
from focgen.jsontext import to_json

# The order of the help page; a command exists where focgen/cli has its file.
_COMMANDS = (
    "init",
    "identify",
    "design",
    "simulate",
    "generate",
    "verify",
    "cost",
    "study",
    "diagnose",
    "replay",
    "report",
    "trial",
    "demo",
)

_PROLOGUE = """From a CSV of step tests to a verified fractional-order controller on a microcontroller.

  focgen init logs/*.csv --out rig.toml
  focgen identify logs/*.csv --rig rig.toml --out identified.toml
  focgen design identified.toml --out controller.toml --settling 1.5
  focgen generate controller.toml --out firmware --arithmetic q31
  focgen verify firmware
"""


def commands() -> tuple[str, ...]:
    """The commands that are there, in the order of the help page."""
    present = {module.name for module in iter_modules(focgen.cli.__path__)}
    return tuple(name for name in _COMMANDS if name in present)


class _Parser(argparse.ArgumentParser):
    """Reports a wrong argument the way every other error is reported."""

    def error(self, message: str):
        command = self.prog.partition(" ")[2] or "arguments"
        raise FocgenError(command, message, f"see `{self.prog} --help`")


def parser(only: str | None = None) -> argparse.ArgumentParser:
    """The parser of the whole command line, or with one command ``only``, so that the others need not be
    loaded.
    """
    style = argparse.RawDescriptionHelpFormatter
    top = _Parser(prog="focgen", description=_PROLOGUE, formatter_class=style)
    top.add_argument("--version", action="version", version=f"focgen {focgen.__version__}")
    sub = top.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in (only,) if only in commands() else commands():
        module = import_module(f"focgen.cli.{name}")
        one = sub.add_parser(
            name, help=module.HELP, description=module.HELP, epilog=module.EXAMPLE, formatter_class=style
        )
        module.add_arguments(one)
        one.add_argument(
            "--json", action="store_true", help="one JSON object on stdout, everything else on stderr"
        )
        one.set_defaults(run=module.run)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns 0 (done), 1 (a check does not hold) or 2 (unusable input)."""
    try:
        argv = sys.argv[1:] if argv is None else list(argv)
        args = parser(argv[0] if argv else None).parse_args(argv)
        outcome = args.run(args)
        sys.stdout.write(to_json(outcome.payload) if args.json else outcome.text.rstrip("\n") + "\n")
        sys.stdout.flush()
    except FocgenError as error:
        line = " ".join(str(error).split())
        print(f"focgen: error: {line}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # the reader of a pipe went away; nothing is wrong
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print("focgen: interrupted", file=sys.stderr)
        return 130
    return 0 if outcome.holds else 1
