"""The true rig of a case, and its simulation over a session."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.arrays import Array, Numbers
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig
from focgen.trials.build import library
from focgen.trials.history import BLOCK, Memory, l1_factor, l1_weights, log_kernel, stretched_kernel


@dataclass(frozen=True)
class Setting:
    """One form at work: its name in C, its parameters, and the memory it needs (kind, parameters …)."""

    form: str
    parameters: tuple[float, ...]
    memory: tuple[Any, ...] | None = None


@dataclass(frozen=True)
class Machine:
    """A rig with the effects that it truly has."""

    rig: Rig
    settings: tuple[Setting, ...] = ()


@dataclass(frozen=True, eq=False)
class Trace:
    """What happened in one experiment, on the fine grid; arrays (n,) in the rig's units, ``clock`` and ``h``
    in s.
    """

    h: float
    clock: float
    command: Array
    pressure: Array
    curvature: Array
    output: Array

    @property
    def time(self) -> Array:
        """Seconds since the experiment began."""
        return np.arange(len(self.command)) * self.h


class Session:
    """A machine in use: what outlives a rest stays from one experiment to the next."""

    def __init__(self, machine: Machine, h: float) -> None:
        self.machine, self.h = machine, h
        self.ffi, self.lib = library()
        self.chain = self.ffi.new("chain *")
        _fill(self.chain, machine, h, self.lib)

    def memories(self, count: int) -> dict[str, Memory]:
        """Fresh memories for an experiment of ``count`` steps, connected to the chain."""
        kept = {}
        actuator = self.machine.rig.actuator
        if isinstance(actuator, Actuator):
            kept["past"] = Memory(l1_weights(actuator.alpha, count))
        for setting in self.machine.settings:
            if setting.memory:
                kept[setting.memory[0]] = Memory(_kernel(setting.memory, self.h, count))
        for name, memory in kept.items():
            slot = getattr(self.chain, name)
            slot.on = 1
            slot.w, slot.d, slot.far = (self.pointer(a) for a in (memory.w, memory.d, memory.far))
        return kept

    def pointer(self, values: Numbers) -> Any:
        """A C pointer to an array's data."""
        return self.ffi.cast("double *" if values.dtype == float else "uint8_t *", values.ctypes.data)

    def run(self, command: Array, clock: float) -> Trace:
        """One experiment from rest, the command held from step to step."""
        command = np.ascontiguousarray(command, float)
        out = [np.zeros(len(command)) for _ in range(3)]
        ports = [self.pointer(a) for a in (command, *out)]
        self.blocks(
            len(command), clock, lambda first, stop: self.lib.advance(self.chain, first, stop, *ports)
        )
        return Trace(self.h, clock, command, *out)

    def blocks(self, count: int, clock: float, advance: Callable[[int, int], None]) -> None:
        """Rest, then call ``advance(first, stop)`` for block after block, spreading the memories between."""
        self.lib.at_rest(self.chain)
        self.chain.clock = clock
        kept = self.memories(count)
        for index, first in enumerate(range(0, count, BLOCK)):
            advance(first, min(first + BLOCK, count))
            for memory in kept.values():
                memory.spread(index + 1)

    def read(self, output: Array) -> Array:
        """The samples as the converter gives them (a new array)."""
        values = np.array(output, float)
        self.lib.read_samples(self.chain, self.pointer(values), len(values))
        return values


def simulate(machine: Machine, commands: Sequence[Array], clocks: Sequence[float], h: float) -> list[Trace]:
    """The session's experiments: ``commands`` on the fine grid of step ``h`` s, beginning at ``clocks`` s."""
    session = Session(machine, h)
    return [session.run(command, clock) for command, clock in zip(commands, clocks)]


def _kernel(memory: tuple[Any, ...], h: float, count: int) -> Array:
    kernels: dict[str, Callable[..., Array]] = {"creep": log_kernel, "electrode": stretched_kernel}
    return kernels[memory[0]](*memory[1:], h, count)


def _fill(chain: Any, machine: Machine, h: float, lib: Any) -> None:
    rig, chain.h = machine.rig, h
    _fill_linear(chain.regulator, rig.regulator)
    _fill_linear(chain.sensor, rig.sensor)
    actuator = rig.actuator
    chain.gains, chain.gain[0] = 1, 1.0
    if isinstance(actuator, Actuator):
        chain.fractional, chain.gains = 1, len(actuator.gain)
        chain.gain[0 : chain.gains] = list(actuator.gain)
        chain.viscosity = actuator.T * l1_factor(actuator.alpha, h)
    else:
        _fill_linear(chain.plant, actuator.dynamics if actuator else TransferFunction([(1.0, 0.0)]))
    chain.offset = actuator.offset if actuator else 0.0
    chain.bias = getattr(actuator, "bias", 0.0)
    chain.effects = len(machine.settings)
    for slot, setting in zip(chain.effect, machine.settings):
        slot.form = lib.form_of(setting.form.encode())
        if slot.form < 0:
            raise KeyError(setting.form)
        slot.par[0 : len(setting.parameters)] = list(setting.parameters)
        slot.kept[0] = setting.parameters[-1] if setting.form in _SEEDED else 0.0


_SEEDED = ("supply_ripple", "opening_seam", "loose_joint", "pick_up", "loose_plug")


def _fill_linear(slot: Any, transfer: TransferFunction) -> None:
    """A proper transfer function of whole orders ≤ 3 as a companion form with a direct path."""
    den = {int(t.order): t.coefficient for t in transfer.den}
    num = {int(t.order): t.coefficient for t in transfer.num}
    order = max(den)
    top = den[order]
    slot.order, slot.through = order, num.get(order, 0.0) / top
    for i in range(order):
        slot.a[i] = den.get(i, 0.0) / top
        slot.b[i] = num.get(i, 0.0) / top - slot.through * slot.a[i]
