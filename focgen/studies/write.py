"""The study's folder: study.json, curves.json, the pictures, and the page."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from focgen.jsontext import tied
from focgen.output import former, write_files
from focgen.present import present
from focgen.shown import files_of
from focgen.studies.kept import FILE, curves_text
from focgen.studies.results import Study

DRAWN = ("accuracy.png", "pareto.png", "frequency.png", "loops.png", "plant.png", "report.html")
WRITTEN = ("study.json", FILE, *DRAWN)
"""All that a study may write beside its answers."""


def write(study: Study, folder: Path, inputs: Iterable[Any] = ()) -> None:
    """Write all of it, or none. Pictures and page where matplotlib is installed. Raises InputError where one
    of ``inputs`` would be written over.
    """
    told = json.dumps(payload(study), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    files: dict[str, str | bytes] = {
        "study.json": told,
        FILE: tied(curves_text(study), told),
    }
    files |= files_of(study)
    write_files(folder, files, inputs, former(folder, "study.json", DRAWN, files))


def payload(study: Study) -> dict[str, Any]:
    """What ``focgen study memory --json`` carries."""
    controller = study.controller
    return {
        "subject": "memory",
        "controller": controller.name,
        "transfer": str(controller.transfer),
        "rig": study.rig,
        "band": asdict(study.band),
        "samples": study.samples,
        "setpoints": list(study.setpoints),
        "rows": [asdict(row) for row in study.rows],
        "pareto": {cost: list(front) for cost, front in study.pareto.items()},
        "ideal": [asdict(ideal) for ideal in study.ideal],
        "plant": None if study.plant is None else _plant(study),
        "operators": [asdict(row) for row in study.operators],
        "recommendation": study.recommendation,
        "notes": list(study.notes),
    }


def _plant(study: Study) -> dict[str, Any]:
    rows = [{k: v for k, v in asdict(row).items() if k != "output"} for row in present(study.plant).rows]
    return {
        "transfer": present(study.plant).transfer,
        "sample_time": present(study.plant).sample_time,
        "rows": rows,
    }
