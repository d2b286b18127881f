"""``demo``: the whole chain on the example logs, from CSV to verified C, and a sealed case diagnosed; with a
report.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import focgen
from focgen.arguments import checked
from focgen.codegen.generate import Generated, generate
from focgen.control.controller import ARITHMETICS
from focgen.custody import sha256_of, sha256_within
from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.drawn import FILE as SIGNALS
from focgen.diagnosis.drawn import read_drawn
from focgen.diagnosis.model import Diagnosis
from focgen.errors import InputError
from focgen.identification.identification import Identification
from focgen.identification.identify import identify
from focgen.journal import finish
from focgen.jsontext import ANY, fits, read_json
from focgen.loop.design import Design, design
from focgen.loop.simulate import Simulation, simulate
from focgen.output import new_folder
from focgen.progress import led_by, step
from focgen.report.control import design_pictures, simulation_pictures
from focgen.report.demo_page import demo_page
from focgen.report.identification import identification_pictures
from focgen.resources import shipped
from focgen.studies.results import Study
from focgen.studies.study import study
from focgen.textfile import LARGEST_JSON
from focgen.trials.make import make
from focgen.trials.sealing import unseal
from focgen.verification.verify import Verification, verify

_GIVEN = ("rig.toml", "logs/steps.csv", "logs/sines.csv")
_RECORD = "demo.json"
"""What the demo has written, by name and SHA-256: so the next one replaces nothing else."""
_MADE = (_RECORD, "identified.toml", "controller.toml", "report.html")
_NAMED = 3
_LOADED = 40.0  # s: the steps up to their release, as in the paper
_LENGTHS, _TOLERANCES = (50, 200, 1000), (0.1, 0.03, 1e-3, 1e-5)
_SEED = 5  # of the sealed case


@dataclass(frozen=True, eq=False, repr=False)
class Demo:
    """Everything the demo found, and the ``folder`` and ``report`` where it stands.

    ``memory`` is the study of a few lengths. ``diagnosis`` is of a rig whose effects were sealed; ``sealed``
    are their names, opened afterwards.
    """

    folder: Path
    report: Path
    identification: Identification
    design: Design
    simulation: Simulation
    memory: Study
    generated: dict[str, Generated]
    verified: dict[str, Verification]
    diagnosis: Diagnosis
    sealed: tuple[str, ...]

    def __repr__(self) -> str:
        verdict = "everything holds" if self.holds else "NOT everything holds"
        return f"<Demo {self.folder}: {verdict}; the page is {self.report}>"

    @property
    def holds(self) -> bool:
        """Whether the loop settles and all C is verified."""
        return self.design.holds and self.simulation.holds and all(v.holds for v in self.verified.values())


@checked
def demo(out: str | Path, force: bool = False) -> Demo:
    """Identify, design, simulate, generate in four arithmetics, verify, and diagnose, into the folder
    ``out``; ``force`` replaces files also where no earlier demo has written them as they are.

    Raises InputError where ``out`` cannot be written, or where a file would be lost there that somebody has
    put or edited. MissingExtra: matplotlib is not installed.
    """
    examples, target = shipped("examples"), Path(out)
    finish(target)  # what a kill has left of an earlier demo is nobody's edit
    if not force:  # before anything takes time
        given = {name: sha256_of(examples / name) for name in _GIVEN}
        _check_unedited(target, {**dict.fromkeys((*_MADE, *_recorded(target)), None), **given})
    with new_folder(out, examples.rglob("*"), lambda: () if force else _going(scratch, target)) as scratch:
        for name in _GIVEN:
            (scratch / name).parent.mkdir(exist_ok=True)
            shutil.copyfile(examples / name, scratch / name)
        made = _chain(scratch)
        (scratch / "pictures").mkdir()
        for name, content in _pictures(made).items():
            (scratch / "pictures" / name).write_bytes(content)
        page = demo_page(
            made.identification,
            made.design,
            made.simulation,
            made.memory,
            made.generated,
            made.verified,
            made.diagnosis,
            made.sealed,
            read_drawn(scratch / "diagnosis/found" / SIGNALS),
        )
        (scratch / "report.html").write_text(page.best(), encoding="utf-8")
        record = {"focgen": focgen.__version__, "files": _digests(scratch)}
        (scratch / _RECORD).write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return replace(made, folder=Path(out), report=Path(out) / "report.html")


def _digests(folder: Path) -> dict[str, str]:
    """Name → SHA-256 of all files of a folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): sha256_of(path) for path in files}


