"""Controllers on an AVR, the ATmega2560: avr-gcc compiles, simavr emulates, where both are installed.

simavr counts cycles, instruction by instruction, as the data sheet gives them. Its ``double`` has 32 bits, so
controllers in f64 cannot be what they are.
"""

from __future__ import annotations

import hashlib
import io
import shutil
import struct
import subprocess
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arrays import Numbers
from focgen.cache import kept
from focgen.codegen.render import render
from focgen.codegen.state import state_bytes
from focgen.compiler import find_compiler
from focgen.errors import BuildError
from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario, Trace
from focgen.present import present
from focgen.programs import ran
from focgen.scratch import temporary_folder
from focgen.targets.driver import DTYPES, RESUME, Answers, driver_context, given_width, lane_of
from focgen.targets.emulator import TargetFault

MCU = "atmega2560"
APT = "apt-get install gcc-avr avr-libc simavr libsimavr-dev libelf-dev"
FLAGS = (f"-mmcu={MCU}", "-Os", "-std=gnu99", "-ffp-contract=off")
"""At -O2 avr-gcc 5.4 reads tables in flash wrongly; -Os is what Arduino and PlatformIO compile with."""
HOW = "cycles counted by simavr, from the call of the step to its return"
_RAM = 8192 - 256  # bytes; some for the stack and for what feeds the step
_DATA = 0x80_0000  # where ELF files of AVRs place memory
_END_OF_LANE = 8
_STEP_CYCLES, _TEST_CYCLES = 200, 20_000  # millions that a step and a self-test may take
_TEST_SECONDS = 1200.0


@dataclass(frozen=True, eq=False)
class AvrRun:
    """``answers`` of every lane, ``cycles`` of every step (lanes, samples), ``stack`` bytes used at most."""

    answers: Answers
    cycles: Numbers
    stack: int


def missing(plan: Plan) -> str | None:
    """Why nothing can run on an AVR, or not this plan; None where it can."""
    if plan.arithmetic == "f64":
        return "an AVR's double has 32 bits: f64 cannot be had there"
    if state_bytes(plan) > _RAM:
        return f"the state has {state_bytes(plan)} bytes, an ATmega2560 8192 bytes of RAM"
    if shutil.which("avr-gcc") is None or not _simulator():
        return f"needs avr-gcc and simavr ({APT})"
    if find_spec("elftools") is None:
        return "needs pyelftools (pip install 'focgen[targets]')"
    return None


def tools() -> str:
    """Names and versions of compiler and emulator."""
    version = ran(["avr-gcc", "-dumpversion"]).stdout.strip()
    return f"avr-gcc {version}, simavr ({MCU})"


@cache
def _simulator() -> Path | None:
    """The program that feeds simavr, compiled once; None where simavr's library is not installed."""
    source = Path(__file__).with_name("simavr_run.c")
    name = f"simavr_run-{hashlib.sha256(source.read_bytes()).hexdigest()[:16]}"
    try:
        return kept(name, _compile_simulator)
    except BuildError:
        return None


def _compile_simulator(target: Path) -> None:
    """Raises BuildError where simavr's library is not installed."""
    source = Path(__file__).with_name("simavr_run.c")
    command = [*find_compiler(), "-O2", "-I/usr/include/simavr", str(source), "-o", str(target)]
    if ran([*command, "-lsimavr", "-lelf"]).returncode:
        raise BuildError("simavr", "its library is not installed", APT)


