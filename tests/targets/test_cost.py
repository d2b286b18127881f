"""What a step costs: counts beside slow counting, stack beside the compiler's own figures, exact sizes.

Red when a count, a size or a stack is not what slow counting or the compiler says.
"""

from __future__ import annotations

import functools
import json
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.control.controller import Tunable
from focgen.targets import program
from focgen.targets.calls import call_costs
from focgen.targets.cores import CORES, core
from focgen.targets.cost import cost_of, cost_on
from focgen.targets.driver import CALLS
from focgen.targets.library import TargetLibrary
from focgen.targets.stack import Stack
from focgen.targets.steps import step_costs
from focgen.targets.toolchains import EXACT, toolchains
from focgen.verification.costs import cost
from focgen.verification.folder import read_folder
from focgen.verification.remembered import REMEMBERED
from tests.c_code import cross_compiler, tool
from tests.conftest import paper_controller
from tests.targets.test_verify import ZIG, piece

pytest.importorskip("unicorn")
pytest.importorskip("ziglang")


def once(link):
    """``link`` that gives what the same sources, headers and flags have given before."""
    made = {}

    def linked(chain, core, sources, script, target, entry, include=(), flags=EXACT):
        headers = [header for folder in include for header in sorted(folder.glob("*.h"))]
        read = tuple((file.name, file.read_bytes()) for file in (*sources, script, *headers))
        key = chain, core.name, entry, tuple(flags), read
        if key not in made:
            link(chain, core, sources, script, target, entry, include, flags)
            made[key] = target.read_bytes()
        target.write_bytes(made[key])

    return linked


@pytest.fixture(scope="module", autouse=True)
def linked_once():
    """Several tests ask for the same program on the same core."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(program, "link", once(program.link))
        yield


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Generated folders, by arithmetic and length."""
    base = tmp_path_factory.mktemp("cost")
    made = {}
    for arithmetic, length in (("q15", 12), ("q31", 12), ("f32", 12), ("f32", 38)):
        path = base / f"{arithmetic}_{length}"
        generate(paper_controller(length), path, arithmetic, name=f"c{arithmetic}{length}")
        made[arithmetic, length] = read_folder(path)
    return made


@pytest.fixture(scope="module")
def costs(folders):
    """What a folder costs on a core, by folder and core; counted once."""
    return functools.cache(lambda key, name: cost_on(core(name), ZIG, folders[key].plan, folders[key].path))


def library_of(read, name: str, chain=ZIG) -> TargetLibrary:
    return TargetLibrary(core(name), chain, [read.plan], [read.path])


@pytest.mark.parametrize(
    "name", ("cortex-m0plus", "cortex-m4", pytest.param("rv32imac", marks=pytest.mark.long))
)
def test_instructions_are_those_a_slow_count_gives(folders, name):
    """One by one in Python, from the entry of the step to its return."""
    read = folders["q15", 12]
    library, steps = library_of(read, name), 20
    fast = step_costs(library, read.plan, steps).instructions
    step = library.program[f"{read.plan.name}_step"]
    counts, inside, back = [], False, None

    def see(machine, address, size, _):
        nonlocal inside, back
        if address == step.address:
            inside, back = True, machine.reg_read(library.machine._names["lr"]) & ~1
            counts.append(0)
        elif address == back:
            inside = False
        counts[-1:] = [counts[-1] + inside] if counts else []

    machine = library.machine._machine
    machine.hook_add(library.machine._uc.UC_HOOK_CODE, see)
    machine.ctl_flush_tb()
    step_costs(library, read.plan, steps)
    assert counts[1:] == fast.tolist() and len(set(fast)) > 1


