"""Generated C in its place in a loop, everything that it is given written down for the reference."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from focgen.plan.execute import execute
from focgen.plan.plan import Format, Plan
from focgen.plan.scenario import Reset, Scenario, Track
from focgen.running.controller import LoadedController
from focgen.running.signals import Physical


@dataclass
class Lane:
    """What a controller was given since a beginning that the reference knows, or does not (``known``)."""

    known: bool = True
    inputs: list[tuple] = field(default_factory=list)
    answers: list[tuple] = field(default_factory=list)
    resets: list[Reset] = field(default_factory=list)
    tracks: list[Track] = field(default_factory=list)


class Seat:
    """One controller in counts. Physical values go in; ``u`` is the latest physical output."""

    def __init__(self, loaded: LoadedController, bytes_saved: int):
        self.c, self.plan = loaded.counts(), loaded.plan
        self.lanes, self.u = [Lane()], 0.0
        self._saved = bytearray(bytes_saved)
        self._kept: Lane | None = None
        self._one = Physical()

    @property
    def lane(self) -> Lane:
        return self.lanes[-1]

    def step(self, ref: float, meas: float, sched: float) -> float:
        error, signal = self.plan.error, self.plan.schedule.signal
        given = self._raw(ref, error), self._raw(meas, error), self._raw(sched, signal)
        u = self.c.step(*given)
        self.lane.inputs.append(given)
        self.lane.answers.append((u, int(self.c.flags)))
        self.u = u * self.plan.output.lsb
        return self.u

    def track(self, u: float) -> None:
        raw = self._raw(u, self.plan.output)
        self.c.track(raw)
        at = len(self.lane.inputs)
        self.lane.tracks = [t for t in self.lane.tracks if t.sample != at] + [Track(0, at, raw)]

    def reset(self, ref: float, meas: float, u0: float) -> None:
        """From here on the reference knows the state again."""
        error = self.plan.error
        given = self._raw(ref, error), self._raw(meas, error), self._raw(u0, self.plan.output)
        self.c.reset(*given)
        self.lanes.append(Lane(resets=[Reset(0, 0, *given)]))

    def save(self) -> None:
        """Into memory that outlives the power."""
        machine = self.c._machine
        machine._library_save(self.c._state, machine._ffi.from_buffer(self._saved))
        self._kept = replace(self.lane, **{k: list(v) for k, v in vars(self.lane).items() if k != "known"})

    def restore(self) -> None:
        """After the power has failed: a fresh state that goes on where the saved one was."""
        self.c.init()
        machine = self.c._machine
        assert machine._library_restore(self.c._state, machine._ffi.from_buffer(self._saved)) == 0
        assert self._kept is not None
        self.lanes.append(self._kept)

    def damage(self, rng: np.random.Generator, bits: int | None) -> None:
        """Flip so many bits of the state, or fill it with random bytes (None)."""
        view = self.c._machine._ffi.buffer(self.c._state)
        size = self.c._machine.bytes
        if bits is None:
            view[:size] = rng.bytes(size)
        else:
            for at in rng.choice(8 * size, bits, replace=False):
                view[int(at) // 8] = bytes([view[int(at) // 8][0] ^ (1 << int(at) % 8)])
        self.lanes.append(Lane(known=False))

    def zero(self) -> None:
        """The state as a variable of C begins that nobody has set."""
        size = self.c._machine.bytes
        self.c._machine._ffi.buffer(self.c._state)[:size] = bytes(size)
        self.lanes.append(Lane(known=False))

    def init(self) -> None:
        """From here on the reference knows the state, as from the beginning."""
        self.c.init()
        self.lanes.append(Lane())

    def _raw(self, value: float, form: Format) -> int | float:
        """What a converter hands over: of a value that is none, integers show the end of their type."""
        if not form.floating and math.isnan(value):
            return -(1 << (form.bits - 1))
        return self._one.one("signal", value, form)

    def compared(self) -> tuple[int, int]:
        """How many samples the reference answers as well, and how many of them differ in a bit."""
        total = wrong = 0
        for lane in self.lanes:
            if lane.known and lane.inputs:
                total += len(lane.inputs)
                wrong += _differing(self.plan, lane)
        return total, wrong


def _differing(plan: Plan, lane: Lane) -> int:
    kind = {"float": np.float32, "double": np.float64}.get(plan.error.ctype, np.int64)
    columns = [np.array([column], dtype=kind) for column in zip(*lane.inputs)]
    count = len(lane.inputs)
    events = tuple(lane.resets), tuple(t for t in lane.tracks if t.sample < count)
    expected = execute(plan, Scenario(*columns, *events))
    u, flags = (np.array(column) for column in zip(*lane.answers))
    wrong = np.asarray(expected.u[0], dtype=float) != np.asarray(u, dtype=float)
    return int(np.count_nonzero(wrong | (expected.flags[0] != flags)))
