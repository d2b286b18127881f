"""The C of one generated folder, compiled for this computer and called through cffi."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from cffi import FFI

from focgen.arrays import Numbers
from focgen.codegen.render import render
from focgen.compiler import ANEW, compile_shared
from focgen.errors import BuildError
from focgen.plan.plan import Plan
from focgen.plan.scenario import Params
from focgen.scratch import temporary_folder
from focgen.targets.driver import DTYPES
from focgen.verification.host import FLAGS


@dataclass(frozen=True)
class _Glue:
    """Everything ``loaded.c.jinja`` asks for."""

    name: str
    scheduled: bool


class Machine:
    """A controller's C. It keeps no state of its own: :meth:`state` makes any number of them.

    ``init``, ``reset``, ``step``, ``track`` and ``flags`` are the C's functions; each takes a state first.
    So does ``tune`` of a tunable controller, and both it and ``check`` take what :meth:`params` makes.
    """

    init: Callable[..., None]
    reset: Callable[..., None]
    step: Callable[..., Any]
    track: Callable[..., None]
    flags: Callable[..., int]
    default: Callable[..., None]
    check: Callable[..., int]
    tune: Callable[..., int]

    def __init__(self, plan: Plan, folder: Path) -> None:
        """Compile the C in ``folder``. Raises BuildError where that fails."""
        self.name, self.signal = plan.name, DTYPES[plan.output.ctype]
        self._ctype, self._ffi = plan.output.ctype, FFI()
        self._ffi.cdef(_declarations(plan))
        self._library = _loaded(self._ffi, plan, folder)
        tunable = ("default", "check", "tune") if plan.tuning else ()
        for function in ("init", "reset", "step", "track", "flags", *tunable):
            setattr(self, function, getattr(self._library, f"{plan.name}_{function}"))
        self._loop = getattr(self._library, f"focgen_{plan.name}_loop")
        self.bytes = int(getattr(self._library, f"focgen_{plan.name}_bytes")())

    def state(self, content: bytes | None = None) -> Any:
        """A new state, after init, or with ``content`` of another one."""
        made = self._ffi.new("double[]", -(-self.bytes // 8))  # aligned for every member
        if content is None:
            self.init(made)
        else:
            self._ffi.buffer(made)[: self.bytes] = content
        return made

    def content(self, state: Any) -> bytes:
        """The bytes of a state."""
        return bytes(self._ffi.buffer(state)[: self.bytes])

    def params(self, given: Params | None = None) -> Any:
        """NAME_params with raw values, those of NAME_default where none are given."""
        made = self._ffi.new(f"{self.name}_params *")
        if given is None:
            self.default(made)
        else:
            made.gain, made.u_min, made.u_max = list(given.gain), given.u_min, given.u_max
        return made

    def loop(self, state: Any, inputs: Sequence[Numbers]) -> tuple[Numbers, Numbers]:
        """One step for each sample of raw ``inputs``, arrays of one length in the C's own type; outputs and
        flags, each of that length.
        """
        count = len(inputs[0])
        u, flags = np.empty(count, self.signal), np.empty(count, np.uint8)
        types = [*[f"{self._ctype} *"] * (len(inputs) + 1), "uint8_t *"]
        arrays = [self._ffi.cast(kind, array.ctypes.data) for kind, array in zip(types, (*inputs, u, flags))]
        self._loop(state, count, *arrays)
        return u, flags


def _loaded(ffi: FFI, plan: Plan, folder: Path) -> Any:
    with temporary_folder() as scratch:
        glue, target = scratch / "glue.c", scratch / f"{plan.name}.so"
        glue.write_text(render("loaded.c.jinja", _Glue(plan.name, plan.schedule is not None)))
        compile_shared([folder / f"{plan.name}.c", glue], target, FLAGS, [folder])
        try:
            return ffi.dlopen(str(target))
        except OSError as reason:
            what = f"does not link: {str(reason).rpartition(': ')[2]}"
            raise BuildError(str(folder / f"{plan.name}.c"), what, ANEW) from None


def _tunable(plan: Plan) -> str:
    name, signal = plan.name, plan.output.ctype
    members = f"{signal} gain[{len(plan.box.nominal)}]; {signal} u_min; {signal} u_max;"
    return (
        f"typedef struct {{ {members} }} {name}_params; void {name}_default({name}_params *); "
        f"uint8_t {name}_check(const {name}_params *); uint8_t {name}_tune(void *, const {name}_params *); "
    )


def _declarations(plan: Plan) -> str:
    name, signal = plan.name, plan.output.ctype
    tunable = _tunable(plan) if plan.tuning else ""
    sched, array = (f", {signal}", f"const {signal} *") if plan.schedule else ("", "")
    return tunable + (
        f"void {name}_init(void *); void {name}_reset(void *, {signal}, {signal}, {signal}); "
        f"{signal} {name}_step(void *, {signal}, {signal}{sched}); void {name}_track(void *, {signal}); "
        f"uint8_t {name}_flags(const void *); uint32_t focgen_{name}_bytes(void); "
        f"void focgen_{name}_loop(void *, uint64_t, const {signal} *, const {signal} *, "
        f"{array + ', ' if array else ''}{signal} *, uint8_t *);"
    )
