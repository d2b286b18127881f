"""``focgen COMMAND …``: parse, run one command, print, and turn errors into one line and a status."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from importlib import import_module
from itertools import pairwise
from pkgutil import iter_modules
from typing import Any, NoReturn

import focgen
import focgen.cli
from focgen.cli.completion import SHELLS, PrintCompletion
from focgen.cli.faults import (
    Ended,
    as_one_line,
    check_epoch,
    ending_in_order,
    open_streams,
    say_error,
    write_out,
)
from focgen.errors import FocgenError
from focgen.jsontext import to_json
from focgen.terminal import for_terminal

# In the order of the help page, which is told without loading them: scipy takes its time. A command exists
# where focgen/cli has its file.
_COMMANDS = {
    "init": "propose a rig.toml for logs: which column is what, units, ranges, and what is unsure",
    "identify": "fit K(p)/(T s^alpha + 1) to logs of a rig, and integer-order models beside it",
    "design": "invert the rig's model, find the gain schedule K_o(p)/K(p), check the margins",
    "simulate": "the closed loop of rig and controller at a row of set points",
    "generate": "write C99 for a controller, with proofs and error bounds in its manifest",
    "verify": "compile generated C and compare it with the reference, sample for sample",
    "cost": "what one step of generated C costs on microcontrollers: instructions, cycles, flash, RAM, stack",
    "study": "how much memory a controller needs: accuracy, closed loop and cost of every form and length",
    "diagnose": "where the gap to the real rig lies, which effect causes it, and how far it shrinks",
    "replay": "run a rig, its effects included, on the inputs of logs",
    "report": "one self-contained HTML page of a chain, a study or a diagnosis",
    "trial": "sealed cases: make them, diagnose them blind, unseal and score",
    "demo": "all of it on the example logs: model, controller, verified C, and a sealed case diagnosed; "
    "with a report",
}

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


_NEGATIVE = re.compile(r"-(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|inf|infinity|nan)$", re.IGNORECASE)


class _Parser(argparse.ArgumentParser):
    """Reports a wrong argument the way every other error is reported."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._negative_number_matcher = _NEGATIVE  # argparse's own takes -1e-3 for an option

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse does, but a mistyped option is said first, not what is missing for want of it."""
        if self._subparsers is None:
            self._check_options(sys.argv[1:] if args is None else args)
        return super().parse_known_args(args, namespace)

    def _check_options(self, args: Sequence[str]) -> None:
        known = self._option_string_actions
        for word in args[: args.index("--")] if "--" in args else args:
            option = word.partition("=")[0]
            if option.startswith("--") and not any(one.startswith(option) for one in known):
                raise FocgenError(
                    self.prog.partition(" ")[2], f"has no option {option}", _meant(option, known, self.prog)
                )

    def error(self, message: str) -> NoReturn:
        command = self.prog.partition(" ")[2] or "arguments"
        raise FocgenError(command, message, f"see `{self.prog} --help`")


def _meant(word: str, known: Iterable[str], prog: str) -> str:
    """The remedy for a word that is not known: the one most like it, where one is, and the help."""
    near = get_close_matches(word, list(known), 1)
    help_text = f"see `{prog} --help`"
    return f"did you mean {near[0]}? else {help_text}" if near else help_text


def _short_help() -> str:
    """What there is, in one screen."""
    width = max(map(len, commands()))
    lines = [f"  {name:{width}s}  {_COMMANDS[name]}" for name in commands()]
    return "\n".join(
        [_PROLOGUE, "commands:", *lines, "", "`focgen COMMAND --help` shows an example of each."]
    )


def parser(only: str | None = None) -> argparse.ArgumentParser:
    """The parser of the whole command line, or with one command ``only``, so that the others need not be
    loaded; with ``""`` each is there by its name and line, and none is loaded.
    """
    style = argparse.RawDescriptionHelpFormatter
    top = _Parser(prog="focgen", description=_PROLOGUE, formatter_class=style)
    top.add_argument("--version", action="version", version=f"focgen {focgen.__version__}")
    about = "print what a shell needs to complete focgen's commands and options, and end"
    top.add_argument("--print-completion", choices=SHELLS, action=PrintCompletion, help=about)
    sub = top.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in (only,) if only in commands() else commands():
        about = _COMMANDS[name]
        one = sub.add_parser(name, help=about, description=about, formatter_class=style)
        if only != "":
            _load(name, one)
    return top


def _load(name: str, one: argparse.ArgumentParser) -> None:
    """Give a command's parser its arguments and what runs it."""
    module = import_module(f"focgen.cli.{name}")
    one.epilog = module.EXAMPLE
    module.add_arguments(one)
    one.add_argument(
        "--json", action="store_true", help="one JSON object on stdout, everything else on stderr"
    )
    one.set_defaults(run=module.run)


def _needed(argv: Sequence[str]) -> str | None:
    """What of the command line has to be loaded for these arguments, as :func:`parser` takes it."""
    if argv[0] in ("--help", "-h", "--version"):
        return ""
    return argv[0] if argv[0] in commands() else None


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns 0 (done), 1 (what was checked does not hold), 2 (unusable input, or a fault:
    one line on stderr), 130 (interrupted), or 128 and the number of the signal that has ended it.
    """
    argv = sys.argv[1:] if argv is None else list(argv)
    try:
        open_streams()
        with ending_in_order():
            return _run(argv)
    except Ended as ended:
        say_error(f"focgen: ended ({ended})")
        return ended.status
    except KeyboardInterrupt:
        say_error("focgen: interrupted")
        return 130
    except Exception as error:  # noqa: BLE001 - 1 would say that a check does not hold
        say_error(f"focgen: error: {as_one_line(error, argv)}")
        return 2


def _check_empty(argv: Sequence[str]) -> None:
    """Raise FocgenError for an argument without a character: a variable of the shell that is not set. As a
    path it would be the current folder, and files would be written there."""
    for before, word in pairwise(argv):
        if not word or re.fullmatch(r"--[\w-]+=", word):
            where = word.rstrip("=") or (before if before.startswith("--") else "an argument")
            raise FocgenError(where, "is empty", "name something, or leave it out")


def _run(argv: Sequence[str]) -> int:
    if not argv:
        write_out(_short_help() + "\n")
        return 0
    if not argv[0].startswith("-") and argv[0] not in commands():
        raise FocgenError(argv[0], "is no command", _meant(argv[0], commands(), "focgen"))
    check_epoch()
    args = parser(_needed(argv)).parse_args(argv)
    _check_empty(argv)
    outcome = args.run(args)
    text = to_json(outcome.payload) if args.json else for_terminal(outcome.text.rstrip("\n")) + "\n"
    write_out(text, args.json)
    return 0 if outcome.holds else 1
