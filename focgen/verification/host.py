"""Generated C on this computer: compiled by its compiler, loaded with cffi, run over a scenario."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from cffi import FFI

from focgen.arrays import Numbers
from focgen.compiler import ANEW, compile_shared
from focgen.errors import BuildError
from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario, Trace
from focgen.scratch import temporary_folder
from focgen.targets.driver import DTYPES, Answers, driver, header_scales, lane_of, steps_alone

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
"""Bit equality of the floating forms needs contraction off."""


class Library:
    """The C of one or several plans, compiled together; each plan has a name of its own.

    ``folders`` hold NAME.h, NAME.c and foc_rt.h, one a plan, and with ``selftest`` NAME_selftest.c and .h.
    Raises BuildError where they do not compile.
    """

    def __init__(
        self,
        plans: Sequence[Plan],
        folders: Sequence[Path],
        flags: Sequence[str] = FLAGS,
        selftest: bool = False,
    ) -> None:
        self._ffi = FFI()
        self.alignment = max(self._ffi.alignof(ctype) for ctype in ("int64_t", "double"))
        with temporary_folder() as scratch:
            sources = []
            for plan, folder in zip(plans, folders):
                drive = scratch / f"{plan.name}_driver.c"
                drive.write_text(driver(plan))
                sources += [Path(folder) / f"{plan.name}.c", drive]
                self._ffi.cdef(_declaration(plan))
                if selftest:
                    sources.append(Path(folder) / f"{plan.name}_selftest.c")
                    self._ffi.cdef(f"uint32_t {plan.name}_selftest(void);")
            target = scratch / "controllers.so"
            compile_shared(sources, target, flags, list(dict.fromkeys(folders)))
            try:
                self._library = self._ffi.dlopen(str(target))
            except OSError as reason:
                raise BuildError(str(sources[0]), f"does not link: {_said(reason, target)}", ANEW) from None

    def run(self, plan: Plan, scenario: Scenario) -> Trace:
        """Run raw inputs; returns raw u and d and the flags, shape (lanes, samples).

        Without an integrator d cannot be read from outside and is u.
        """
        return steps_alone(self.answers(plan, scenario).trace)

    def answers(self, plan: Plan, scenario: Scenario) -> Answers:
        """The same, with the state's bytes after every lane."""
        lanes, states = [], []
        for lane in range(scenario.lanes):
            lanes.append(self._lane(plan, scenario, lane))
            states.append(self._state(plan))
        u, d, flags = (np.stack(part) for part in zip(*lanes))
        return Answers(Trace(u, d if plan.integrator else u, flags), tuple(states))

    def selftest(self, plan: Plan) -> int:
        """What NAME_selftest() returns: 0, or the first step that is wrong."""
        return int(getattr(self._library, f"{plan.name}_selftest")())

    def scales(self, plan: Plan) -> dict[str, float]:
        """What the header's macros for LSBs and sample time are."""
        names = list(header_scales(plan))
        found = self._ffi.new("double[]", len(names))
        getattr(self._library, f"{plan.name}_scales")(found)
        return dict(zip(names, found))

    def _state(self, plan: Plan) -> bytes:
        size = self._ffi.new("uint32_t *")
        place = getattr(self._library, f"{plan.name}_bytes")(size)
        return bytes(self._ffi.buffer(place, size[0]))

    def _lane(self, plan: Plan, scenario: Scenario, lane: int) -> tuple[Numbers, Numbers, Numbers]:
        signal, count, given = DTYPES[plan.output.ctype], scenario.samples, lane_of(plan, scenario, lane)
        u, flags = np.empty(count, signal), np.empty(count, np.uint8)
        d = np.zeros(count, DTYPES[plan.increment.ctype])
        one, increment = plan.output.ctype, plan.increment.ctype
        types = [one, one, one, "uint8_t", one, one, increment, "uint8_t"]
        arrays = [*vars(given).values(), u, d, flags]
        pointers = [self._ffi.cast(f"{ctype} *", a.ctypes.data) for ctype, a in zip(types, arrays)]
        getattr(self._library, f"{plan.name}_run")(count, *pointers)
        return u, d, flags


def _said(reason: OSError, target: Path) -> str:
    """What the loader complains of, without the name of a file that is gone."""
    return str(reason).rpartition(f"{target}: ")[2].partition(".  ")[0]


def _declaration(plan: Plan) -> str:
    signal = plan.output.ctype
    return (
        f"const void *{plan.name}_bytes(uint32_t *); void {plan.name}_scales(double *); "
        f"void {plan.name}_run(uint32_t, const {signal} *, const {signal} *, const {signal} *, "
        "const uint8_t *, "
        f"const {signal} *, {signal} *, {plan.increment.ctype} *, uint8_t *);"
    )
