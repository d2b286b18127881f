"""``curves.json``: what the figures of a study draw, so that they can be drawn from its folder alone."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from focgen.control.files import controller_of, controller_table
from focgen.errors import ControllerError, InputError
from focgen.jsontext import check_tied, fits, plain, read_json, shape_of
from focgen.logs.thinning import thinned
from focgen.present import present
from focgen.studies.jobs import read_ideal, read_plant, read_row
from focgen.studies.results import Band, Curves, Plant, PlantRow, Study
from focgen.tomlfile import Table

FILE = "curves.json"
MOST = 400
"""Points of a curve that are kept."""
_DIGITS = 6
_DRAWN = (("omega", "phase_deg", "magnitude_db"), ("time", "output"))
_CURVE = [(float, None)]
_PLANT_ROW = {name: shape for name, shape in shape_of(PlantRow).items() if name != "output"}
_TOLD: dict[str, Any] = {
    **{name: shape for name, shape in shape_of(Study).items() if "curves" not in name},
    "controller": str,
    "plant": (None, {"transfer": str, "sample_time": float, "rows": [_PLANT_ROW]}),
}
"""The shape of ``study.json``; the curves are in a file of their own."""
_CURVES = {name: (float, None) if name.startswith("reference") else _CURVE for name in shape_of(Curves)}
_KEPT: dict[str, Any] = {
    "controller": dict,
    "rows": [_CURVES],
    "ideal": [_CURVES],
    "plant": (None, {"time": _CURVE, "exact": _CURVE, "outputs": [_CURVE]}),
}
_REMEDY = "name a folder that `focgen study` has written; study again where it is of an earlier version"


def curves_text(study: Study) -> str:
    """The file's content: compact JSON, curves thinned to :data:`MOST` points, numbers to six digits."""
    plant = study.plant
    value = {
        "controller": controller_table(study.controller),
        "rows": [_thin(c) for c in study.curves],
        "ideal": [_thin(c) for c in study.ideal_curves],
        "plant": plant
        and {"time": plant.time, "exact": plant.exact, "outputs": [r.output for r in plant.rows]},
    }
    return json.dumps(plain(value), ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def _thin(curves: Curves) -> dict[str, Any]:
    """The same with fewer points, peaks kept."""
    found = asdict(curves)
    for parts in _DRAWN:
        signals = [np.asarray(found[name], float) for name in parts]
        kept: Any = thinned(*signals[1:], most=MOST) if len(signals[0]) else []
        found |= {
            name: [_rounded(v) for v in signal[kept]] for name, signal in zip(parts, signals) if len(signal)
        }
    return found


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def read_study(folder: Path) -> Study:
    """The study that a folder holds, its curves thinned. Raises InputError where it holds none."""
    told, kept = (read_json(folder / name, _REMEDY) for name in ("study.json", FILE))
    try:
        if not (fits(told, _TOLD) and fits(kept, _KEPT) and _one_study(told, kept)):
            raise ValueError
        found = _study(told, kept, str(folder / FILE))
    except (TypeError, KeyError, ValueError, IndexError, AttributeError, ControllerError):
        raise InputError(str(folder), "holds no study that can be read", _REMEDY) from None
    check_tied(kept, folder / FILE, folder / "study.json", _REMEDY)
    return found


def _one_study(told: dict[str, Any], kept: dict[str, Any]) -> bool:
    """Whether curves that belong together are equally long, and rows that stand in one table have its
    columns."""
    curves = [[one[n] for n in names] for one in (*kept["rows"], *kept["ideal"]) for names in _DRAWN]
    if bool(told["plant"]) != bool(kept["plant"]):
        return False
    if told["plant"]:
        plant, rows = kept["plant"], told["plant"]["rows"]
        curves.append([plant["time"], plant["exact"], *plant["outputs"]])
        if not rows or any(row["errors"].keys() != rows[0]["errors"].keys() for row in rows):
            return False
    inside = all(0 <= i < len(told["rows"]) for front in told["pareto"].values() for i in front)
    return inside and all(len({len(values) for values in of}) == 1 for of in curves)


def _study(told: dict[str, Any], kept: dict[str, Any], where: str) -> Study:
    rows = _paired("row", told["rows"], kept["rows"], read_row)
    ideal = _paired("ideal", told["ideal"], kept["ideal"], read_ideal)
    table = Table(kept["controller"], where, ControllerError)
    return Study(
        controller=controller_of(table, told["controller"]),
        rig=told["rig"],
        band=Band(**told["band"]),
        setpoints=tuple(told["setpoints"]),
        samples=told["samples"],
        rows=tuple(row for row, _ in rows),
        ideal=tuple(one for one, _ in ideal),
        plant=_plant(told["plant"], kept["plant"]),
        pareto={cost: tuple(front) for cost, front in told["pareto"].items()},
        recommendation=told["recommendation"],
        notes=tuple(told["notes"]),
        curves=tuple(curves for _, curves in rows),
        ideal_curves=tuple(curves for _, curves in ideal),
        operators=tuple(read_row({"row": row, "curves": asdict(Curves())})[0] for row in told["operators"]),
    )


def _paired(
    key: str, values: Sequence[Any], curves: Sequence[Any], read: Callable[[dict[str, Any]], Any]
) -> list[Any]:
    if len(values) != len(curves) or any(set(c) != {f.name for f in fields(Curves)} for c in curves):
        raise ValueError(key)
    return [read({key: value, "curves": _drawn(one)}) for value, one in zip(values, curves)]


def _drawn(curves: dict[str, Any]) -> dict[str, Any]:
    """Curves as they were before JSON, which has no NaN: a point that is null is none."""
    return {name: _points(v) if isinstance(v, list) else v for name, v in curves.items()}


def _points(values: Sequence[float | None]) -> list[float]:
    return [np.nan if value is None else value for value in values]


def _plant(told: dict[str, Any] | None, kept: dict[str, Any] | None) -> Plant | None:
    if told is None:
        return None
    parts = zip(told["rows"], present(kept)["outputs"], strict=True)
    rows = tuple(read_plant({"plant": row | {"output": _points(output)}}) for row, output in parts)
    return Plant(
        told["transfer"],
        told["sample_time"],
        tuple(_points(present(kept)["time"])),
        tuple(_points(present(kept)["exact"])),
        rows,
    )
