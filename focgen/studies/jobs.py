"""One piece of a study: a pure function of its inputs, so that any machine gives the same answer."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import focgen
from focgen.control.files import controller_text
from focgen.errors import PlanError
from focgen.plan.build import build_plan
from focgen.plan.canonical import memory_bias, realise
from focgen.plan.plan import Plan
from focgen.present import present
from focgen.resources import shipped
from focgen.rig.files import rig_text
from focgen.studies.closed import Steps, ideal_loop, running_loop
from focgen.studies.costs import costs
from focgen.studies.operator import fractional_terms, measure, variant_of
from focgen.studies.plant import plant_of, plant_row
from focgen.studies.results import Curves, Ideal, Loop, PlantRow, Row, Setup, Variant
from focgen.studies.spectrum import Spectrum, memory_spectrum, omegas, sampling_spectrum

_FORMAT = 1  # of a stored answer

T = TypeVar("T", Row, Curves, PlantRow)


@dataclass(frozen=True)
class Job:
    """``kind``: "row", "ideal" or "plant"; what is asked of ``variant``."""

    kind: str
    setup: Setup
    variant: Variant

    @property
    def key(self) -> str:
        """A hash of everything the answer depends on."""
        setup = self.setup
        content = {
            "format": _FORMAT,
            "code": _code(),
            "kind": self.kind,
            "variant": asdict(self.variant),
            "controller": controller_text(setup.controller),
            "rig": None if setup.rig is None else rig_text(setup.rig),
            "band": [setup.band.low, setup.band.high],
            "samples": setup.samples,
            "setpoints": list(setup.setpoints),
            "target": setup.target,
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode("utf-8")).hexdigest()


@cache
def _code() -> str:
    """A hash of this program: another state of it may answer otherwise."""
    digest, package = hashlib.sha256(), Path(focgen.__file__).parent
    for folder in (package, shipped("templates"), shipped("c_runtime")):
        for path in sorted(p for p in folder.rglob("*") if p.suffix in (".py", ".jinja", ".h", ".c")):
            digest.update(path.relative_to(folder).as_posix().encode("utf-8") + b"\0" + path.read_bytes())
    return digest.hexdigest()


def answer(job: Job) -> dict[str, Any]:
    """Do the job; returns what JSON can carry: ``row``, ``ideal`` or ``plant``, and ``curves``."""
    return {"row": _row, "ideal": _ideal, "plant": _plant}[job.kind](job.setup, job.variant)


def _row(setup: Setup, variant: Variant) -> dict[str, Any]:
    controller = variant_of(setup.controller, variant)
    try:
        plan = build_plan(controller)
        row, curves = _measured(setup, variant, plan)
    except PlanError as reason:
        row, curves = Row(**asdict(variant), note=str(reason)), Curves()
    return {"row": asdict(row), "curves": asdict(curves)}


def _measured(setup: Setup, variant: Variant, plan: Plan) -> tuple[Row, Curves]:
    controller = plan.controller
    at = omegas(setup.band, controller.sample_time)
    opened = measure(controller, plan, setup.controller.sample_time, setup.samples, at)
    spectrum = memory_spectrum(controller, plan, setup.band)
    cost = costs(plan, setup.target)
    base, steps = replace(setup.controller, sample_time=variant.sample_time), None
    if setup.rig is not None:
        steps = running_loop(base, setup.rig, setup.setpoints, plan)
    row = Row(
        **asdict(variant),
        states=plan.states or None,
        error=opened.error,
        errors=opened.errors,
        bound=opened.bound,
        error_ahead=opened.error_ahead,
        error_s=opened.error_s,
        dc_bias=_dc_bias(plan),
        operator_bias=_operator_bias(plan),
        phase_error_deg=float(np.abs(spectrum.phase_deg).max()),
        magnitude_error_db=float(np.abs(spectrum.magnitude_db).max()),
        phase_from_rad_s=spectrum.good_from,
        **(asdict(steps.loop) if steps else {}),
        **asdict(cost),
    )
    return row, _curves(spectrum, steps)


def _dc_bias(plan: Plan) -> float | None:
    """The gain for constants as the plan has it, against the right one."""
    right = realise(plan.controller).steady_gain
    if plan.inner is not None or right == 0.0:
        return None
    still = sum(present(plan.direct).values)
    if plan.feedback is not None:
        still /= 1.0 + sum(plan.feedback.table.values)
    return float(still / right - 1.0)


def _operator_bias(plan: Plan) -> float:
    """Γ(L+1−α)/(Γ(1−α) L!), the largest."""
    controller = plan.controller
    if plan.exponential:
        return 0.0
    rows = memory_bias(controller, plan.length)
    powers = {t.order for t in fractional_terms(controller)}
    return max((abs(b / (c * controller.sample_time**-o)) for c, o, b in rows if o in powers), default=0.0)


def _ideal(setup: Setup, variant: Variant) -> dict[str, Any]:
    base = replace(setup.controller, sample_time=variant.sample_time)
    spectrum = sampling_spectrum(base, setup.band)
    steps = ideal_loop(base, setup.rig, setup.setpoints) if setup.rig is not None else None
    found = Ideal(
        variant.sample_time,
        float(np.abs(spectrum.phase_deg).max()),
        float(np.abs(spectrum.magnitude_db).max()),
        steps.loop if steps else None,
    )
    return {"ideal": asdict(found), "curves": asdict(_curves(spectrum, steps))}


def _plant(setup: Setup, variant: Variant) -> dict[str, Any]:
    return {"plant": asdict(plant_row(present(plant_of(setup.controller, setup.rig)), variant))}


def _curves(spectrum: Spectrum, steps: Steps | None) -> Curves:
    parts = (spectrum.omega, spectrum.phase_deg, spectrum.magnitude_db)
    omega, phase, magnitude = (tuple(map(float, part[::2])) for part in parts)
    if steps is None:
        return Curves(omega, phase, magnitude)
    time, output = (tuple(map(float, part)) for part in (steps.time, steps.output))
    return Curves(omega, phase, magnitude, time, output, steps.reference)


def read_row(found: dict[str, Any]) -> tuple[Row, Curves]:
    """A stored row as it was."""
    return _read(Row, found["row"]), _read(Curves, found["curves"])


def read_ideal(found: dict[str, Any]) -> tuple[Ideal, Curves]:
    """A stored ideal as it was."""
    loop = found["ideal"]["loop"]
    ideal = Ideal(**{**found["ideal"], "loop": None if loop is None else Loop(**loop)})
    return ideal, _read(Curves, found["curves"])


def read_plant(found: dict[str, Any]) -> PlantRow:
    """A stored row of the plant as it was."""
    return _read(PlantRow, found["plant"])


def _read(kind: type[T], values: dict[str, Any]) -> T:
    names = {f.name for f in fields(kind)}
    given: dict[str, Any] = {
        k: tuple(v) if isinstance(v, list) else v for k, v in values.items() if k in names
    }
    return kind(**given)