@pytest.mark.parametrize("name", (pytest.param("cortex-m0plus", marks=pytest.mark.long), "cortex-m4"))
def test_a_call_costs_what_a_slow_count_gives(tmp_path, name):
    """One by one in Python, from the entry of each call to its return; tune among them."""
    controller = replace(paper_controller(12), tunable=Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0)))
    generate(controller, tmp_path, "f32", name="tuned", tunable=True)
    read = read_folder(tmp_path)
    library = library_of(read, name)
    step_costs(library, read.plan, 3)
    fast = {call: cost.instructions for call, cost in call_costs(library, read.plan).items()}
    entries = {library.program[f"tuned_{call}"].address: call for call in CALLS}
    anew, counts, inside, back = library.program["tuned_call"].address, dict.fromkeys(CALLS, 0), "", None

    def see(machine, address, size, _):
        nonlocal inside, back
        if not inside and address in entries:
            inside, back = entries[address], machine.reg_read(library.machine._names["lr"]) & ~1
        elif address in (back, anew):  # a call that is the last thing returns to where its caller would
            inside = ""
        if inside:
            counts[inside] += 1

    library.machine._machine.hook_add(library.machine._uc.UC_HOOK_CODE, see)
    library.machine._machine.ctl_flush_tb()
    call_costs(library, read.plan)
    assert counts == fast and min(fast.values()) > 5 and fast["reset"] > fast["track"]


def per_tap(reads, core_name, steps):
    """Instructions and cycles that one more past sample costs a step; mean of ``steps`` steps."""
    library = TargetLibrary(core(core_name), ZIG, [r.plan for r in reads], [r.path for r in reads])
    short, long = (step_costs(library, read.plan, steps) for read in reads)
    taps = reads[1].plan.length - reads[0].plan.length
    instructions = (long.instructions.mean() - short.instructions.mean()) / taps
    if short.cycles is None:
        return instructions, None
    return instructions, (long.cycles.mean() - short.cycles.mean()) / taps


@pytest.mark.long
def test_a_tap_costs_the_slope_between_two_lengths(folders):
    """On the Cortex-M4 a multiplication, an addition, two loads and a share of the loop."""
    reads = folders["f32", 12], folders["f32", 38]
    instructions, cycles = per_tap(reads, "cortex-m4", 30)
    assert 4.0 <= instructions <= 9.0 and instructions < cycles < 13.0
    assert per_tap(reads, "cortex-m7", 4)[1] is None


def test_bytes_of_26_more_taps(costs):
    """In float each is a word of flash and a word of RAM; the code stays within what unrolling changes."""
    short, long = (costs(("f32", length), "cortex-m4") for length in (12, 38))
    assert long.ram_bytes - short.ram_bytes == 104
    assert long.flash["constants"] - short.flash["constants"] == 104
    whole = costs(("q15", 12), "cortex-m4")
    assert whole.flash["compiler"] == 0 and whole.flash_bytes == sum(whole.flash.values())
    assert (
        0 < short.flash["compiler"] == long.flash["compiler"] < 500
    )  # an integral in 64 bits, to a float and back
    assert 100 < short.save_bytes < 2000 and 100 < long.save_bytes < 2000


def test_flash_is_what_the_toolchain_says(folders):
    """arm-none-eabi-size of the object, where it is installed."""
    tool("arm-none-eabi-size")
    from focgen.targets.cost import object_sizes
    from focgen.targets.toolchains import compile_object

    for read in folders.values():
        elf = compile_object(ZIG, core("cortex-m3"), read.path / f"{read.plan.name}.c", [read.path],
                             ("-O2", "-std=c99", "-fno-unwind-tables"))  # fmt: skip
        (read.path / "object.o").write_bytes(elf)
        said = subprocess.run(["arm-none-eabi-size", read.path / "object.o"], capture_output=True, text=True)
        text, data, bss = map(int, said.stdout.splitlines()[1].split()[:3])
        sizes, _ = object_sizes(elf)
        exception_index = text - sizes["code"] - sizes["save"] - sizes["constants"]
        assert sizes["save"] > 100
        assert 0 <= exception_index <= 8 * 12 and data + bss == sizes["data"] == 0


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            one.name, marks=pytest.mark.long if one.name in ("cortex-m3", "cortex-m7", "rv32imac") else ()
        )
        for one in CORES
    ],
)
def test_the_stack_that_is_used_is_the_stack_that_is_told(folders, costs, name):
    """Painted memory against paths through machine code: never more, and not much less but for the call that
    mends a damaged state, which these steps do not make.
    """
    for key in (("q15", 12), ("f32", 12)):
        read = folders[key]
        found = costs(key, name)
        told = Stack(library_of(read, name).program).depth(f"{read.plan.name}_step")
        mending = [int(part.split()[-1]) for part in told.path if "_recover " in part]
        assert told.bytes - 16 - sum(mending) <= found.stack_seen <= told.bytes <= found.stack_bytes
        assert sum(int(part.split()[-1]) for part in found.stack_path) == found.stack_bytes


