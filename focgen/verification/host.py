"""Generated C on this computer: compiled by its compiler, loaded with cffi, run over a scenario."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from cffi import FFI

from focgen.codegen.manifest import lsbs
from focgen.codegen.render import render
from focgen.compiler import compile_shared
from focgen.plan.model import Plan
from focgen.plan.scenario import Scenario, Trace

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
"""Bit equality of the floating forms needs contraction off."""

_DTYPES = {
    "double": np.float64,
    "float": np.float32,
    "int64_t": np.int64,
    "int32_t": np.int32,
    "int16_t": np.int16,
}
_RESET, _TRACK = 1, 2


@dataclass(frozen=True)
class DriverContext:
    """Everything ``driver.c.jinja`` asks for."""

    name: str
    increment: str
    scheduled: bool
    integral: bool
    held: str
    scales: tuple[str, ...]


def driver(plan: Plan) -> str:
    """C that runs a plan's controller over arrays."""
    scheduled, integral, scales = (
        plan.schedule is not None,
        plan.integrator is not None,
        tuple(header_scales(plan)),
    )
    held = f"({plan.name}_flags(&state) & {plan.name}_FLAG_INVALID) ? 0 : " if plan.floating else ""
    context = DriverContext(plan.name, plan.increment.ctype, scheduled, integral, held, scales)
    return render("driver.c.jinja", context)


def header_scales(plan: Plan) -> dict[str, float]:
    """The values that the header's macros for LSBs and sample time must have, by name."""
    exact = plan.arithmetic == "f64"
    return {**lsbs(plan), "SAMPLE_TIME": plan.sample_time if exact else float(np.float32(plan.sample_time))}


class Library:
    """The C of one or several plans, compiled together; each plan has a name of its own.

    ``folders`` hold NAME.h, NAME.c and foc_rt.h, one a plan. Raises BuildError where they do not compile.
    """

    def __init__(self, plans: Sequence[Plan], folders: Sequence[Path], flags: Sequence[str] = FLAGS):
        self._ffi = FFI()
        with tempfile.TemporaryDirectory(prefix="focgen-") as scratch:
            sources = []
            for plan, folder in zip(plans, folders):
                drive = Path(scratch) / f"{plan.name}_driver.c"
                drive.write_text(driver(plan))
                sources += [Path(folder) / f"{plan.name}.c", drive]
                self._ffi.cdef(_declaration(plan))
            target = Path(scratch) / "controllers.so"
            compile_shared(sources, target, flags, list(dict.fromkeys(folders)))
            self._library = self._ffi.dlopen(str(target))

    def run(self, plan: Plan, scenario: Scenario) -> Trace:
        """Run raw inputs; returns raw u and d and the flags, shape (lanes, samples).

        Without an integrator d cannot be read from outside and is u.
        """
        lanes = [self._lane(plan, scenario, lane) for lane in range(scenario.lanes)]
        u, d, flags = (np.stack(part) for part in zip(*lanes))
        return Trace(u, d if plan.integrator else u, flags)

    def scales(self, plan: Plan) -> dict[str, float]:
        """What the header's macros for LSBs and sample time are."""
        names = list(header_scales(plan))
        found = self._ffi.new("double[]", len(names))
        getattr(self._library, f"{plan.name}_scales")(found)
        return dict(zip(names, found))

    def _lane(self, plan: Plan, scenario: Scenario, lane: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        signal, count = _DTYPES[plan.output.ctype], scenario.samples
        sched = scenario.ref if scenario.sched is None else scenario.sched
        inputs = [np.ascontiguousarray(x[lane], dtype=signal) for x in (scenario.ref, scenario.meas, sched)]
        event, given = _events(scenario, lane, signal)
        u, flags = np.empty(count, signal), np.empty(count, np.uint8)
        d = np.zeros(count, _DTYPES[plan.increment.ctype])
        arrays = [*inputs, event, given, u, d, flags]
        types = [plan.output.ctype] * 3 + [
            "uint8_t",
            plan.output.ctype,
            plan.output.ctype,
            plan.increment.ctype,
            "uint8_t",
        ]
        pointers = [self._ffi.cast(f"{ctype} *", a.ctypes.data) for ctype, a in zip(types, arrays)]
        getattr(self._library, f"{plan.name}_run")(count, *pointers)
        return u, d, flags


def _declaration(plan: Plan) -> str:
    signal = plan.output.ctype
    return (
        f"void {plan.name}_scales(double *); "
        f"void {plan.name}_run(uint32_t, const {signal} *, const {signal} *, const {signal} *, "
        "const uint8_t *, "
        f"const {signal} *, {signal} *, {plan.increment.ctype} *, uint8_t *);"
    )


def _events(scenario: Scenario, lane: int, signal: type) -> tuple[np.ndarray, np.ndarray]:
    """What happens ahead of each sample, and its values (ref, meas, u0, u applied)."""
    event, given = np.zeros(scenario.samples, np.uint8), np.zeros((scenario.samples, 4), signal)
    for r in scenario.resets:
        if r.lane == lane:
            event[r.sample] |= _RESET
            given[r.sample, :3] = r.ref, r.meas, r.u0
    for t in scenario.tracks:
        if t.lane == lane:
            event[t.sample] |= _TRACK
            given[t.sample, 3] = t.u
    return event, given