def _recorded(folder: Path) -> dict[str, str]:
    """The same of what an earlier demo has written there; nothing where there was none."""
    try:
        found = read_json(folder / _RECORD, "")
    except InputError:
        return {}
    return dict(found["files"]) if fits(found, {"focgen": str, "files": {ANY: str}}) else {}


def _going(made: Path, target: Path) -> tuple[Path, ...]:
    """Nothing goes; asked as the files are about to take their places, it looks at them once more."""
    _check_unedited(target, _digests(made))
    return ()


def _check_unedited(folder: Path, new: Mapping[str, str | None]) -> None:
    """Raise InputError, naming them, where files of these names and new digests would take the place of what
    no demo has written. A record that is none is somebody's as well."""
    recorded = _recorded(folder)
    places = [(name, folder / name) for name in new if name != _RECORD or not recorded]
    lost = [
        name
        for name, place in places
        if place.is_file() and sha256_within(place, LARGEST_JSON) not in (recorded.get(name), new[name])
    ]
    if lost:
        more = f" and {len(lost) - _NAMED} more" if len(lost) > _NAMED else ""
        what = f"{', '.join(lost[:_NAMED])}{more} would be replaced, and no demo has written that"
        raise InputError(str(folder), what, "choose another --out, or give --force to lose what stands there")


def _chain(folder: Path) -> Demo:
    rig, controller = folder / "identified.toml", folder / "controller.toml"
    step("1/7  identify: a fractional model from six steps of pressure, and six integer-order ones beside it")
    found = identify(
        folder / "rig.toml",
        [folder / "logs/steps.csv"],
        rig,
        to=_LOADED,
        unseen=[folder / "logs/sines.csv"],
    )
    step("2/7  design: the model inverted, and a gain schedule as quick as the loop allows")
    designed = design(rig, controller)
    step("3/7  simulate: the closed loop at seven set points, bit for bit as it will run")
    simulated = simulate(rig, controller)
    step("4/7  study memory: a few lengths of it, and the exponential form")
    own = (designed.controller.sample_time,)
    memory = study(
        "memory",
        controller,
        folder / "memory",
        lengths=_LENGTHS,
        tolerances=_TOLERANCES,
        arithmetic=("q31",),
        sample_times=own,
    )
    step(f"5/7  generate: C in {', '.join(ARITHMETICS)}")
    generated = {a: generate(controller, folder / "firmware" / a, a) for a in ARITHMETICS}
    step("6/7  verify: the C against the Python reference, sample for sample")
    verified = {a: verify(folder / "firmware" / a) for a in ARITHMETICS}
    step("7/7  diagnose: another rig, whose logs hold an effect that its model lacks, under seal")
    diagnosis, sealed = _blind(folder / "diagnosis")
    return Demo(
        folder,
        folder / "report.html",
        found,
        designed,
        simulated,
        memory,
        generated,
        verified,
        diagnosis,
        sealed,
    )


def _blind(folder: Path) -> tuple[Diagnosis, tuple[str, ...]]:
    """Diagnose one sealed case, then break its seal."""
    made = make(folder, cases=1, seed=_SEED, signals="C", suite="short", kinds=("single",))
    number, committed = next(iter(made.commitments.items()))
    case, seal = folder / "cases" / number, folder / "sealed" / number
    with led_by("     the signals from "):
        found = diagnose(case / "rig.toml", sorted((case / "logs").glob("*.csv")), out=folder / "found")
    label = unseal(seal / "label.json", committed, seal / "unseen", case)
    return found, tuple(effect["effect"] for effect in label["truth"])


def _pictures(made: Demo) -> dict[str, bytes]:
    """All pictures, by file name."""
    return {
        **identification_pictures(made.identification),
        **design_pictures(made.design, made.identification.rig),
        **simulation_pictures(made.simulation),
    }
