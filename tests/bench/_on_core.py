"""Any C on an emulated core: what a call of a function executes, and its cycles by the timing model."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from focgen.codegen.render import render
from focgen.targets.cores import Core
from focgen.targets.emulator import Machine
from focgen.targets.program import FLASH, FLASH_SIZE, RAM, RAM_SIZE, LinkContext, read_program
from focgen.targets.timing import timing
from focgen.targets.toolchains import Toolchain, link

_HALT = """
__attribute__((noinline, used)) void focgen_halt(void)
{
    for (;;) {
        __asm volatile("");
    }
}

void focgen_start(void)
{
    (void)called(0);
    focgen_halt();
}
"""


@dataclass(frozen=True)
class CalledCost:
    """A call on a core: means of ``instructions`` and ``cycles``, the worst of the latter, and what the calls
    returned.
    """

    instructions: float
    cycles: float
    worst: float
    returned: tuple[int, ...]


def called(core: Core, chain: Toolchain, text: str, arguments, include: list[Path]) -> CalledCost:
    """Compile C that defines ``uint32_t called(uint32_t)`` and call it with one of ``arguments`` after the
    other; its static variables stay. What runs in ``called`` itself is not counted.
    """
    memory = LinkContext(FLASH, FLASH_SIZE, RAM, RAM_SIZE)
    with tempfile.TemporaryDirectory(prefix="focgen-") as scratch:
        base = Path(scratch)
        (base / "called.c").write_text(text + _HALT)
        (base / "called.ld").write_text(render("target.ld.jinja", memory))
        link(
            chain, core, [base / "called.c"], base / "called.ld", base / "called.elf", "focgen_start", include
        )
        program = read_program(core, chain, ("called",), (base / "called.elf").read_bytes())
    return _counted(Machine(program), timing(program), arguments)


def _counted(machine: Machine, model, arguments) -> CalledCost:
    machine.watch()
    place = machine.program["called"]
    outside = [(place.address, place.address + place.size)]
    outside.append((machine.program["focgen_halt"].address, machine.program["focgen_halt"].address + 2))
    counts, cycles, returned = [], [], []
    for argument in arguments:
        machine.forget()
        returned.append(machine.call("called", argument))
        ran = machine.executed().without(outside)
        counts.append(int(ran.ran.sum()))
        cycles.append(model.cycles(ran))
    calls = len(counts)
    return CalledCost(sum(counts) / calls, sum(cycles) / calls, max(cycles), tuple(returned))
