"""``report``: one page of whatever the commands have written: a chain, a study, a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from focgen.arguments import checked
from focgen.codegen.generate import Generated
from focgen.control.controller import Controller
from focgen.control.files import read_controller
from focgen.custody import sha256_of
from focgen.diagnosis.drawn import FILE as SIGNALS
from focgen.diagnosis.drawn import read_drawn
from focgen.errors import FocgenError, InputError
from focgen.identification.identification import Identification
from focgen.journal import finish
from focgen.jsontext import fits, read_json
from focgen.logs.experiment import Experiment
from focgen.loop.design import Design
from focgen.loop.simulate import simulate
from focgen.output import check_apart, write_file
from focgen.replaced import check_page
from focgen.report.interactive import library
from focgen.report.page import Page, Section
from focgen.report.pages.chain import (
    controller_section,
    firmware_section,
    replay_section,
    rig_section,
    verification_section,
)
from focgen.report.pages.control import simulation_sections
from focgen.report.pages.diagnosis import diagnosis_page
from focgen.report.pages.files import read_diagnosis
from focgen.report.pages.study import study_page
from focgen.report.verified import folder_of, read_verified
from focgen.rig.files import read_rig
from focgen.rig.proposal import Proposal
from focgen.rig.replay import experiments, replay
from focgen.rig.rig import Actuator, Rig
from focgen.scratch import real
from focgen.studies.kept import FILE as CURVES
from focgen.studies.kept import read_study
from focgen.textfile import LARGEST_SETTING, read_regular
from focgen.tomlfile import parsed
from focgen.verification.folder import read_folder

_TAKEN = (
    "name a rig or a controller (.toml), a folder of generate, study or diagnose, what `verify --json` "
    "printed (.json), or logs beside their rig"
)
_PROOF = {"node": str, "worst": (float, None), "type": str, "margin_bits": (float, None), "how": str}
_MANIFEST = {
    "name": str,
    "arithmetic": str,
    "memory": str,
    "sample_time": float,
    "proofs": [_PROOF],
    "error_bound": {"quantisation": {"operator": float}},
    "sizes": {"state_bytes": int, "table_bytes": int},
}


@dataclass
class _Chain:
    """What lies on the way from a model to C, as it is found among the paths."""

    rig: Rig | None = None
    controller: Controller | None = None
    source: Path | None = None  # of the controller, where it is a file
    rig_source: Path | None = None
    logs: list[Path] = field(default_factory=list)
    folders: dict[Path, dict[str, Any]] = field(default_factory=dict)  # their manifests
    verified: dict[Path, dict[str, Any]] = field(default_factory=dict)
    found: list[Page] = field(default_factory=list)  # studies and diagnoses: pages by themselves


Part = str | Path | Rig | Controller | Proposal | Identification | Design | Generated
"""A part of a page: a path, or what the commands of the chain make in memory."""


@checked
def report(paths: Part | Sequence[Part], out: str | Path) -> Path:
    """Write one self-contained HTML page of ``paths`` to the file ``out``, and return it.

    A path is a rig or a controller, a log to be replayed with the rig, a folder that generate, study or
    diagnose has written, or a file with what ``focgen verify --json`` printed. Rigs, controllers and the
    results of init, identify, design and generate are taken as they are. Rig and controller together are
    simulated; nothing is compiled or run. Raises InputError for what is none of these, MissingExtra where
    Bokeh is not installed.
    """
    if isinstance(paths, (list, tuple)) and not paths:
        raise InputError("report", "is given nothing to show", _TAKEN)
    parts = [_part(one) for one in (paths if isinstance(paths, (list, tuple)) else (paths,))]
    places = [part for part in parts if isinstance(part, Path)]
    library()  # before anything takes time
    check_apart([out], [path for given in places for path in _files(given)])
    check_page(out)
    write_file(out, page_of(parts).self_contained(), [path for path in places if path.is_file()])
    return Path(out)


def _part(given: object) -> Path | Rig | Controller:
    """The path, the rig or the controller that an argument is or holds."""
    if isinstance(given, (Proposal, Identification)):
        return given.rig
    if isinstance(given, Design):
        return given.controller
    if isinstance(given, Generated):
        return given.folder
    if isinstance(given, (Rig, Controller)):
        return given
    if isinstance(given, (str, PathLike)):
        return Path(given)
    raise InputError("report", f"takes no {type(given).__name__}", _TAKEN)


def _files(path: Path) -> list[Path]:
    return (
        sorted(p for p in path.iterdir() if p.is_file() and p.suffix != ".html") if path.is_dir() else [path]
    )


def page_of(parts: Sequence[Path | Rig | Controller]) -> Page:
    """The page of what the parts hold. Raises InputError for a path that is nothing a page is made of."""
    chain = _Chain()
    for part in parts:
        if isinstance(part, Path):
            _take(part, chain)
        else:
            _take_object(part, part.name, chain)
    if chain.logs and chain.rig is None:
        raise InputError(str(chain.logs[0]), "is a log without a rig", "name its rig.toml as well")
    sections = _sections(chain)
    if len(chain.found) == 1 and not sections:
        return chain.found[0]
    for page in chain.found:
        sections.append(Section(page.title, (page.lead,)))
        sections += page.sections
    return Page(_title(chain), _lead(chain), tuple(sections))


def _take(path: Path, chain: _Chain) -> None:
    """Put what a path holds in its place."""
    if path.is_dir():
        _take_folder(path, chain)
    elif path.name in ("diagnosis.json", "study.json", "manifest.json", SIGNALS, CURVES):
        _take_folder(path.parent, chain)
    elif path.suffix == ".json":
        chain.verified[path] = read_verified(path)
    elif path.suffix == ".toml":
        _take_toml(path, chain)
    elif path.suffix in (".html", ".htm", ".png", ".c", ".h", ".md"):
        raise InputError(str(path), "is nothing that a report is made of", _TAKEN)
    elif not path.exists():
        raise InputError(str(path), "does not exist", f"check the path; {_TAKEN}")
    else:
        chain.logs.append(path)


def _take_folder(folder: Path, chain: _Chain) -> None:
    finish(folder)
    if (folder / "diagnosis.json").is_file():
        chain.found.append(_diagnosis(folder))
    elif (folder / "study.json").is_file():
        chain.found.append(study_page(read_study(folder)))
    elif (folder / "manifest.json").is_file():
        chain.folders[folder] = _manifest(folder / "manifest.json")
    else:
        raise InputError(str(folder), "holds no diagnosis.json, study.json or manifest.json", _TAKEN)


def _take_toml(path: Path, chain: _Chain) -> None:
    """A rig has signals, a controller a transfer function."""
    try:
        controller = "transfer" in parsed(read_regular(path, LARGEST_SETTING).decode("utf-8"))
    except (OSError, ValueError, RecursionError, InputError):
        controller = False  # the reader of rigs says what is wrong
    if controller:
        chain.source = path
    else:
        chain.rig_source = path
    _take_object(read_controller(path) if controller else read_rig(path), str(path), chain)


def _take_object(one: Rig | Controller, where: str, chain: _Chain) -> None:
    """Put a rig or a controller in its place. Raises InputError where one is there."""
    what = "rig" if isinstance(one, Rig) else "controller"
    if getattr(chain, what) is not None:
        raise InputError(where, f"is a second {what}", f"make a page of one {what} at a time")
    setattr(chain, what, one)


def _diagnosis(folder: Path) -> Page:
    found = read_diagnosis(folder / "diagnosis.json")
    drawn = read_drawn(folder / SIGNALS) if (folder / SIGNALS).exists() else None
    refitted = folder / Path(found.refitted_rig).name
    name = read_rig(refitted).name if refitted.is_file() else real(folder).name
    return diagnosis_page(found, drawn, name)


def _manifest(path: Path) -> dict[str, Any]:
    remedy = "name a folder that `focgen generate` has written"
    value: dict[str, Any] = read_json(path, remedy)
    if not fits(value, _MANIFEST):
        raise InputError(str(path), "is no manifest", remedy)
    return value


def _sections(chain: _Chain) -> list[Section]:
    """The chain in the order in which it is gone."""
    rig, sections = chain.rig, []
    if rig is not None:
        sections.append(rig_section(rig))
    if chain.logs and rig is not None:
        logs: tuple[Experiment, ...] = experiments(rig, chain.logs)
        sections.append(replay_section(rig, logs, replay(rig, logs)))
    if chain.controller is not None:
        sections.append(controller_section(chain.controller, _digest(chain.rig_source)))
        if rig is not None and isinstance(rig.actuator, Actuator):
            sections += simulation_sections(simulate(rig, chain.controller))
    made_from = _digest(chain.source)
    folders = (firmware_section(made, made_from, _faults(at)) for at, made in chain.folders.items())
    return [*sections, *folders, *_verifications(chain)]


def _digest(path: Path | None) -> str | None:
    return None if path is None else sha256_of(path)


def _faults(folder: Path) -> tuple[str, ...]:
    """What of a generated folder is not as its controller.toml gives it, so that nothing is proved of it."""
    try:
        return read_folder(folder).differences
    except FocgenError as reason:
        return (f"whether this is the C in {folder} was not looked at: it {reason.what}",)


def _verifications(chain: _Chain) -> Iterator[Section]:
    """Yield what was verified; of a folder that the page shows, where it shows one."""
    for path, found in chain.verified.items():
        yield verification_section(found, folder_of(path, found, list(chain.folders)))


def _title(chain: _Chain) -> str:
    names = [one.name for one in (chain.rig, chain.controller) if one is not None]
    return f"From the model to the C: {names[0]}" if names else "What focgen found"


def _lead(chain: _Chain) -> str:
    """What the page holds, in the order of the chain."""
    parts = [
        "the model" * (chain.rig is not None),
        "logs beside it" * bool(chain.logs),
        "the controller" * (chain.controller is not None),
        "the closed loop of both" * (chain.rig is not None and chain.controller is not None),
        "the generated C" * bool(chain.folders),
        "its verification" * bool(chain.verified),
        *(page.title[:1].lower() + page.title[1:] for page in chain.found),
    ]
    return f"This page shows {', '.join(part for part in parts if part)}."
