"""Controllers linked for a core: one ELF file for any number of them."""

from __future__ import annotations

import io
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from focgen.codegen.render import render
from focgen.errors import MissingExtra
from focgen.plan.plan import Plan
from focgen.scratch import temporary_folder
from focgen.targets.cores import Core
from focgen.targets.toolchains import EXACT, Toolchain, link

FLASH, FLASH_SIZE = 0x0000_0000, 4 << 20
RAM, RAM_SIZE = 0x2000_0000, 4 << 20
STACK = RAM + RAM_SIZE
"""The stack begins at the end of RAM and grows downwards."""
WORK_SIZE = 16 << 20
"""Inputs and results stand in a board's external memory."""


@dataclass(frozen=True)
class Section:
    """A piece of the program: ``kind`` is "code", "constants" or "data"."""

    name: str
    address: int
    content: bytes
    size: int
    kind: str


@dataclass(frozen=True)
class Symbol:
    """A function or an object: where, how many bytes."""

    name: str
    address: int
    size: int
    function: bool


@dataclass(frozen=True, eq=False)
class Program:
    """An ELF file in parts. ``code_ranges``: (begin, end) of instructions, literal pools left out."""

    core: Core
    chain: Toolchain
    names: tuple[str, ...]
    sections: tuple[Section, ...]
    symbols: tuple[Symbol, ...]
    code_ranges: tuple[tuple[int, int], ...]
    elf: bytes = b""
    read_code: list[Any] = field(init=False, repr=False, default_factory=list)
    _by_name: dict[str, Symbol] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        self._by_name.update({symbol.name: symbol for symbol in self.symbols})

    def __getitem__(self, name: str) -> Symbol:
        return self._by_name[name]

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def functions(self) -> list[Symbol]:
        """All functions by rising address; of several names for one place the first."""
        seen: dict[int, Symbol] = {}
        for symbol in self.symbols:
            if symbol.function:
                seen.setdefault(symbol.address, symbol)
        return [seen[address] for address in sorted(seen)]

    def place(self, address: int) -> str:
        """An address as FUNCTION+0xOFFSET."""
        functions = self.functions()
        at = bisect_right([f.address for f in functions], address) - 1
        if at < 0 or address >= functions[at].address + max(functions[at].size, 2):
            return f"{address:#010x}"
        return f"{functions[at].name}+{address - functions[at].address:#x}"

    def read(self, address: int, size: int) -> bytes:
        """Initial content of flash or RAM."""
        for s in self.sections:
            if s.content and s.address <= address and address + size <= s.address + s.size:
                return s.content[address - s.address : address - s.address + size]
        return bytes(size)


@dataclass(frozen=True)
class TargetContext:
    """Everything ``target.c.jinja`` asks for."""

    names: tuple[str, ...]
    increments: tuple[tuple[str, str], ...]
    work: int
    results: int
    stack: int
    fpu: bool
    selftest: bool


@dataclass(frozen=True)
class LinkContext:
    """Everything ``target.ld.jinja`` asks for."""

    flash: int
    flash_size: int
    ram: int
    ram_size: int


def build(core: Core, chain: Toolchain, plans: Sequence[Plan], folders: Sequence[Path],
          drivers: Sequence[str], flags: Sequence[str] = EXACT,
          selftest: bool = False) -> Program:  # fmt: skip
    """Compile and link the C of plans, one folder each, with the ``drivers`` that run them, and their
    self-tests where they are to be run, too.

    Raises BuildError where they do not compile, MissingExtra without pyelftools.
    """
    names = tuple(plan.name for plan in plans)
    increments = tuple((p.name, p.increment.ctype) for p in plans)
    context = TargetContext(names, increments, core.work, core.results, STACK, core.single, selftest)
    with temporary_folder() as scratch:
        base, sources = scratch, []
        (base / "target.c").write_text(render("target.c.jinja", context))
        memory = LinkContext(FLASH, FLASH_SIZE, RAM, RAM_SIZE)
        (base / "target.ld").write_text(render("target.ld.jinja", memory))
        for plan, folder, text in zip(plans, folders, drivers):
            (base / f"{plan.name}_driver.c").write_text(text)
            sources += [Path(folder) / f"{plan.name}.c", base / f"{plan.name}_driver.c"]
            sources += [Path(folder) / f"{plan.name}_selftest.c"] if selftest else []
        link(chain, core, [base / "target.c", *sources], base / "target.ld", base / "target.elf",
             "focgen_start", list(folders), flags)  # fmt: skip
        return read_program(core, chain, names, (base / "target.elf").read_bytes())


def read_program(core: Core, chain: Toolchain, names: tuple[str, ...], elf: bytes) -> Program:
    """The parts of an ELF file. Raises MissingExtra without pyelftools."""
    try:
        from elftools.elf.elffile import ELFFile
    except ImportError:
        raise MissingExtra.of("pyelftools", "targets", "reading what was linked") from None
    file = ELFFile(io.BytesIO(elf))
    sections = tuple(_sections(file))
    symbols, marks = _symbols(file)
    code = [s for s in sections if s.kind == "code"]
    ranges = tuple(r for s in code for r in _code_ranges(s, marks))
    return Program(core, chain, names, sections, tuple(symbols), ranges, elf)


def _sections(file: Any) -> Iterator[Section]:
    for section in file.iter_sections():
        flags, size = section["sh_flags"], section["sh_size"]
        if not flags & 2 or not size:  # not loaded
            continue
        kind = "code" if flags & 4 else "data" if flags & 1 else "constants"
        content = b"" if section["sh_type"] == "SHT_NOBITS" else section.data()
        yield Section(section.name, section["sh_addr"], content, size, kind)


def _symbols(file: Any) -> tuple[list[Symbol], list[tuple[int, bool]]]:
    """Functions and objects; and the marks where code ($t, $x) and data ($d) begin within sections."""
    found, marks = [], []
    code = {i for i, section in enumerate(file.iter_sections()) if section["sh_flags"] & 4}
    for entry in file.get_section_by_name(".symtab").iter_symbols():
        kind, address = entry["st_info"]["type"], entry["st_value"]
        if entry.name.startswith(("$t", "$x", "$d", "$a")):
            if entry["st_shndx"] in code:
                marks.append((address, not entry.name.startswith("$d")))
        elif kind in ("STT_FUNC", "STT_OBJECT"):
            function = kind == "STT_FUNC"
            place = address & ~1 if function else address
            found.append(Symbol(entry.name, place, entry["st_size"], function))
    return found, sorted(set(marks))


def _code_ranges(section: Section, marks: list[tuple[int, bool]]) -> Iterator[tuple[int, int]]:
    """The parts of a code section that are instructions; all of it where nothing is marked."""
    end = section.address + section.size
    inside = [(a, is_code) for a, is_code in marks if section.address <= a < end]
    if not inside or inside[0][0] > section.address:
        inside.insert(0, (section.address, True))
    for (begin, is_code), (stop, _) in zip(inside, [*inside[1:], (end, False)]):
        if is_code and stop > begin:
            yield begin, stop
