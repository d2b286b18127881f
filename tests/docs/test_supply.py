"""examples/firmware/supply.c on an emulated Cortex-M4: a timer's interrupt at random moments, a supply that
sags, a gain that is turned, power that fails in the middle; every DAC code is what the Python reference says.

The emulator has no interrupt controller. What a Cortex-M does at an interrupt is done to it here: eight
words, and the floating-point unit's, go onto the stack, the handler runs, they come back. Two of one
priority wait for each other.

Red when one code at the output differs, whenever interrupts and power failures come.
"""

import re
import struct
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.codegen.render import render
from focgen.plan.scenario import Params
from focgen.targets.cores import core
from focgen.targets.emulator import Machine
from focgen.targets.program import FLASH, FLASH_SIZE, RAM, RAM_SIZE, STACK, LinkContext, read_program
from focgen.targets.toolchains import EXACT, link
from tests.c_code import STRICT, compiler, run

pytest.importorskip("unicorn")
pytest.importorskip("ziglang")

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "firmware"
PINS = 0x4000_0000
DAC, HANDLER, COMPARATOR, TICKS, KNOB, ON, REPORT = 3, 5, 6, 7, 8, 9, 10
FRAME = ["R0", "R1", "R2", "R3", "R12", "LR", "PC", "CPSR", *(f"S{i}" for i in range(16)), "FPSCR"]
"""What the core itself keeps at an interrupt; the compiler's code keeps the rest."""
F32 = np.float32


@pytest.fixture(scope="module")
def firmware(tmp_path_factory):
    folder = tmp_path_factory.mktemp("supply")
    focgen.generate(EXAMPLES / "supply.toml", folder, tunable=True)
    return folder


def test_it_runs_on_a_computer(firmware, tmp_path):
    sources = [EXAMPLES / "supply.c", EXAMPLES / "board_host.c", firmware / "valve.c"]
    program = tmp_path / "supply.exe"
    run(*compiler("gcc"), *STRICT, "-O2", "-I", firmware, "-I", EXAMPLES, *sources, "-o", program)
    said = re.fullmatch(r"curvature (0\.\d{4}) 1/mm, flags 0, refused 0\n", run(program))
    assert abs(float(said[1]) - 0.012) < 0.0004


class Board:
    """A Cortex-M4 with the example in its flash, and a plant on its pins."""

    def __init__(self, folder: Path, scratch: Path, seed: int):
        from tests.targets.test_verify import ZIG

        one = core("cortex-m4")
        (scratch / "m4.ld").write_text(
            render("target.ld.jinja", LinkContext(FLASH, FLASH_SIZE, RAM, RAM_SIZE))
        )
        sources = [EXAMPLES / "supply.c", EXAMPLES / "board_m4.c", folder / "valve.c"]
        link(ZIG, one, sources, scratch / "m4.ld", scratch / "m4.elf", "board_start", [folder, EXAMPLES],
             [*EXACT, "-DBOARD_M4"])  # fmt: skip
        self.program = read_program(one, ZIG, ("valve",), (scratch / "m4.elf").read_bytes())
        self.machine = Machine(self.program)
        self.core, names = self.machine._machine, self.machine._uc.arm_const
        self.core.mem_map(PINS, 4096)
        self.frame = [getattr(names, f"UC_ARM_REG_{name}") for name in FRAME]
        self.sp, self.lr, self.pc = names.UC_ARM_REG_SP, names.UC_ARM_REG_LR, names.UC_ARM_REG_PC
        self.core.reg_write(names.UC_ARM_REG_FPEXC, 1 << 30)
        self.rng, self.halt = np.random.default_rng(seed), self.program["focgen_halt"].address
        self.machine.watch()
        self.pressure = self.bent = 0.0
        self.start()

    def pin(self, n: int, value: int | None = None) -> int:
        if value is not None:
            self.machine.write(PINS + 4 * n, struct.pack("<I", value))
        return struct.unpack("<I", self.machine.read(PINS + 4 * n, 4))[0]

    def start(self) -> None:
        """Power on: RAM is anything but what a battery keeps, then what a start-up file makes of it."""
        kept = self.program["kept"]
        held = self.machine.read(kept.address, kept.size)
        for s in self.program.sections:
            if s.kind == "data":
                self.machine.write(s.address, s.content or bytes(s.size))
        self.machine.write(STACK - (16 << 10), b"\xa5" * (16 << 10))
        self.machine.write(kept.address, held)
        self.pin(ON, 1)
        self.pin(HANDLER, 0)
        self.core.reg_write(self.sp, STACK)
        self.core.reg_write(self.lr, self.halt | 1)
        self.core.reg_write(self.pc, self.program["board_start"].address | 1)
        while not self.pin(HANDLER):
            self.go(500)

    def go(self, count: int = 0) -> bool:
        """So many instructions, all where it is 0; whether the end was reached."""
        at = self.core.reg_read(self.pc) | 1
        self.core.emu_start(at, self.halt, timeout=20_000_000, count=count)
        self.machine._check()
        return self.core.reg_read(self.pc) & ~1 == self.halt

    def interrupt(self, handler: int, cut: int = 0) -> bool:
        """Call a handler between two instructions; with ``cut`` the power ends after so many of its own."""
        words = [self.core.reg_read(register) for register in self.frame]
        before = self.core.reg_read(self.sp)
        stacked = (before - 4 * len(words)) & ~7
        self.machine.write(stacked, struct.pack(f"<{len(words)}I", *(word & 0xFFFFFFFF for word in words)))
        self.core.reg_write(self.sp, stacked)
        self.core.reg_write(self.lr, self.halt | 1)
        self.core.reg_write(self.frame[7], words[7] & ~0x0600FC00)  # an IT block waits
        self.core.reg_write(self.pc, handler)
        ended = self.go(cut)
        if ended:
            assert self.core.reg_read(self.sp) == stacked
            for register, word in zip(
                self.frame, struct.unpack(f"<{len(words)}I", self.machine.read(stacked, 4 * len(words)))
            ):
                self.core.reg_write(register, word | 1 if register == self.pc else word)
            self.core.reg_write(self.sp, before)
        return ended

    def codes(self, volts: float) -> tuple[int, int, int]:
        """The plant for 10 ms, then what the converter sees of curvature, pressure and supply."""
        for _ in range(10):
            self.pressure += (0.0998 * 10.0 * self.pin(DAC) / 4095.0 - self.pressure) * 0.001 / 0.04
            self.bent += ((0.0015 + 0.345 * self.pressure) * self.pressure - self.bent) * 0.001 / 0.4
        shares = self.bent / 0.02, self.pressure / 0.25, volts / 12.0
        found = tuple(int(4095.0 * min(max(share, 0.0), 1.0) + 0.5) for share in shares)
        for channel, code in enumerate(found):
            self.pin(channel, code)
        return found

    def tick(self) -> int:
        """Some of the main loop, then the timer's interrupt; the instructions that it took."""
        self.go(int(self.rng.integers(200, 600)))
        self.machine.forget()
        assert self.interrupt(self.pin(HANDLER))
        self.pin(TICKS, self.pin(TICKS) + 1)
        return int(self.machine.executed().ran.sum())


