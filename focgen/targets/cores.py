"""The microcontroller cores that generated C is tried on: what they can do, and how tools call them."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.errors import check_choice


@dataclass(frozen=True)
class Core:
    """One core, bit for bit what the architecture's manual says of it.

    ``zig`` and ``gcc`` are compiler flags; ``model`` unicorn's CPU model; ``board`` QEMU's machine. ``wide``:
    it has the 32-bit instructions of Thumb-2; ``divide``, ``dsp``, ``single``, ``double``: hardware division,
    the DSP extension, a floating-point unit for float, for double. ``unaligned``: single loads and stores may
    be unaligned. ``work``: where its board has large external memory, for inputs and results.
    """

    name: str
    title: str
    zig: tuple[str, ...]
    gcc: tuple[str, ...]
    model: str
    board: str | None = None
    wide: bool = True
    divide: bool = True
    dsp: bool = False
    single: bool = False
    double: bool = False
    unaligned: bool = True
    work: int = 0x2100_0000

    @property
    def results(self) -> int:
        """Where results begin; ahead of it stands how many bytes they are."""
        return self.work + (10 << 20)

    @property
    def arm(self) -> bool:
        """Whether it runs Thumb code; else RISC-V."""
        return self.name.startswith("cortex")


_SOFT, _HARD = ("-target", "thumb-freestanding-eabi"), ("-target", "thumb-freestanding-eabihf")

CORES = (
    Core(
        "cortex-m0plus", "Cortex-M0+", (*_SOFT, "-mcpu=cortex_m0plus"), ("-mthumb", "-mcpu=cortex-m0plus"),
        "UC_CPU_ARM_CORTEX_M0", "mps2-an385", wide=False, divide=False, unaligned=False,
    ),
    Core(
        "cortex-m3", "Cortex-M3", (*_SOFT, "-mcpu=cortex_m3"), ("-mthumb", "-mcpu=cortex-m3"),
        "UC_CPU_ARM_CORTEX_M3", "mps2-an385",
    ),
    Core(
        "cortex-m4", "Cortex-M4F", (*_HARD, "-mcpu=cortex_m4+vfp4d16sp"),
        ("-mthumb", "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
        "UC_CPU_ARM_CORTEX_M4", "mps2-an386", dsp=True, single=True,
    ),
    Core(
        "cortex-m7", "Cortex-M7F", (*_HARD, "-mcpu=cortex_m7+fp_armv8d16"),
        ("-mthumb", "-mcpu=cortex-m7", "-mfloat-abi=hard", "-mfpu=fpv5-d16"),
        "UC_CPU_ARM_CORTEX_M7", "mps2-an500", dsp=True, single=True, double=True, work=0x6000_0000,
    ),
    Core(
        "rv32imac", "RV32IMAC",
        ("-target", "riscv32-freestanding-none", "-mcpu=generic_rv32+m+a+c"),
        ("-march=rv32imac", "-mabi=ilp32", "-ffreestanding"), "UC_CPU_RISCV32_ANY",
    ),
)  # fmt: skip
"""Those that an emulator of the ``targets`` extra runs."""

EMULATED = tuple(core.name for core in CORES)


def core(name: str) -> Core:
    """The core of that name. Raises InputError where there is none."""
    check_choice("--target", name, EMULATED)
    return next(one for one in CORES if one.name == name)
