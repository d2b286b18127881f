"""``diagnosis.json``, the two rigs, what figures draw, and the pictures where matplotlib is there."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import tomlkit

from focgen.diagnosis.compose import Rigs
from focgen.diagnosis.drawn import FILE, drawn_of, drawn_text, units_of_rig
from focgen.diagnosis.model import Diagnosis, Evidence
from focgen.jsontext import to_json
from focgen.logs.experiment import Experiment
from focgen.output import write_files
from focgen.rig.files import rig_table


def write(
    out: str | Path,
    diagnosis: Diagnosis,
    evidence: Evidence,
    rigs: Rigs,
    logs: Sequence[Experiment],
    drawn: bool = True,
    inputs: Sequence = (),
) -> None:
    """Write all files into ``out``, or none; pictures where they are to be ``drawn``. Raises InputError where
    one of ``inputs`` would be written over.
    """
    files: dict[str, str | bytes] = {
        "diagnosis.json": to_json(diagnosis),
        FILE: drawn_text(drawn_of(rigs.refitted, evidence, logs)),
        diagnosis.refitted_rig: tomlkit.dumps(rig_table(rigs.refitted)),
        diagnosis.augmented_rig: tomlkit.dumps(rig_table(rigs.augmented(logs))),
    }
    if drawn and find_spec("matplotlib"):
        from focgen.report.diagnosis import pictures

        files |= pictures(diagnosis, evidence, logs, units_of_rig(rigs.refitted))
    write_files(out, files, inputs)
