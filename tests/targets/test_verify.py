"""Generated C on emulated cores agrees with the reference in every bit; what silicon would refuse is seen.

Red when a core gives another bit unseen, or a fault of silicon passes.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace

import pytest

from focgen.cli.main import main
from focgen.codegen.generate import folder_files, generate
from focgen.control.controller import Tunable
from focgen.control.files import controller_text
from focgen.errors import PlanError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.targets import avr, qemu, toolchains
from focgen.targets.cores import CORES, core
from focgen.targets.driver import Answers, header_scales
from focgen.targets.emulator import Machine, TargetFault
from focgen.targets.legality import forbidden
from focgen.targets.library import TargetLibrary
from focgen.targets.program import build
from focgen.verification.compare import answered, cases_of, compare, judged
from focgen.verification.folder import read_folder
from focgen.verification.verify import verify
from tests.conftest import paper_controller
from tests.controllers import random_controller
from tests.verification.test_mutations import filter_controller

pytest.importorskip("unicorn")
pytest.importorskip("ziglang")

ARITHMETICS = ("f64", "f32", "q31", "q15")
NAMES = [one.name for one in CORES]
ZIG = toolchains.toolchains(core("cortex-m3"))[0]


def written(controllers, folder, arithmetics=ARITHMETICS, memory="short"):
    """Plans of every controller in every arithmetic that can carry it, and their C in one folder."""
    plans = []
    for controller in controllers:
        for arithmetic in arithmetics:
            name = f"{controller.name}_{arithmetic}_{memory}"
            try:
                plans.append(build_plan(controller, arithmetic, name=name, memory=memory))
            except PlanError:
                continue
            write_files(folder, folder_files(plans[-1], controller_text(controller).encode()))
    return plans


def agree(name: str, chain, plans, folder, samples: int, worst: int | None) -> Counter:
    """Every sample of every plan, and the state's bytes after every run; how many by arithmetic."""
    counted = Counter()
    library = TargetLibrary(core(name), chain, plans, [folder] * len(plans))
    assert library.illegal() == ()
    for plan in plans:
        cases = cases_of(plan, samples, 3, worst)
        seen, scales = answered(library, plan, cases)
        result = judged(plan, cases, seen, scales, None)
        assert result.sound and result.samples >= samples, f"{plan.name} on {name}: {result.first or result}"
        counted[plan.arithmetic] += result.samples
    return counted


@pytest.fixture(scope="module")
def some(tmp_path_factory):
    """A schedule with an integrator, and a recursion with terms of negative order, in every arithmetic; the
    former with exponential memory, too.
    """
    folder = tmp_path_factory.mktemp("some")
    plans = written([paper_controller(16), replace(filter_controller(), length=12)], folder)
    plans += written([paper_controller(16)], folder, memory="exponential")
    return plans, folder


