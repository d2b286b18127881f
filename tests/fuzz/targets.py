"""What reads a stranger's input, in process: each takes bytes, and raises nothing but the project's own
errors."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from focgen.codegen import texts
from focgen.codegen.edited import check_unedited
from focgen.codegen.generate import folder_files
from focgen.codegen.leftovers import leftovers
from focgen.codegen.names import check_name, suggestion
from focgen.control.files import controller_text, read_controller
from focgen.custody import followed
from focgen.diagnosis.drawn import read_drawn
from focgen.errors import FocgenError
from focgen.logs.read import read_logs
from focgen.logs.table import read_table
from focgen.plan.build import build_plan
from focgen.report.pages.chain import verification_section
from focgen.report.pages.files import read_diagnosis
from focgen.report.texts import data as within_script
from focgen.report.texts import drawn
from focgen.report.verified import read_verified
from focgen.rig.files import read_rig, rig_table, rig_text
from focgen.rig.proposal import init
from focgen.studies.kept import read_study
from focgen.targets.cost import Cost, cost_of
from focgen.trials import facts
from focgen.verification.recorded import read_recorded
from focgen.verification.remembered import remembered
from tests.fuzz import seeds


class Fault(Exception):
    """An input was taken, and what came of it is wrong."""


@dataclass(frozen=True)
class Target:
    """``run`` reads one input in a folder of its own; ``seeds`` are sound ones; ``form`` "toml" or "json"
    where the input has a structure, ``words`` what is put in; ``share`` of all inputs."""

    name: str
    run: Callable[[bytes, Path], None]
    seeds: Callable[[], Iterable[bytes]]
    share: float
    form: str = ""
    words: tuple[bytes, ...] = field(default=())


def check(holds: bool, what: str) -> None:
    """Raise Fault where something does not hold."""
    if not holds:
        raise Fault(what)


# -------------------------------------------------------------------------------------------- logs


def _table(name: str) -> Callable[[bytes, Path], None]:
    def run(data: bytes, place: Path) -> None:
        table = read_table(seeds.path_of(place, name, data))
        for column in list(table.columns)[:20]:
            check(len(table.texts(column)) == len(table), "texts of another length")
            for values in (table.numbers, table.seconds):
                try:
                    check(not np.isinf(values(column)).any(), "an infinite reading was taken")
                except FocgenError as error:
                    one_line(error)

    return run


@cache
def _signals():
    return read_rig(tomllib.loads(seeds.rig()[0].decode()))


def _log(data: bytes, place: Path) -> None:
    rig = _signals()
    found = read_logs([seeds.path_of(place, "log.csv", data)], rig.signals, rig.sample_time)
    check(len(found) > 0, "no experiment")
    for one in found:
        check(math.isfinite(one.start) and one.sample_time > 0, "a clock that is none")
        for role, values in one.signals.items():
            check(len(values) == len(one) and bool(np.isfinite(values).all()), f"{role} is not finite")


def _init(data: bytes, place: Path) -> None:
    found = init([seeds.path_of(place, "log.csv", data)])
    again = read_rig(tomllib.loads(found.text))
    check(again.signals == found.rig.signals, "the proposal is read as another rig")


# -------------------------------------------------------------------------------------------- TOML


def _rig(data: bytes, place: Path) -> None:
    rig = read_rig(seeds.path_of(place, "rig.toml", data))
    again = read_rig(seeds.path_of(place, "again.toml", rig_text(rig).encode("utf-8")))
    told = [json.dumps(rig_table(one), sort_keys=True, default=str) for one in (rig, again)]
    check(told[0] == told[1], "what is written is read as another rig")


def _controller(data: bytes, place: Path) -> None:
    made = read_controller(seeds.path_of(place, "controller.toml", data))
    again = read_controller(seeds.path_of(place, "again.toml", controller_text(made).encode("utf-8")))
    check(controller_text(again) == controller_text(made), "what is written is read as another controller")


_BARE = re.compile(r"(?<![\w\"])[-+]?(nan|inf)[fFlL]?\b", re.IGNORECASE)
_COMMENT = re.compile(r"/\*.*?\*/|\"(?:[^\"\\\n]|\\.)*\"", re.DOTALL)


def _plan(data: bytes, place: Path) -> None:
    made = read_controller(seeds.path_of(place, "controller.toml", data))
    length = min(made.length, 20) if made.memory == "short" else None
    plan = build_plan(made, None, length, "lead", tunable=made.tunable is not None)
    for name, content in folder_files(plan, data).items():
        if name.endswith((".c", ".h")) and not name.startswith("foc_"):
            text = content if isinstance(content, str) else content.decode("utf-8")
            check(text.isascii(), f"{name} is not ASCII")
            check(not _BARE.search(_COMMENT.sub("", text)), f"{name} has a number that is none")
        if name == "manifest.json":
            json.loads(content, parse_constant=lambda word: check(False, f"{word} in the manifest"))


def _custody(data: bytes, place: Path) -> None:
    for name in ("rig.toml", "log.csv"):
        seeds.path_of(place, name, data)
    whole = b'[designed_from]\nfile = "rig.toml"\nsha256 = ""\n'
    for note in followed(seeds.path_of(place, "controller.toml", whole), place):
        check("\n" not in note, "a note of several lines")
    list(followed(seeds.path_of(place, "controller.toml", data), place))


# -------------------------------------------------------------------------------------------- JSON


def _manifest(data: bytes, place: Path) -> None:
    path = seeds.path_of(place, "manifest.json", data)
    for name, content in seeds.firmware().items():
        if name.endswith((".c", ".ino", ".md")) and not (place / name).exists():
            seeds.path_of(place, name, content)
    for old in leftovers(path.parent, "lead", {"lead.c": "x"}):
        check(old.resolve().is_relative_to(place.resolve()), f"{old} would be removed")
    try:
        check_unedited(path.parent, {"lead.c": "x"}, ())
    except FocgenError as error:
        one_line(error)
    read_recorded(path.parent)


def _trial(data: bytes, place: Path) -> None:
    """Each file of a trial, whose values stand in one object."""
    try:
        parts = json.loads(data)
    except (ValueError, RecursionError):
        parts = None
    for name in ("trial.json", "label.json", "outcome.json", "diagnosis.json", "achieved.json"):
        there = isinstance(parts, dict) and name in parts
        seeds.path_of(place, name, json.dumps(parts[name]).encode("utf-8", "replace") if there else data)
    facts.outcome_in(place), facts.diagnosis_in(place), facts.achieved_in(place, "")
    try:
        facts.sealed_label(place / "label.json")
    except FocgenError as error:
        one_line(error)
    for number in facts.facts_of(place).commitments:
        check(re.fullmatch("[0-9]{4,9}", number) is not None, f"a case called {number!r}")


def _diagnosis(data: bytes, place: Path) -> None:
    read_diagnosis(seeds.path_of(place, "diagnosis.json", data))


def _drawn(data: bytes, place: Path) -> None:
    read_drawn(seeds.path_of(place, "signals.json", data))


def _study(data: bytes, place: Path) -> None:
    try:
        whole = json.loads(data)
        parts = {name: json.dumps(whole[name]).encode() for name in ("study", "curves")}
    except (ValueError, TypeError, KeyError, RecursionError):
        parts = dict.fromkeys(("study", "curves"), data)
    for name, part in parts.items():
        (place / f"{name}.json").write_bytes(part)
    read_study(place)


def _verified(data: bytes, place: Path) -> None:
    verification_section(read_verified(seeds.path_of(place, "verified.json", data)))


def _costs(data: bytes, place: Path) -> None:
    found = remembered(seeds.path_of(place, "cost.json", data)) or {}
    entries = [
        one for part in found.values() for one in (*part["targets"].values(), *part["previous"].values())
    ]
    check(all(isinstance(cost_of(one), Cost) for one in entries), "costs that are none")


# ------------------------------------------------------------------------------------------- texts

_TRIGRAPH = re.compile(r"\?\?[=/'()!<>-]")
_ESCAPE = re.compile(r'\\([0-7]{3}|["\\?])')


def _texts(data: bytes, place: Path) -> None:
    """Whatever is said of a text holds for every text."""
    text = data.decode("utf-8", "replace")
    comment, string = texts.comment(text), texts.string(text)
    check(comment.isascii() and comment.isprintable(), "a comment that is not one line of ASCII")
    check(
        "*/" not in comment and "/*" not in comment and not _TRIGRAPH.search(comment), "a comment that ends"
    )
    check(
        not comment.endswith(("\\", "*")) or (comment.endswith("*") and "*/" not in f"{comment} */"[:-2]),
        "an open end",
    )
    check(
        string.isascii() and string.isprintable() and not _TRIGRAPH.search(string),
        "a string that is not a line",
    )
    check('"' not in _ESCAPE.sub("", string) and "\\" not in _ESCAPE.sub("", string), "a string that ends")
    check("%" not in texts.printf(text).replace("%%", ""), "a format that prints something")
    check(not set('<"&>') & set(re.sub(r"&(amp|lt|gt|quot);", "", texts.xml(text))), "an attribute that ends")
    check("\n" not in texts.markdown(text) and "\n" not in drawn(text), "a text of several lines")
    inside = str(within_script({text: [text]}))
    check("<" not in inside and json.loads(inside) == {text: [text]}, "data that end their script")


def _names(data: bytes, place: Path) -> None:
    """A name that is taken is an identifier; one that is suggested is taken."""
    text = data.decode("utf-8", "replace")
    check(check_name(suggestion(text), "here") == suggestion(text), "a suggestion that is none")
    check(re.fullmatch("[A-Za-z][A-Za-z0-9_]{0,62}", check_name(text, "here")) is not None, "no identifier")


def one_line(error: FocgenError) -> None:
    """Raise Fault where an error would not be one line, or says nothing of the remedy."""
    printed = " ".join(str(error).split())
    check(bool(error.where and error.what and error.remedy), f"an error without {error!r}")
    check(len(printed) < 4000, f"an error of {len(printed)} characters")


_NUMBERS = b"nan inf -1 0 1e308 5e-324 1e999 9e15".split()
_TOML = (
    b'"',
    b"'''",
    b"[[",
    b"]]",
    b" = ",
    b"{",
    b"}",
    b"\n[",
    b"#",
    b"inf",
    b"nan",
    b"1e999",
    b"[transfer]\n",
    b"\r\n",
)
_JSON = (b"null", b"true", b"NaN", b"-Infinity", b"[", b"{}", b'""', b"1e999", b'":', b",")
_LOG = (
    b",",
    b";",
    b"\t",
    b"|",
    b'"',
    b"#",
    b"\r\n",
    b"12:00:00",
    b"2026-01-31",
    b" (kPa)",
    b"[m**9]",
    b"\xff\xfe",
    *_NUMBERS,
)
_LVM = (
    b"***End_of_Header***",
    b"X_Value",
    b"Channels",
    b"Separator",
    b"Multi",
    b"X_Columns",
    b"Comment",
    b"\t",
)


def _each(found: dict[str, bytes], name: str) -> Callable[[], Iterable[bytes]]:
    return lambda: [found[name]]


TARGETS = (
    Target("text", _table("log.csv"), seeds.text, 0.08, "", _LOG),
    Target("packed", _table("log.csv.gz"), seeds.packed, 0.02, "", (b"\x1f\x8b\x08",)),
    Target("lvm", _table("log.lvm"), seeds.lvm, 0.06, "", _LVM),
    Target("log", _log, seeds.text, 0.08, "", _LOG),
    Target("init", _init, seeds.text, 0.005, "", _LOG),
    Target("rig", _rig, seeds.rig, 0.12, "toml", _TOML),
    Target("controller", _controller, seeds.controller, 0.12, "toml", _TOML),
    Target("plan", _plan, seeds.controller, 0.003, "toml", _TOML),
    Target("custody", _custody, seeds.rig, 0.05, "toml", _TOML),
    Target("manifest", _manifest, seeds.manifest, 0.02, "json", _JSON),
    Target("trial", _trial, seeds.trial, 0.06, "json", _JSON),
    Target("diagnosis", _diagnosis, lambda: [seeds.diagnosis()["diagnosis.json"]], 0.06, "json", _JSON),
    Target("drawn", _drawn, lambda: [seeds.diagnosis()["signals.json"]], 0.02, "json", _JSON),
    Target("study", _study, lambda: [seeds.study()], 0.05, "json", _JSON),
    Target("verified", _verified, seeds.verified, 0.04, "json", _JSON),
    Target("costs", _costs, seeds.costs, 0.03, "json", _JSON),
    Target("texts", _texts, lambda: [b"bar", b'%s "x" */ ??/ \\'], 0.06, "", ()),
    Target(
        "names", _names, lambda: [b"spba", b"printf", b"con", b"INT32_MAX"], 0.06, "", (b"_t", b"int", b"_")
    ),
)