def test_frames_are_those_of_the_compiler(folders, tmp_path):
    """GCC's -fstack-usage, where it is installed."""
    cross_compiler("arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-fstack-usage")
    for name in ("cortex-m0plus", "cortex-m3", "cortex-m4"):
        chain = next(c for c in toolchains(core(name)) if "gcc" in c.name)
        for read in folders.values():
            source, target = read.path / f"{read.plan.name}.c", tmp_path / "frames.o"
            flags = [*core(name).gcc, *EXACT, "-fno-tree-loop-distribute-patterns", "-fstack-usage"]
            subprocess.run([*chain.command, *flags, "-c", source, "-o", target], check=True)
            lines = [line.split() for line in (tmp_path / "frames.su").read_text().splitlines()]
            said = {parts[0].rsplit(":", 1)[1]: int(parts[1]) for parts in lines}
            stack = Stack(library_of(read, name, chain).program)
            for function, size in said.items():
                if function in stack._program:
                    assert stack._frame(stack._program[function].address).bytes == size, (name, function)


def test_the_deepest_path_and_what_cannot_be_told(tmp_path):
    deep = """{ return 0; }
    __attribute__((noinline)) uint32_t leaf(uint32_t n) { volatile uint32_t a[40]; a[n] = n; return a[n]; }
    __attribute__((noinline)) uint32_t middle(uint32_t n) { volatile uint32_t a[9];
        a[n] = leaf(n) + leaf(n + 1); return a[n]; }
    __attribute__((noinline)) uint32_t flat(uint32_t n) { volatile uint32_t a[20]; a[n] = n; return a[n]; }
    __attribute__((noinline)) uint32_t top(uint32_t n) { return middle(n) + flat(n); }
    __attribute__((noinline)) uint32_t self(uint32_t n) { return n < 2 ? n : self(n - 1) * self(n - 2) + n; }
    uint32_t (*volatile pointer)(uint32_t) = leaf;
    __attribute__((noinline)) uint32_t through(uint32_t n) { return pointer(n) + 1; }
    """
    kept = "".join(f'__asm volatile("" :: "r"({name}));' for name in ("top", "self", "through"))
    deep += f"void spba_keep(void); void spba_keep(void) {{ {kept} }}"
    deep = deep.replace("{ return 0; }", "{ extern void spba_keep(void); spba_keep(); return 0; }", 1)
    for name in ("cortex-m0plus", "cortex-m4", "rv32imac"):
        stack = Stack(piece(name, deep, tmp_path))
        found = stack.depth("top")
        assert [part.split()[0] for part in found.path] == ["top", "middle", "leaf"]
        assert 160 + 36 + 8 <= found.bytes <= 160 + 36 + 64
        with pytest.raises(ValueError, match="self calls itself"):
            stack.depth("self")
        with pytest.raises(ValueError, match="pointer"):
            stack.depth("through")


# ------------------------------------------------------------------------------------------ the command