def covering(plans, name: str, third: int):
    """One ``third`` of the plans for a core, another one for the next: each has every arithmetic, and every
    plan runs on one core or two.
    """
    kinds = len(ARITHMETICS)
    return [p for k, p in enumerate(plans) if (k % kinds + k // kinds + NAMES.index(name)) % 3 == third]


@pytest.mark.parametrize(
    "third, name",
    [
        pytest.param(
            third, name, marks=pytest.mark.long if third or name in ("cortex-m3", "cortex-m4") else ()
        )
        for third in range(3)
        for name in NAMES
    ],
)
def test_every_arithmetic_agrees_in_every_bit(some, name, third):
    plans, folder = some
    assert len(plans) == 3 * len(ARITHMETICS)
    plans = covering(plans, name, third)
    assert {plan.arithmetic for plan in plans} == set(ARITHMETICS)
    for chain in toolchains.toolchains(core(name)):
        agree(name, chain, plans, folder, 300, worst=300)


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("memory", ("short", "exponential"))
def test_random_controllers_agree_in_every_bit_on_every_core(name, memory, tmp_path):
    """At least 100,000 samples of every arithmetic and form of memory."""
    plans = written([random_controller(seed, 40) for seed in range(2000, 2010)], tmp_path, memory=memory)
    counted = agree(name, ZIG, plans, tmp_path, 6000, worst=6000)
    assert all(counted[arithmetic] >= 100_000 for arithmetic in ARITHMETICS), counted


@pytest.mark.long
@pytest.mark.parametrize("arithmetic", ("q15", "q31", "f32"))
@pytest.mark.parametrize("memory", ("short", "exponential"))
def test_random_controllers_agree_in_every_bit_on_an_avr(arithmetic, memory, tmp_path):
    """As many samples there; the state with them."""
    found = [random_controller(seed, 24) for seed in range(2000, 2010)]
    plans, counted = written(found, tmp_path, [arithmetic], memory), 0
    if avr.missing(plans[0]):
        pytest.skip(avr.missing(plans[0]))
    for plan in plans:
        library, cases = avr.AvrLibrary(plan, tmp_path), cases_of(plan, 9000, 3, 3000)
        seen = [library.answers(plan, case.scenario) for case in cases.cases]
        result = judged(plan, cases, seen, header_scales(plan), None, alignment=library.alignment)
        assert result.sound, f"{plan.name}: {result.first}"
        counted += result.samples
    assert counted >= 100_000


# ------------------------------------------------------------------------- what shows on the target only


def sown(tmp_path, arithmetic, file, pattern, by):
    """A folder with one change in its text."""
    folder = generate(paper_controller(16), tmp_path / "broken", arithmetic).folder
    before = (folder / file).read_text()
    after = re.sub(pattern, by, before)
    assert after != before
    (folder / file).write_text(after)
    return folder


def test_a_sum_in_long_is_right_here_and_wrong_there(tmp_path):
    """64 bits on the host, 32 on a Cortex-M: the host alone would pass it."""
    folder = sown(tmp_path, "q31", "foc_rt.h", r"int64_t sum = 0;", "long sum = 0;")
    found = verify(folder, 400, target=("host", "cortex-m3"), edited=True)
    assert found.targets["host"].mismatches == 0 and found.targets["cortex-m3"].mismatches > 0
    assert not found.holds and "zig" in found.targets["cortex-m3"].first


def test_contraction_shows_where_the_core_has_a_fused_multiply_add(tmp_path):
    flags = ("-O2", "-std=gnu11", "-ffp-contract=fast")
    plan = written([paper_controller(16)], tmp_path, ["f32"])[0]
    runtime = (tmp_path / "foc_rt.h").read_text()
    (tmp_path / "foc_rt.h").write_text(runtime.replace("#pragma STDC FP_CONTRACT OFF", ""))
    for name, contracts in (("cortex-m7", True), ("cortex-m3", False)):
        library = TargetLibrary(core(name), ZIG, [plan], [tmp_path], flags)
        assert (compare(plan, library, 400, 0).mismatches > 0) == contracts


def test_c_that_never_returns(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("focgen.targets.library.PATIENCE", 0.5)
    hang = "s->error_now = 0; for (;;) { s->flags++; }"
    folder = sown(tmp_path, "q15", "spba.c", r"s->error_now = 0;", hang)
    monkeypatch.setattr("focgen.verification.compare.PATIENCE", 0.5)
    assert main(["verify", str(folder), "--samples", "200", "--edited", "--target", "cortex-m3"]) == 1
    assert re.search(r"the C did not return within [\d.]+ s, at spba_", capsys.readouterr().out)


# --------------------------------------------------------------------- what the emulator alone would let pass


PIECES = {
    "cortex-m0plus": (
        (('{ static uint32_t w[2]; uint32_t a; __asm volatile("ldr %0, [%1]" : "=l"(a) : '
         '"l"((char *)w + 2)); return a; }'), "not aligned"),
        (('{ static uint32_t w[2]; __asm volatile("strh %0, [%0, %1]" : : "l"(w), "l"(1)); '
         'return 0; }'), "not aligned"),
        (('{ static uint32_t w[2]; uint32_t a; __asm volatile("ldrb %0, [%1, #1]" : "=l"(a) : '
         '"l"(w)); return a; }'), None),
    ),
    "cortex-m4": (
        (('{ static uint32_t w[4]; uint32_t a, b; __asm volatile("ldrd %0, %1, [%2, #0]" : '
         '"=r"(a), "=r"(b) : "r"((char *)w + 2)); return a + b; }'), "not aligned"),
        (('{ static uint32_t w[4]; __asm volatile("ldmia %0, {r1, r2}" : : '
         '"r"((char *)w + 1) : "r1", "r2", "memory"); return 0; }'), "not aligned"),
        (('{ static uint32_t w[4]; __asm volatile("vldr s0, [%0]" : : "r"((char *)w + 1) : '
         '"s0", "memory"); return 0; }'), "not aligned"),
        ("{ static volatile uint32_t w[2]; return *(volatile uint32_t *)((char *)w + 2); }",
         None),
        ("{ *(volatile uint32_t *)0x100u = 1; return 0; }", "failed"),
        ("{ return *(volatile uint32_t *)0x40000000u; }", "failed"),
        ("{ for (;;) { } }", "did not return"),
    ),
}  # fmt: skip


def piece(name: str, text: str, tmp_path, flags=("-O1", "-std=gnu11")):
    head = "#include <stdint.h>\nuint32_t piece(void);\nuint32_t piece(void) "
    (tmp_path / "piece.c").write_text(f"{head}{text}\n")
    plan = replace(build_plan(paper_controller(2), "q15", name="spba"))
    write_files(tmp_path, folder_files(plan, b""))
    driver = f'{(tmp_path / "piece.c").read_text()}\n#include "spba.h"\n' + DRIVER
    return build(core(name), ZIG, [plan], [tmp_path], [driver], flags)


DRIVER = """
void spba_run(void);
void spba_run(void) { (void)piece(); }
void spba_scales(double *s);
void spba_scales(double *s) { (void)s; }
const void *spba_bytes(uint32_t *size);
const void *spba_bytes(uint32_t *size) { return size; }
"""


@pytest.mark.parametrize(
    "name, text, says",
    [
        pytest.param(name, *one, marks=pytest.mark.long if turn in (2, 4) else ())
        for name, pieces in PIECES.items()
        for turn, one in enumerate(pieces)
    ],
)
def test_what_silicon_would_refuse(name, text, says, tmp_path):
    machine = Machine(piece(name, text, tmp_path))
    machine.watch()
    if says is None:
        machine.call("piece", seconds=5.0)
        return
    with pytest.raises(TargetFault, match=says):
        machine.call("piece", seconds=0.5 if "return" in says else 5.0)


@pytest.mark.parametrize(
    "built, runs_on, text, says",
    [
        ("cortex-m4", "cortex-m3", ('{ uint32_t a = 1; __asm volatile("smlad %0, %0, %0, %0" : '
         '"+r"(a)); return a; }'), "smlad (DSP extension)"),
        pytest.param("cortex-m4", "cortex-m3", ('{ uint32_t a = 1; __asm volatile("sxtab16 %0, %0, %0" : '
         '"+r"(a)); return a; }'), "sxtab16 (DSP extension)", marks=pytest.mark.long),
        ("cortex-m4", "cortex-m3", "{ static volatile float x = 2; x = x * x; return 0; }",
         "vmul.f32 (floating-point unit)"),
        pytest.param("cortex-m7", "cortex-m4", "{ static volatile double x = 2; x = x * x; return 0; }",
         "vmul.f64 (double-precision unit)", marks=pytest.mark.long),
        ("cortex-m3", "cortex-m0plus", "{ static volatile uint32_t x = 2; return 7u / x; }",
         "udiv (hardware division)"),
        pytest.param("cortex-m3", "cortex-m3", "{ static volatile int8_t x = 2; return (uint32_t)(x * 3); }",
         None, marks=pytest.mark.long),
    ],
)  # fmt: skip
def test_instructions_that_the_core_does_not_have(built, runs_on, text, says, tmp_path):
    program = replace(piece(built, text, tmp_path), core=core(runs_on))
    found = [one for one in forbidden(program) if "piece+" in one or "spba_run+" in one]
    assert (not found) if says is None else any(one.startswith(says) for one in found), found


# -------------------------------------------------------------- other emulators, where they are installed


@pytest.mark.parametrize("name", [one.name for one in CORES if one.board])
def test_qemu_says_the_same(some, name):
    """Every arithmetic, on a board that starts from reset."""
    if qemu.absent(core(name)):
        pytest.skip(qemu.absent(core(name)))
    plans, folder = some
    library = TargetLibrary(core(name), ZIG, plans, [folder] * len(plans))
    for plan in plans:
        cases = cases_of(plan, 160, 5, 160)
        seen = qemu.traces(library.program, plan, [case.scenario for case in cases.cases])
        result = judged(plan, cases, [Answers(trace, ()) for trace in seen], library.scales(plan), None)
        assert result.sound and result.samples >= 160, f"{plan.name} on {name}: {result.first}"


def test_qemu_sees_a_fault(tmp_path):
    if qemu.absent(core("cortex-m3")):
        pytest.skip(qemu.absent(core("cortex-m3")))
    folder = sown(tmp_path, "q15", "spba.c", r"s->error_now = 0;", "*(volatile int *)0x90000000u = 1;")
    read = read_folder(folder)
    library = TargetLibrary(core("cortex-m3"), ZIG, [read.plan], [folder])
    with pytest.raises(TargetFault, match="failed in QEMU"):
        qemu.traces(library.program, read.plan, [cases_of(read.plan, 16, 0).cases[0].scenario])


@pytest.mark.parametrize("arithmetic", ("q15", "q31", "f32"))
def test_an_avr_says_the_same(arithmetic, tmp_path):
    folder = generate(replace(filter_controller(), length=12), tmp_path, arithmetic).folder
    plan = read_folder(folder).plan
    if avr.missing(plan):
        pytest.skip(avr.missing(plan))
    found = verify(folder, 300, target="avr").targets["avr"]
    assert found.sound and found.samples > 300 and "simavr" in found.tools[0]
    path = folder / "filter.c"
    path.write_text(path.read_text().replace("s->error[s->error_now] = e;", "(void)e;"))
    assert verify(folder, 300, target="avr", edited=True).targets["avr"].mismatches > 0


@pytest.mark.parametrize("arithmetic", ("q31", "f32"))
def test_a_tunable_controller_runs_on_an_avr(arithmetic, tmp_path):
    """Its samples carry parameters behind the event, as many as it has."""
    tunable = replace(paper_controller(12), tunable=Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0)))
    folder = generate(tunable, tmp_path, arithmetic, tunable=True).folder
    if avr.missing(read_folder(folder).plan):
        pytest.skip(avr.missing(read_folder(folder).plan))
    found = verify(folder, 300, target="avr").targets["avr"]
    assert found.sound and found.samples > 300


@pytest.mark.parametrize("arithmetic", ("q15", "q31", "f32"))
def test_the_self_test_runs_on_an_avr(arithmetic, tmp_path):
    """What ``verify`` says of it is what the emulated board says; a history that is not kept shows."""
    folder = generate(paper_controller(12), tmp_path, arithmetic, selftest=True).folder
    if avr.missing(read_folder(folder).plan):
        pytest.skip(avr.missing(read_folder(folder).plan))
    assert verify(folder, 100, target="avr").targets["avr"].selftest == 0
    path = folder / "spba.c"
    path.write_text(path.read_text().replace("s->error[s->error_now] = e;", "(void)e;"))
    assert avr.AvrLibrary(read_folder(folder).plan, folder, selftest=True).selftest() > 0


def test_an_avr_has_no_double(tmp_path):
    folder = generate(paper_controller(8), tmp_path, "f64").folder
    assert "32 bits" in verify(folder, 100, target="avr").targets["avr"].skipped


def test_an_avr_without_its_tools_is_named(tmp_path, monkeypatch):
    folder = generate(paper_controller(8), tmp_path, "q15").folder
    monkeypatch.setattr(avr.shutil, "which", lambda name: None)
    assert "apt-get install gcc-avr" in verify(folder, 100, target="avr").targets["avr"].skipped


# ------------------------------------------------------------------------------------------ the command


def test_the_self_test_runs_on_the_core(tmp_path):
    """Compiled as it is told it agrees; a changed weight shows."""
    folder = generate(paper_controller(8), tmp_path, "f32", selftest=True).folder
    assert verify(folder, 100, target="cortex-m4").targets["cortex-m4"].selftest == 0
    path = folder / "spba.c"
    path.write_text(path.read_text().replace("s->error[s->error_now] = e;", "(void)e;"))
    assert verify(folder, 100, target="cortex-m4", edited=True).targets["cortex-m4"].selftest != 0


def test_the_command_names_its_tools(tmp_path, capsys):
    folder = generate(paper_controller(8), tmp_path / "out", "q15").folder
    assert main(["verify", str(folder), "--samples", "100", "--target", "rv32imac", "--json"]) == 0
    entry = json.loads(capsys.readouterr().out)["targets"]["rv32imac"]
    assert entry["mismatches"] == 0 and entry["samples"] > 100 and entry["error_bound"]
    assert "zig cc" in entry["tools"][0] and "unicorn" in entry["tools"][0]


def test_a_compiler_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr(toolchains.shutil, "which", lambda name: None)
    toolchains._gcc_of.cache_clear()
    assert any("apt-get install gcc-arm-none-eabi" in line for line in toolchains.absent(core("cortex-m4")))
    toolchains._gcc_of.cache_clear()
