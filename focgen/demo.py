"""``demo``: the whole chain on the example logs, from CSV to verified C, with a report."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

from focgen.codegen.generate import Generated, generate
from focgen.control.controller import ARITHMETICS
from focgen.identification.identify import identify
from focgen.identification.model import Identification
from focgen.loop.design import Design, design
from focgen.loop.simulate import Simulation, simulate
from focgen.output import new_folder
from focgen.progress import say
from focgen.report.control import design_pictures, simulation_pictures
from focgen.report.demo_page import demo_page
from focgen.report.identification import identification_pictures
from focgen.resources import shipped
from focgen.verification.verify import Verification, verify

@dataclass(frozen=True, eq=False)
class Demo:
    """Everything the demo found, and the ``folder`` and ``report`` where it stands."""

    folder: Path
    report: Path
    identification: Identification
    design: Design
    simulation: Simulation
    generated: dict[str, Generated]
    verified: dict[str, Verification]

    @property
    def holds(self) -> bool:
        """Whether the loop settles and all C is verified."""
        return self.design.holds and self.simulation.holds and all(v.holds for v in self.verified.values())


def demo(out: str | Path) -> Demo:
    """Identify, design, simulate, generate in four arithmetics and verify, into the folder ``out``.

    Raises InputError where ``out`` cannot be written, MissingExtra where matplotlib is not installed.
    """
    examples = shipped("examples")
    with new_folder(out) as scratch:
        for name in ("rig.toml", "logs/steps.csv", "logs/sines.csv"):
            (scratch / name).parent.mkdir(exist_ok=True)
            shutil.copyfile(examples / name, scratch / name)
        made = _chain(scratch)
        (scratch / "pictures").mkdir()
        for name, content in _pictures(made).items():
            (scratch / "pictures" / name).write_bytes(content)
        page = demo_page(made.identification, made.design, made.simulation, made.generated, made.verified)
        (scratch / "report.html").write_text(page.html(), encoding="utf-8")
    return replace(made, folder=Path(out), report=Path(out) / "report.html")


def _chain(folder: Path) -> Demo:
    rig, controller = folder / "identified.toml", folder / "controller.toml"
    say("1/5  identify: a fractional model from six steps of pressure, and six integer-order ones beside it")
    found = identify([folder / "logs/steps.csv"], folder / "rig.toml", rig, unseen=[folder / "logs/sines.csv"])
    say("2/5  design: the model inverted, and a gain schedule as quick as the loop allows")
    designed = design(rig, controller)
    say("3/5  simulate: the closed loop at seven set points, bit for bit as it will run")
    simulated = simulate(rig, controller)
    say(f"4/5  generate: C in {', '.join(ARITHMETICS)}")
    generated = {a: generate(controller, folder / "firmware" / a, a) for a in ARITHMETICS}
    say("5/5  verify: the C against the Python reference, sample for sample")
    verified = {a: verify(folder / "firmware" / a) for a in ARITHMETICS}
    return Demo(folder, folder / "report.html", found, designed, simulated, generated, verified)


def _pictures(made: Demo) -> dict[str, bytes]:
    """All pictures, by file name."""
    return {**identification_pictures(made.identification), **design_pictures(made.design, made.identification.rig),
            **simulation_pictures(made.simulation)}
