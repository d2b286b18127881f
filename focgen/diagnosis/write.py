"""``diagnosis.json``, both rigs, the proposed experiment, what figures draw, pictures where matplotlib is."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import tomlkit

from focgen.control.units import units_of_rig
from focgen.diagnosis.compose import Rigs
from focgen.diagnosis.drawn import FILE, drawn_of, drawn_text
from focgen.diagnosis.menu import Choice
from focgen.diagnosis.model import Diagnosis, Evidence
from focgen.diagnosis.next_experiment import NEXT
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
    shown = diagnosis.drawn or drawn_of(rigs.refitted, evidence, logs)
    augmented = diagnosis.augmented or rigs.augmented(logs, diagnosis.shrink)
    files: dict[str, str | bytes] = {
        "diagnosis.json": to_json(diagnosis),
        FILE: drawn_text(shown),
        diagnosis.refitted_rig: tomlkit.dumps(rig_table(rigs.refitted)),
        diagnosis.augmented_rig: tomlkit.dumps(rig_table(augmented)),
    }
    if evidence.next_input is not None:
        files[NEXT] = _next(evidence.next_input)
    if drawn and find_spec("matplotlib"):
        from focgen.report.diagnosis import pictures

        files |= pictures(diagnosis, evidence, logs, units_of_rig(rigs.refitted))
    write_files(out, files, inputs)


def _next(choice: Choice) -> str:
    """The input of the experiment that is proposed, as a table: seconds, and the input in the log's unit."""
    per = choice.reach.coarse
    values = np.repeat(choice.input, per)
    times = np.arange(len(values)) * (choice.reach.h / per)
    return "time_s,input\n" + "".join(f"{t:.9g},{u:.7g}\n" for t, u in zip(times, values))
