"""``diagnosis.json``, both rigs, the proposed experiment, what figures draw, pictures where matplotlib is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from focgen.diagnosis.drawn import FILE, drawn_text
from focgen.diagnosis.model import Diagnosis
from focgen.diagnosis.proposals.menu import Choice
from focgen.diagnosis.proposals.next_experiment import NEXT
from focgen.jsontext import tied, to_json
from focgen.output import former, write_files
from focgen.rig.files import rig_table
from focgen.shown import files_of

PICTURES = ("ladder.png", "residual.png", "loops.png", "waterfall.png", "candidates.png")
"""All that may be drawn of a diagnosis."""


def write(
    out: str | Path,
    diagnosis: Diagnosis,
    proposed: Choice | None,
    pictures: bool = True,
    inputs: Sequence[Any] = (),
) -> None:
    """Write all files of a diagnosis just made into ``out``, or none; with the experiment that is
    ``proposed``, and ``pictures`` where matplotlib is installed. Raises InputError where one of ``inputs``
    would be written over.
    """
    drawn, refitted, augmented = diagnosis.drawn, diagnosis.refitted, diagnosis.augmented
    assert drawn and refitted and augmented  # None only where it was read from a file
    told = to_json(diagnosis)
    files: dict[str, str | bytes] = {
        "diagnosis.json": told,
        FILE: tied(drawn_text(drawn), told),
        diagnosis.refitted_rig: tomlkit.dumps(rig_table(refitted)),
        diagnosis.augmented_rig: tomlkit.dumps(rig_table(augmented)),
    }
    if proposed is not None:
        files[NEXT] = _next(proposed)
    files |= files_of(diagnosis) if pictures else {}
    write_files(out, files, inputs, former(out, "diagnosis.json", (NEXT, *PICTURES), files))


def _next(choice: Choice) -> str:
    """The input of the experiment that is proposed, as a table: seconds, and the input in the log's unit."""
    per = choice.limits.coarse
    values = np.repeat(choice.logged, per)
    times = np.arange(len(values)) * (choice.limits.h / per)
    return "time_s,input\n" + "".join(f"{t:.9g},{u:.7g}\n" for t, u in zip(times, values))