class AvrLibrary:
    """The C of a plan on an emulated ATmega2560; ``flash``: bytes that it adds to an empty program.
    ``selftest``: whether its folder has NAME_selftest.c, which is a program of its own.

    Raises BuildError where it does not compile.
    """

    alignment = 1

    def __init__(self, plan: Plan, folder: Path, selftest: bool = False) -> None:
        self.plan, self.folder, self.test = plan, folder, b""
        with temporary_folder() as scratch:
            feeder, idle = scratch / "feeder.c", scratch / "idle.c"
            feeder.write_text(render("avr.c.jinja", driver_context(plan)))
            idle.write_text("int main(void) { for (;;) { } }\n")
            own = folder / f"{plan.name}.c"
            self.elf = _compiled([feeder, own], folder)
            self.object = _compiled([own], folder, "-c")
            around = _flash(_compiled([feeder], folder, "-c")) - _flash(_compiled([idle], folder, "-c"))
            self.flash = _flash(self.elf) - _flash(_compiled([idle], folder)) - around
            if selftest:
                feeder.write_text(render("avr_selftest.c.jinja", driver_context(plan)))
                self.test = _compiled([feeder, own, folder / f"{plan.name}_selftest.c"], folder)
        self._symbols = _symbols(self.elf)
        signal, increment = (DTYPES[f.ctype]().itemsize for f in (plan.output, plan.increment))
        self._event, self._in = 3 * signal, (3 + given_width(plan)) * signal + 1
        self._out = signal + increment + 1

    def answers(self, plan: Plan, scenario: Scenario) -> Answers:
        """Run raw inputs, as the host's library does."""
        return self.run(scenario).answers

    def run(self, scenario: Scenario) -> AvrRun:
        """Run raw inputs. Raises TargetFault where the program crashes or does not return."""
        lanes = range(scenario.lanes)
        inputs = b"".join(self._records(scenario, lane) for lane in lanes)
        place, state = self._symbols["tried"]
        cell = self._symbols["cell"][0]
        places = [cell, cell + self._event, self._in, self._out, place, state]
        seconds = 60.0 + scenario.samples * scenario.lanes * 20.0
        found = _simulated(self.elf, inputs, places, _STEP_CYCLES, seconds)
        size, count = self._out + 4, scenario.samples
        rows, states, at = [], [], 0
        for _ in lanes:
            rows.append(np.frombuffer(found[at : at + count * size], self._kind()))
            at += count * size
            states.append(found[at : at + state])
            at += state
        table = np.stack(rows)
        d = table["d"] if self.plan.integrator else table["u"]
        trace = Trace(table["u"].copy(), d.copy(), table["flags"].copy())
        return AvrRun(Answers(trace, tuple(states)), table["cycles"].astype(np.int64),
                      struct.unpack("<I", found[at : at + 4])[0])  # fmt: skip

    def selftest(self) -> int:
        """What NAME_selftest() returns there: 0, or the first step that is wrong. Raises TargetFault as
        :meth:`run` does.
        """
        cell = _symbols(self.test)["cell"][0]
        found = _simulated(self.test, b"\0", [cell, cell, 1, 4, cell, 0], _TEST_CYCLES, _TEST_SECONDS)
        made: int = struct.unpack_from("<I", found)[0]
        return made

    def _kind(self) -> np.dtype:
        fields = [("u", DTYPES[self.plan.output.ctype]), ("d", DTYPES[self.plan.increment.ctype])]
        return np.dtype([*fields, ("flags", np.uint8), ("cycles", np.uint32)])

    def _records(self, scenario: Scenario, number: int) -> bytes:
        """What the emulator puts in memory, sample by sample."""
        lane, kind = lane_of(self.plan, scenario, number), DTYPES[self.plan.output.ctype]
        fields = [
            ("ref", kind),
            ("meas", kind),
            ("sched", kind),
            ("event", np.uint8),
            ("given", kind, given_width(self.plan)),
        ]
        records = np.zeros(scenario.samples, np.dtype(fields))
        for name in present(records.dtype.names):
            records[name] = getattr(lane, name)
        records["event"][1:] |= RESUME
        records["event"][-1] |= _END_OF_LANE
        return records.tobytes()


def _simulated(elf: bytes, inputs: bytes, places: list[int], most: int, seconds: float) -> bytes:
    """What simavr gives for ``inputs``; ``places``: CELL, EVENT, IN, OUT, STATE and SIZE of simavr_run.c,
    ``most`` million cycles an answer. Raises TargetFault where the program crashes or does not return.
    """
    numbers = [*places, _symbols(elf)["_end"][0], most]
    with temporary_folder() as scratch:
        base = scratch
        (base / "avr.elf").write_bytes(elf)
        (base / "inputs").write_bytes(inputs)
        command = [str(_simulator()), str(base / "avr.elf"), MCU, *map(str, numbers)]
        try:
            done = ran([*command, str(base / "inputs"), str(base / "results")], seconds)
        except subprocess.TimeoutExpired:
            raise TargetFault(f"did not return within {seconds:g} s") from None
        if done.returncode:
            said = {3: f"did not return within {most} million cycles", 4: "crashed in the emulator"}
            raise TargetFault(said.get(done.returncode, f"could not be emulated ({done.returncode})"))
        return (base / "results").read_bytes()


def _compiled(sources: list[Path], folder: Path, *more: str) -> bytes:
    """A program, or with -c an object file."""
    with temporary_folder() as scratch:
        target = scratch / "out.elf"
        parts = ["avr-gcc", *FLAGS, *more, f"-I{folder}", *map(str, sources), "-o", str(target), "-lm"]
        done = ran(parts)
        if done.returncode:
            said = [line for line in done.stderr.splitlines() if "error" in line] or ["it says nothing"]
            raise BuildError(str(sources[-1]), f"avr-gcc: {said[0].strip()}", "take a shorter memory or q15")
        return target.read_bytes()


def _elf(content: bytes) -> Any:
    from elftools.elf.elffile import ELFFile

    return ELFFile(io.BytesIO(content))


def _flash(elf: bytes) -> int:
    """Bytes of everything that is loaded into flash."""
    sections = _elf(elf).iter_sections()
    return sum(s["sh_size"] for s in sections if s["sh_flags"] & 2 and s["sh_type"] != "SHT_NOBITS")


def _symbols(elf: bytes) -> dict[str, tuple[int, int]]:
    """Address in memory and size of every object."""
    table = _elf(elf).get_section_by_name(".symtab")
    return {s.name: (s["st_value"] - _DATA, s["st_size"]) for s in table.iter_symbols()}
