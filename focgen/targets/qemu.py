"""The same programs on QEMU's MPS2 boards, where QEMU is installed: a second emulator, which starts as a
board does, with its floating-point unit off, and faults where unicorn is lenient.

Inputs are loaded into the board's external memory; results come back in a file, by semihosting.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
from collections.abc import Sequence
from functools import cache

import numpy as np

from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario, Trace
from focgen.present import present
from focgen.programs import ran
from focgen.scratch import temporary_folder
from focgen.targets.cores import Core
from focgen.targets.emulator import TargetFault
from focgen.targets.library import Work, results
from focgen.targets.program import Program

_NAME = "qemu-system-arm"
_PATIENCE = 60.0  # s


def absent(core: Core) -> str | None:
    """Why a core is not run in QEMU; None where it is."""
    if core.board is None:
        return "qemu: no board for this core"
    return None if shutil.which(_NAME) else f"{_NAME}: not installed (apt-get install qemu-system-arm)"


@cache
def title() -> str:
    """Name and version."""
    said = ran([_NAME, "--version"]).stdout.split("\n")[0]
    return f"QEMU {said.removeprefix('QEMU emulator version ').split(' ')[0]}"


def traces(program: Program, plan: Plan, scenarios: Sequence[Scenario]) -> list[Trace]:
    """Run raw inputs of several scenarios, one start of the board each.

    Raises TargetFault where the program faults or does not return.
    """
    return [_trace(program, plan, scenario) for scenario in scenarios]


def _trace(program: Program, plan: Plan, scenario: Scenario) -> Trace:
    core, index = program.core, program.names.index(plan.name)
    work = Work(core, scenario.lanes)
    jobs = [work.add(index, plan, scenario, lane) for lane in range(scenario.lanes)]
    if not work.fits:
        raise TargetFault("was given more samples than fit a board's memory: take fewer --samples")
    image = bytearray(core.results - core.work)
    image[:4] = struct.pack("<I", len(jobs))
    image[4 : 4 + len(jobs) * len(jobs[0].descriptor)] = b"".join(job.descriptor for job in jobs)
    image[-4:] = struct.pack("<I", work.results)
    for job in jobs:
        for address, content in job.inputs:
            image[address - core.work : address - core.work + len(content)] = content
    found = _run(program, bytes(image), _PATIENCE + scenario.ref.size * (200 + plan.taps) * 2e-5)

    def read(address: int, size: int) -> bytes:
        return found[address - core.results : address - core.results + size]

    u, d, flags = (np.stack(part) for part in zip(*(results(plan, job, read) for job in jobs)))
    return Trace(u, d if plan.integrator else u, flags)


def _run(program: Program, image: bytes, seconds: float) -> bytes:
    """Start the board, let it run to its end; the results it has written."""
    with temporary_folder() as scratch:
        base = scratch
        (base / "program.elf").write_bytes(program.elf)
        (base / "inputs.bin").write_bytes(image)
        command = [_NAME, "-nographic", "-M", present(program.core.board),
                   "-monitor", "none", "-serial", "none",
                   "-semihosting-config", "enable=on,target=native", "-kernel", "program.elf", "-device",
                   f"loader,file=inputs.bin,addr={program.core.work:#x},force-raw=on"]  # fmt: skip
        try:
            done = ran(command, seconds, cwd=base)
        except subprocess.TimeoutExpired:
            raise TargetFault(f"did not return within {seconds:g} s in QEMU") from None
        if done.returncode or not (base / "results.bin").is_file():
            said = (done.stderr.strip().splitlines() or ["a fault of the processor"])[-1]
            raise TargetFault(f"failed in QEMU: {said}")
        return (base / "results.bin").read_bytes()
