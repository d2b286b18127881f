"""``manifest.json``: what was generated, from what, and what is proved of it."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any

import focgen
from focgen.codegen.kernels import PORTABLE, Kernels, named_sums
from focgen.codegen.selftest import selftest_entry
from focgen.codegen.state import plain_bytes, size_of, state_bytes
from focgen.errors import InputError
from focgen.fractional.elementary import rounded_up
from focgen.jsontext import read_json
from focgen.plan.canonical import memory_bias
from focgen.plan.least_error import smallest_error
from focgen.plan.plan import (
    FLAG_HIGH,
    FLAG_INPUT,
    FLAG_INVALID,
    FLAG_LOW,
    FLAG_SCHEDULE,
    Bank,
    ErrorBound,
    Plan,
    Proof,
    Sum,
)
from focgen.plan.remarks import remarks
from focgen.plan.tuning import default_params
from focgen.plan.usable import EXPONENT
from focgen.present import present


def read_manifest(folder: Path, file: str = "manifest.json") -> dict[str, Any]:
    """What an earlier run has recorded in a folder; empty where there is nothing that can be read."""
    try:
        found = read_json(folder / file, "")
    except InputError:
        return {}
    return found if isinstance(found, dict) else {}


def is_generated(manifest: dict[str, Any]) -> bool:
    """Whether it says that focgen made it, of whatever version: many tools have a manifest.json."""
    made_by = manifest.get("generator")
    return (
        isinstance(made_by, str) and made_by.startswith("focgen ") and isinstance(manifest.get("files"), dict)
    )


def sha256(data: str | bytes) -> str:
    """SHA-256 of text (UTF-8) or bytes, as hexadecimal text."""
    return hashlib.sha256(data.encode("utf-8") if isinstance(data, str) else data).hexdigest()


def manifest_of(
    plan: Plan,
    inputs: dict[str, str],
    selftest: bool = False,
    kernels: Kernels = PORTABLE,
    floats: bool = True,
) -> dict[str, Any]:
    """The manifest of a plan; ``inputs`` maps every input to its SHA-256; ``selftest``: has it one?
    ``floats``: has its header conversions?

    ``kernels`` leave a mark only where a target was named.
    """
    return {
        "name": plan.name,
        "generator": f"focgen {focgen.__version__}",
        "arithmetic": plan.arithmetic,
        "memory": plan.memory,
        "length": plan.length,
        "operator": plan.operator,
        **_exponential(plan),
        "sample_time": plan.sample_time,
        **lsbs(plan),
        "ranges": _ranges(plan),
        "flags": flags(plan),
        **({"tunable": tunable_entry(plan)} if plan.tuning else {}),
        **({"usable_below": 2.0 ** EXPONENT[plan.output.ctype]} if plan.floating else {}),
        "proofs": [proof_entry(proof) for proof in plan.proofs],
        "error_bound": bound_entry(plan.error_bound),
        **_least(plan),
        **({"setpoint_filter": plan.controller.setpoint_filter} if plan.set_point else {}),
        **({} if plan.controller.slew_limit is None else {"slew_limit": plan.controller.slew_limit}),
        "memory_bias": _bias(plan),
        **({"kernels": kernel_entry(plan, kernels)} if kernels.target else {}),
        "sizes": sizes(plan, kernels),
        **({"selftest": selftest_entry(plan)} if selftest else {}),
        **({} if floats else {"no_float": True}),
        "inputs": inputs,
    }


def lsbs(plan: Plan) -> dict[str, float]:
    """The physical size of one count, under the names the header gives them."""
    found = {"REF_LSB": plan.error.lsb, "U_LSB": plan.output.lsb}
    if plan.schedule:
        found["SCHED_LSB"] = plan.schedule.signal.lsb
    return found


def flags(plan: Plan) -> dict[str, int]:
    """The bits that NAME_flags can show, under the names the header gives them after FLAG_."""
    found = {"HIGH": FLAG_HIGH, "LOW": FLAG_LOW}
    if plan.schedule:
        found["SCHEDULE"] = FLAG_SCHEDULE
    return {**found, **({"INVALID": FLAG_INVALID} if plan.floating else {"INPUT": FLAG_INPUT})}


def _ranges(plan: Plan) -> dict[str, list[float]]:
    spans = vars(plan.controller.ranges)
    return {key: list(span) for key, span in spans.items() if span is not None}


def proof_entry(proof: Proof) -> dict[str, Any]:
    """One node: its worst case and limit in counts, the margin in bits, and how it was proved."""
    margin = None if math.isinf(proof.margin_bits) else round(proof.margin_bits, 3)
    return {
        "node": proof.node,
        "worst": proof.worst,
        "type": proof.ctype,
        "limit": proof.limit,
        "margin_bits": margin,
        "how": proof.how,
    }


def bound_entry(bound: ErrorBound) -> dict[str, Any]:
    """The two parts of the error bound, in physical units; in six digits, rounded upwards."""
    quantisation = {
        "operator": rounded_up(bound.operator),
        "output_per_sample": rounded_up(bound.output_per_sample),
        "parts": {cause: rounded_up(value) for cause, value in bound.parts},
    }
    if bound.operator_per_sample:
        quantisation["operator_per_sample"] = rounded_up(bound.operator_per_sample)
    truncation = {"operator": None if bound.truncation is None else rounded_up(bound.truncation)}
    if bound.within_horizon is not None:
        truncation["within_horizon"] = rounded_up(bound.within_horizon)
    return {"quantisation": quantisation, "truncation": truncation}


def _exponential(plan: Plan) -> dict[str, Any]:
    """What was asked of an exponential memory, what it costs, and what is proved of each order: of its
    weights, or of its response in the band (rad/s)."""
    if not plan.exponential:
        return {}
    return {
        "tolerance": plan.tolerance,
        **({"band": list(plan.band)} if plan.band else {"horizon": plan.horizon}),
        "states": plan.states,
        "multiplies": plan.multiplies,
        "orders": [
            {"order": memory.order, "states": memory.states, "tolerance": rounded_up(memory.tolerance)}
            for memory in plan.memories
        ],
        "compensated": any(bank.compensated for table in plan.sums for bank in table.banks),
    }


def _least(plan: Plan) -> dict[str, Any]:
    """The steady error, physical, from which on the integral always moves, and what it cannot hold."""
    least, said = smallest_error(plan), remarks(plan)
    return {
        **({} if least is None else {"smallest_error": rounded_up(least)}),
        **({"remarks": said} if said else {}),
    }


def _bias(plan: Plan) -> list[dict[str, float]]:
    """What each term reads of a constant, instead of 0, since the memory ends: T s^alpha at rest."""
    if plan.exponential:
        return []
    keys = ("coefficient", "order", "bias")
    return [dict(zip(keys, row)) for row in memory_bias(plan.controller, plan.length)]


def kernel_entry(plan: Plan, kernels: Kernels) -> dict[str, Any]:
    """The target, and of every sum: its form, taps, bytes of tables (and of those the plain form has), and
    bytes of state beside its ring."""
    found = {}
    for name, table in named_sums(plan).items():
        ahead = kernels.ahead(plan, table)
        found[name] = {
            "form": "look-ahead" if ahead else "halves" if kernels.long(plan) else "plain",
            "taps": table.taps,
            "table_bytes": _sum_bytes(plan, table, kernels),
            "plain_table_bytes": plain_bytes(plan, table),
            "state_bytes": ahead.state_bytes(size_of(table.blocks[0].sum.ctype)) if ahead else 0,
        }
    return {"target": kernels.target, "sums": found}


def sizes(plan: Plan, kernels: Kernels = PORTABLE) -> dict[str, int]:
    """Bytes of the state (types aligned to their size, as on 32-bit cores) and of the constant tables."""
    return {"state_bytes": state_bytes(plan, kernels), "table_bytes": _table_bytes(plan, kernels)}


def _table_bytes(plan: Plan, kernels: Kernels) -> int:
    total = sum(_sum_bytes(plan, table, kernels) for table in named_sums(plan).values())
    if plan.tuning:
        return total + _tuning_bytes(plan)
    if plan.schedule:
        counts = len(plan.schedule.breakpoints) + len(plan.schedule.gains) + len(plan.schedule.slopes)
        total += counts * size_of(plan.error.ctype) + (0 if plan.floating else len(plan.schedule.slopes))
    return total


def _tuning_bytes(plan: Plan) -> int:
    """Of breakpoints, nominal gains, reciprocals and shifts."""
    one, segments = size_of(plan.error.ctype), len(present(plan.tuning).reciprocals)
    points = len(plan.schedule.breakpoints) if plan.schedule else 0
    per = one if plan.floating else 4 + 2
    return (points + len(present(plan.tuning).nominal)) * one + segments * per


def tunable_entry(plan: Plan) -> dict[str, Any]:
    """The box in physical units, the size of a factor's count, and the default in counts."""
    box, default = present(plan.controller.tunable), default_params(plan)
    return {
        "gains": list(plan.controller.gains),
        "gain": list(box.gain),
        "output_low": list(box.output_low),
        "output_high": list(box.output_high),
        "GAIN_LSB": present(plan.tuning).factor.lsb,
        "default": {"gain": list(default.gain), "u_min": default.u_min, "u_max": default.u_max},
    }


def _sum_bytes(plan: Plan, table: Sum, kernels: Kernels) -> int:
    ahead = kernels.ahead(plan, table)
    if ahead is not None:
        return ahead.table_bytes(size_of(plan.error.ctype))
    return plain_bytes(plan, table) + sum(bank.modes * _mode_bytes(bank) for bank in table.banks)


def _mode_bytes(bank: Bank) -> int:
    """Of a rate and a weight, which share a struct."""
    return 2 * max(size_of(bank.rate.ctype), size_of(bank.drive.ctype))