@dataclass
class Reference:
    """The same firmware in Python, in counts, around what ``focgen.load`` gives."""

    controller: object
    params: Params
    supply: int = 0xFFFF
    knob: float = 1.0

    def tick(self, codes: tuple[int, int, int], turned: bool) -> int:
        plan, scale = self.controller.plan, F32(4095.0)
        count = lambda value, lsb: int(np.floor(abs(float(value)) / lsb + 0.5))
        if codes[2] != self.supply or turned:
            u_max = min(count(F32(codes[2]) * (F32(12.0) / scale), plan.output.lsb), plan.output.high)
            gain = (count(F32(self.knob), plan.box.factor.lsb),) * 3 if turned else self.params.gain
            params = replace(self.params, u_max=u_max, gain=gain)
            if self.controller.check(params) == 0:
                self.controller.tune(params)
                self.params, self.supply = params, codes[2]
        meas = count(F32(codes[0]) * (F32(0.02) / scale), plan.error.lsb)
        sched = count(F32(codes[1]) * (F32(0.25) / scale), plan.schedule.signal.lsb)
        u = self.controller.step(count(F32(0.012), plan.error.lsb), meas, sched)
        return int(F32(u) * F32(plan.output.lsb) * (scale / F32(10.0)) + F32(0.5))


def test_limits_that_follow_a_gain_that_is_turned_and_power_that_fails(firmware, tmp_path):
    board = Board(firmware, tmp_path, 1)
    controller = focgen.load(firmware, raw=True)
    reference = Reference(controller, controller.default())
    board.pin(KNOB, struct.unpack("<I", struct.pack("<f", 1.0))[0])
    controller.reset(0, 0, 0)
    seen, costs = [], []
    for k in range(260):
        volts = 12.0 if k < 100 or k >= 140 else 1.5
        if k == 60:
            reference.knob = 1.25
            board.pin(KNOB, struct.unpack("<I", struct.pack("<f", 1.25))[0])
        codes = board.codes(volts)
        costs.append(board.tick())
        assert board.pin(DAC) == reference.tick(codes, k in (0, 60)), k
        seen.append(board.pin(DAC))
        if k in (50, 120, 200):  # saved, lost, and gone on with, on the same plant
            assert board.interrupt(board.pin(COMPARATOR))
            board.start()
    limit = int(1.5 / 10.0 * 4095.0 + 1.5)
    assert min(seen[80:100]) > limit and max(seen[100:140]) <= limit < max(seen[141:])
    assert abs(board.bent - 0.012) < 0.0004
    board.pin(ON, 0)
    assert board.go() and board.pin(REPORT + 2) == 0
    assert 1000 < np.median(costs) < 4000


@pytest.mark.parametrize("cut", (40, 3000, 9000))
def test_power_that_ends_while_it_is_saved_is_a_start_without_a_copy(firmware, tmp_path, cut):
    """Half a copy is refused; the controller begins where the plant is."""
    board = Board(firmware, tmp_path, 2)
    for _k in range(30):
        board.codes(12.0)
        board.tick()
    assert board.interrupt(board.pin(COMPARATOR))
    for _k in range(10):
        before = board.codes(12.0)
        board.tick()
    assert not board.interrupt(board.pin(COMPARATOR), cut)
    board.start()
    codes = board.codes(12.0)
    board.tick()
    controller = focgen.load(firmware, raw=True)
    reference = Reference(controller, controller.default())
    meas = int(np.floor(float(F32(before[0]) * (F32(0.02) / F32(4095.0))) / controller.plan.error.lsb + 0.5))
    controller.reset(meas, meas, 0)
    assert board.pin(DAC) == reference.tick(codes, True)
