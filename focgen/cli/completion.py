"""``focgen --print-completion SHELL``: what a shell needs to complete commands, options and their values."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

SHELLS = ("bash", "zsh", "fish")


@dataclass(frozen=True)
class Word:
    """An option, or a command's argument where it has choices (its ``name`` is empty then).

    ``values`` that it takes; ``takes``: whether it takes any, else it is a switch.
    """

    name: str
    values: tuple[str, ...]
    takes: bool
    about: str


@dataclass(frozen=True)
class Command:
    """A command, what it is for in a line, and its words."""

    about: str
    words: tuple[Word, ...]


class PrintCompletion(argparse.Action):
    """Prints the script for one shell, and ends."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """As argparse calls it."""
        print(script(str(values), parser), end="")
        parser.exit()


def script(shell: str, parser: argparse.ArgumentParser) -> str:
    """The script for one of ``SHELLS``, from a parser with all commands."""
    known = dict(_commands(parser))
    if shell == "fish":
        return _fish(known)
    made = _bash(known)
    return (
        made if shell == "bash" else f"autoload -Uz compinit bashcompinit\ncompinit -u\nbashcompinit\n{made}"
    )


def _commands(parser: argparse.ArgumentParser) -> Iterator[tuple[str, Command]]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, one in action.choices.items():
                yield name, Command(one.description or "", tuple(_words(one)))


def _words(command: argparse.ArgumentParser) -> Iterator[Word]:
    for action in command._actions:
        values = tuple(map(str, action.choices or ()))
        about = " ".join((action.help or "").replace("%%", "%").split())
        if action.option_strings:
            yield Word(action.option_strings[-1], values, action.nargs != 0, about)
        elif values:
            yield Word("", values, True, about)


def _bash(known: Mapping[str, Command]) -> str:
    """A function that looks at the word before, else at the command; file names where nothing fits."""
    values = [
        f'        "{name} {word.name}") words="{" ".join(word.values)}" ;;'
        for name, command in known.items()
        for word in command.words
        if word.name and word.takes
    ]
    options = [
        f'            {name}) words="{" ".join(word.name for word in command.words if word.name)}" ;;'
        for name, command in known.items()
    ]
    arguments = [
        f'            {name}) words="{" ".join(word.values)}" ;;'
        for name, command in known.items()
        for word in command.words
        if not word.name
    ]
    return "\n".join(
        [
            "_focgen()",
            "{",
            '    local cur="${COMP_WORDS[COMP_CWORD]}" prev="${COMP_WORDS[COMP_CWORD-1]}" words=""',
            '    local command="${COMP_WORDS[1]}"',
            '    if [ "$COMP_CWORD" -eq 1 ]; then',
            f'        words="{" ".join(known)} --help --version --print-completion"',
            '    else case "$command $prev" in',
            f'        "--print-completion --print-completion") words="{" ".join(SHELLS)}" ;;',
            *values,
            '        *) case "$cur" in',
            '        -*) case "$command" in',
            *options,
            "            esac ;;",
            '        *) case "$command" in',
            *arguments,
            "            esac ;;",
            "        esac ;;",
            "    esac; fi",
            "    COMPREPLY=()",
            '    if [ -n "$words" ]; then COMPREPLY=($(compgen -W "$words" -- "$cur")); fi',
            "}",
            "complete -o default -F _focgen focgen",
            "",
        ]
    )


def _fish(known: Mapping[str, Command]) -> str:
    lines = [
        f"complete -c focgen -n __fish_use_subcommand -f -a {name} -d {_quoted(command.about)}"
        for name, command in known.items()
    ]
    shells = " ".join(SHELLS)
    lines.append(f"complete -c focgen -n __fish_use_subcommand -l print-completion -x -a '{shells}'")
    for name, command in known.items():
        seen = f"complete -c focgen -n '__fish_seen_subcommand_from {name}'"
        lines += [f"{seen} {_of_fish(word)} -d {_quoted(word.about)}" for word in command.words]
    return "\n".join([*lines, ""])


def _of_fish(word: Word) -> str:
    values = f" -a '{' '.join(word.values)}'" if word.values else ""
    if not word.name:
        return f"-f{values}"
    only = " -x" if word.values else " -r" if word.takes else ""
    return f"-l {word.name.lstrip('-')}{only}{values}"


def _quoted(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
