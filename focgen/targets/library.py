"""Controllers run on an emulated core over scenarios, with the interface of the host's library."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from focgen.arrays import Kind, Numbers
from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario, Trace
from focgen.targets.cores import Core
from focgen.targets.driver import DTYPES, RESUME, Answers, driver, header_scales, lane_of, steps_alone
from focgen.targets.emulator import Executed, Machine, TargetFault
from focgen.targets.legality import forbidden
from focgen.targets.program import WORK_SIZE, Program, build
from focgen.targets.toolchains import EXACT, Toolchain

_DESCRIPTOR = "<10I"

PATIENCE = 20.0
"""Seconds that a run may take at least before it is said not to return."""


@dataclass(frozen=True, eq=False)
class Job:
    """One lane in memory: the ``descriptor`` that the program reads, ``inputs`` (address, bytes), and where
    its results will stand.
    """

    descriptor: bytes
    inputs: tuple[tuple[int, bytes], ...]
    count: int
    u: int
    d: int
    flags: int


class Work:
    """Lays out jobs in a board's memory: descriptors, then inputs; results apart from them."""

    def __init__(self, core: Core, jobs: int) -> None:
        self._core = core
        self._in = core.work + 4 + jobs * struct.calcsize(_DESCRIPTOR)
        self._out = core.results

    @property
    def results(self) -> int:
        """Bytes of all results so far."""
        return self._out - self._core.results

    @property
    def fits(self) -> bool:
        """Whether everything so far has room."""
        return self._in <= self._core.results - 8 and self._out <= self._core.work + WORK_SIZE

    def add(self, index: int, plan: Plan, scenario: Scenario, lane: int) -> Job:
        """Place one lane of plan number ``index``."""
        arrays = vars(lane_of(plan, scenario, lane)).values()
        inputs = [(self._input(a.nbytes), a.tobytes()) for a in arrays]
        signal, increment = (DTYPES[f.ctype]().itemsize for f in (plan.output, plan.increment))
        count = scenario.samples
        u, d, flags = (self._result(count * size) for size in (signal, increment, 1))
        places = [address for address, _ in inputs]
        descriptor = struct.pack(_DESCRIPTOR, index, count, *places, u, d, flags)
        return Job(descriptor, tuple(inputs), count, u, d, flags)

    def _input(self, size: int) -> int:
        place = self._in = -(-self._in // 8) * 8
        self._in += size
        return place

    def _result(self, size: int) -> int:
        place = self._out = -(-self._out // 8) * 8
        self._out += size
        return place


def results(plan: Plan, job: Job, read: Callable[[int, int], bytes]) -> tuple[Numbers, Numbers, Numbers]:
    """u, d and flags of a finished job; ``read(address, size)`` gives bytes of memory."""

    def array(place: int, kind: Kind) -> Numbers:
        return np.frombuffer(read(place, job.count * np.dtype(kind).itemsize), kind)

    output, increment = DTYPES[plan.output.ctype], DTYPES[plan.increment.ctype]
    return array(job.u, output), array(job.d, increment), array(job.flags, np.uint8)


class TargetLibrary:
    """The C of plans on an emulated core: one program, run lane by lane.

    ``plans`` have different names; ``folders`` hold NAME.h, NAME.c and foc_rt.h, one a plan. Raises
    BuildError where they do not compile, MissingExtra where the tools are missing.
    """

    alignment = 8

    def __init__(self, core: Core, chain: Toolchain, plans: Sequence[Plan], folders: Sequence[Path],
                 flags: Sequence[str] = EXACT, selftest: bool = False) -> None:  # fmt: skip
        self.plans = tuple(plans)
        self.program: Program = build(core, chain, plans, folders, [driver(p) for p in plans], flags,
                                      selftest)  # fmt: skip
        self.core, self.chain = core, chain
        self.machine = Machine(self.program)
        self.machine.watch()

    def illegal(self) -> tuple[str, ...]:
        """Instructions that the core does not have, each once with its place."""
        return forbidden(self.program)

    def run(self, plan: Plan, scenario: Scenario) -> Trace:
        """Run raw inputs; returns raw u and d and the flags, shape (lanes, samples), like the host's library.

        Raises TargetFault where the program faults, does not return, or accesses memory as the core must not.
        """
        return steps_alone(self.answers(plan, scenario).trace)

    def answers(self, plan: Plan, scenario: Scenario) -> Answers:
        """The same, with the state's bytes after every lane."""
        lanes, states = [], []
        for lane in range(scenario.lanes):
            job = self._placed(self._index(plan), plan, scenario, lane)
            limit = PATIENCE + job.count * (200 + plan.taps) * 2e-5
            self.machine.call("focgen_run", self.core.work + 4, seconds=limit)
            lanes.append(results(plan, job, self.machine.read))
            states.append(self._state(plan))
        u, d, flags = (np.stack(part) for part in zip(*lanes))
        return Answers(Trace(u, d if plan.integrator else u, flags), tuple(states))

    def stepwise(self, plan: Plan, scenario: Scenario) -> Iterator[Executed]:
        """Run the first lane step by step; yield what ran for each but the first, the feeding included;
        the stack is painted after it.

        The first sample begins with a reset of the scenario, if it has one; no other does.
        """
        job = self._placed(self._index(plan), plan, scenario, 0)
        sizes = [DTYPES[plan.output.ctype]().itemsize] * 3 + [1]
        for k in range(job.count):
            words = list(struct.unpack(_DESCRIPTOR, job.descriptor))
            words[1] = 1
            words[2:6] = [place + k * size for place, size in zip(words[2:6], sizes)]
            if k:
                self.machine.write(words[5], bytes([RESUME]))
            if k == 1:
                self.machine.paint_stack()
            self.machine.write(self.core.work + 4, struct.pack(_DESCRIPTOR, *words))
            self.machine.forget()
            self.machine.call("focgen_run", self.core.work + 4, seconds=PATIENCE)
            if k:
                yield self.machine.executed()

    def _index(self, plan: Plan) -> int:
        return [p.name for p in self.plans].index(plan.name)

    def _placed(self, index: int, plan: Plan, scenario: Scenario, lane: int) -> Job:
        work = Work(self.core, 1)
        job = work.add(index, plan, scenario, lane)
        if not work.fits:
            raise TargetFault(f"{job.count} samples a run do not fit a board's memory: take fewer --samples")
        self.machine.write(self.core.work, struct.pack("<I", 1) + job.descriptor)
        for address, content in job.inputs:
            self.machine.write(address, content)
        return job

    def selftest(self, plan: Plan) -> int:
        """What NAME_selftest() returns there: 0, or the first step that is wrong."""
        found = self.machine.call("focgen_selftest", self._index(plan))
        return found - (1 << 32) if found >> 31 else found

    def state_bytes(self, plan: Plan) -> int:
        """sizeof(NAME_state) there."""
        return len(self._state(plan))

    def _state(self, plan: Plan) -> bytes:
        ahead = self.core.results - 4
        place = self.machine.call("focgen_bytes", self._index(plan), ahead)
        return self.machine.read(place, *struct.unpack("<I", self.machine.read(ahead, 4)))

    def scales(self, plan: Plan) -> dict[str, float]:
        """What the header's macros for LSBs and sample time are."""
        names = list(header_scales(plan))
        self.machine.call("focgen_scale", self._index(plan), self.core.results)
        found = np.frombuffer(self.machine.read(self.core.results, 8 * len(names)))
        return dict(zip(names, found.tolist()))
