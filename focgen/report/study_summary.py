"""A study of the memory as text and as tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from focgen.control.controller import ARITHMETICS
from focgen.present import present
from focgen.report.page import TableOf, text_table
from focgen.studies.results import Ideal, Row, Study

_HEADS = (
    "memory",
    "arithmetic",
    "states",
    "error",
    "bound",
    "bias",
    "phase (°)",
    "settling (s)",
    "overshoot (%)",
    "margin (°)",
    "multiplies",
    "state (B)",
    "flash (B)",
    "stack (B)",
    "instructions",
    "cycles",
)


def study_text(study: Study) -> str:
    """The whole study for a terminal."""
    parts = [text_table(rows_table(study, h)) for h in sample_times(study)]
    parts.append(text_table(ideal_table(study)))
    if study.plant is not None:
        parts.append(text_table(plant_table(study)))
    parts.append(f"band: {band_text(study)}")
    parts += [f"note: {note}" for note in study.notes]
    return "\n\n".join([*parts, study.recommendation])


def sample_times(study: Study) -> list[float]:
    """The sample times looked at, the controller's own first, s."""
    own = study.controller.sample_time
    return sorted({row.sample_time for row in study.rows}, key=lambda h: (h != own, h))


def band_text(study: Study) -> str:
    """The band and why it is that."""
    band = study.band
    return f"{band.low:.3g} … {band.high:.3g} rad/s, {band.why}"


def rows_table(study: Study, sample_time: float) -> TableOf:
    """One line a variant at ``sample_time``, by arithmetic, then by cost."""
    rows = [row for row in study.rows if row.sample_time == sample_time]
    rows.sort(
        key=lambda r: (
            ARITHMETICS.index(r.arithmetic),
            r.memory == "exponential",
            r.length or 0,
            -(r.tolerance or 0.0),
        )
    )
    lines = tuple(_line(row) for row in rows)
    return _without_empty(TableOf(_HEADS, lines, f"sample time {sample_time:g} s"))


def _line(row: Row) -> tuple[str, ...]:
    return (
        row.variant.label,
        row.arithmetic,
        shown(row.states, str),
        shown(row.error, _short),
        shown(row.bound, _short),
        shown(row.dc_bias, _percent),
        shown(row.phase_error_deg, "{:.2f}".format),
        shown(row.settling_s, "{:.3f}".format),
        shown(row.overshoot_pct, "{:.1f}".format),
        shown(row.margin_deg, "{:.1f}".format),
        shown(row.multiplies, str),
        shown(row.ram_bytes, str),
        shown(row.flash_bytes, str),
        shown(row.stack_bytes, str),
        shown(row.instructions, "{:.0f}".format),
        shown(row.cycles, "{:.0f}".format),
    )


def _without_empty(table: TableOf) -> TableOf:
    """The same without the columns in which nothing stands."""
    kept = [i for i in range(len(table.heads)) if any(row[i] != "–" for row in table.rows)]
    cut = tuple(tuple(row[i] for i in kept) for row in table.rows)
    return TableOf(tuple(table.heads[i] for i in kept), cut, table.caption)


def shown(value: float | None, form: Callable[..., Any]) -> str:
    """``value`` in a form, or a dash where there is none."""
    return "–" if value is None else form(value)


def _short(value: float) -> str:
    return f"{value:.2g}" if value >= 1e-3 else f"{value:.0e}"


def _percent(value: float) -> str:
    if abs(value) < 1e-7:
        return "0"
    return f"{100 * value:+.0f} %" if abs(value) >= 0.1 else f"{100 * value:+.2g} %"


def ideal_table(study: Study) -> TableOf:
    """Infinite memory in float64, and what sampling alone costs."""
    heads = (
        "sample time (s)",
        "settling (s)",
        "overshoot (%)",
        "IAE (s)",
        "margin (°)",
        "phase lag of sampling (°)",
    )
    lines = tuple(_ideal_line(ideal) for ideal in study.ideal)
    return _without_empty(TableOf(heads, lines, "infinite memory, float64"))


def _ideal_line(ideal: Ideal) -> tuple[str, ...]:
    loop = ideal.loop
    return (
        f"{ideal.sample_time:g}",
        shown(loop.settling_s if loop else None, "{:.3f}".format),
        shown(loop.overshoot_pct if loop else None, "{:.1f}".format),
        shown(loop.iae if loop else None, "{:.4f}".format),
        shown(loop.margin_deg if loop else None, "{:.1f}".format),
        f"{ideal.sampling_phase_deg:.2f}",
    )


def plant_table(study: Study) -> TableOf:
    """The plant's step with each memory in its denominator: error after so long, and where it ends."""
    plant = present(study.plant)
    labels = tuple(plant.rows[0].errors)
    heads = ("memory", *labels, "ends at")
    lines = tuple(
        (
            f"L = {row.length}" if row.length else f"exponential, {row.states} states",
            *(f"{row.errors[label]:+.1e}" for label in labels),
            f"{row.rest:.4f}",
        )
        for row in plant.rows
    )
    return TableOf(heads, lines, f"{plant.transfer}, a step of 1: error of the simulation by its memory")