def test_the_command_remembers_what_the_controller_has_cost(tmp_path, capsys):
    def counted():
        assert main(["cost", str(tmp_path / "c"), "--target", "cortex-m3", "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    generate(paper_controller(8), tmp_path / "c", "q15")
    first = counted()
    assert "previous" not in first["targets"]["cortex-m3"]
    generate(paper_controller(20), tmp_path / "c", "q15")
    second = counted()["targets"]["cortex-m3"]
    mine = first["targets"]["cortex-m3"]
    assert second["previous"] == mine
    assert second["instructions_per_step"]["mean"] > mine["instructions_per_step"]["mean"]
    assert counted()["targets"]["cortex-m3"]["previous"] == mine  # generated once, counted twice
    assert main(["cost", str(tmp_path / "c"), "--target", "cortex-m3"]) == 0
    assert " %)" in capsys.readouterr().out
    assert main(["verify", str(tmp_path / "c"), "--samples", "100"]) == 0  # the manifest does not mind
    capsys.readouterr()
    (tmp_path / "c" / REMEMBERED).write_text('{"zig": {"targets": 3}}')
    assert "previous" not in counted()["targets"]["cortex-m3"]


def test_the_command_compares_folders_and_names_what_it_skips(tmp_path, capsys, monkeypatch):
    for arithmetic in ("q15", "q31"):
        generate(paper_controller(8), tmp_path / arithmetic, arithmetic)
    assert main(["cost", str(tmp_path), "--target", "rv32imac"]) == 0
    out = capsys.readouterr().out
    assert "spba q15 short 8" in out and "spba q31 short 8" in out and "zig cc" in out
    found = cost(tmp_path / "q15", "rv32imac", against=tmp_path / "q31").controllers[0]
    assert found.previous["rv32imac"].ram_bytes > found.targets["rv32imac"].ram_bytes
    assert found.targets["rv32imac"].cycles_per_step is None
    from focgen.targets import toolchains as module

    monkeypatch.setattr(module.shutil, "which", lambda name: None)
    module._gcc_of.cache_clear()
    argv = ["cost", str(tmp_path / "q15"), "--target", "cortex-m3", "--compiler", "gcc"]
    assert main(argv) == 1  # nothing was counted
    assert "apt-get install gcc-arm-none-eabi" in capsys.readouterr().out
    assert main([*argv, "--json"]) == 1
    assert "apt-get" in json.loads(capsys.readouterr().out)["skipped"]
    module._gcc_of.cache_clear()


def test_the_keys_of_the_json(folders, capsys):
    assert main(["cost", str(folders["q15", 12].path), "--target", "cortex-m4", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for entry in (found, found["targets"]["cortex-m4"]):
        assert {"instructions_per_step", "cycles_per_step"} <= set(entry)
        assert {"flash_bytes", "ram_bytes", "stack_bytes"} <= set(entry)
    assert "model" in found["cycles_per_step"]["how"]
    assert np.isfinite(found["instructions_per_step"]["worst"])
    manifest = json.loads((folders["q15", 12].path / "manifest.json").read_text())
    assert found["ram_bytes"] == manifest["sizes"]["state_bytes"]
    assert found["calls"].keys() == {"init", "reset", "track", "save", "restore"}
    assert all(0 < call["instructions"] < call["cycles"] for call in found["calls"].values())
    assert found["runtimes"] is None


def test_a_small_core_is_counted_with_every_runtime(folders, monkeypatch):
    """The other compiler's, or the line that installs it; remembered like the rest."""
    path = folders["q15", 12].path
    (found,) = cost(path, "cortex-m0plus").controllers
    runtimes = found.targets["cortex-m0plus"].runtimes
    own, other = runtimes.values()
    assert own.instructions_per_step == found.targets["cortex-m0plus"].instructions_per_step.mean
    assert (other.skipped is None) == (other.instructions_per_step is not None)
    assert other.skipped is None or "apt-get install gcc-arm-none-eabi" in other.skipped
    remembered = json.loads((path / REMEMBERED).read_text())["zig"]["targets"]["cortex-m0plus"]
    assert cost_of(remembered) == found.targets["cortex-m0plus"]


@pytest.mark.parametrize("arguments", (["nowhere"], [".", "--target", "z80"], [".", "--compiler", "tcc"]))
def test_unusable_arguments_are_an_error_of_one_line(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["cost", *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1
