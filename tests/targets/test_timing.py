"""The timing model beside cycles counted by hand from Arm's tables, and instruction counts that are exact.

Red when the model departs from cycles counted by hand.
"""

from __future__ import annotations

import pytest

from focgen.targets.cores import core
from focgen.targets.emulator import Machine
from focgen.targets.timing import timing
from tests.targets.test_verify import piece

pytest.importorskip("unicorn")
pytest.importorskip("ziglang")

LOOPS = {  # the body of a loop, its instructions and its cycles, each with the counter and the branch back
    "m0+: two loads, a product": (
        "cortex-m0plus", "ldrsh r2, [r1, r4]\n ldrsh r3, [r1, r4]\n muls r2, r3\n adds r5, r2\n adds r4, #0",
        7, 2 + 2 + 1 + 1 + 1 + 1 + 2),
    "m0+: several words": ("cortex-m0plus", "ldm r1!, {r2, r3}\n subs r1, #8\n stm r1!, {r2}\n subs r1, #4",
                           6, 3 + 1 + 2 + 1 + 1 + 2),
    "m0+: there and back": ("cortex-m0plus", "bl 2f\n b 3f\n 2: push {r4, lr}\n pop {r4, pc}\n 3:",
                            6, 3 + 2 + 3 + 5 + 1 + 2),
    "m3: 16 bits": ("cortex-m3", "ldrsh r2, [r1]\n ldrsh r3, [r1, #2]\n mla r5, r2, r3, r5", 5,
                    2 + 1 + 2 + 1 + 3),
    "m3: 32 bits": ("cortex-m3", "ldr r2, [r1]\n ldr r3, [r1, #4]\n smlal r4, r5, r2, r3", 5,
                    2 + 1 + 5.5 + 1 + 3),
    "m3: pointer chased": ("cortex-m3", "ldr r2, [r1]\n ldrb r3, [r2, #4]\n smull r4, r5, r2, r3", 5,
                           2 + 2 + 4 + 1 + 3),
    "m4: 32 bits": ("cortex-m4", "ldr r2, [r1]\n ldr r3, [r1, #4]\n smlal r4, r5, r2, r3", 5,
                    2 + 1 + 1 + 1 + 3),
    "m4: bases updated": ("cortex-m4", "ldr r2, [r1], #4\n ldr r3, [r1, #-4]!\n smlal r4, r5, r2, r3", 5,
                          2 + 2 + 1 + 1 + 3),
    "m4: four words at once": ("cortex-m4", "ldm r1, {r2, r3, r4, r5}\n smlad r2, r3, r4, r2", 4,
                               5 + 1 + 1 + 3),
    "m4: loaded, then stored": ("cortex-m4", ("movs r4, #0\n ldr r2, [r1]\n str r2, [r1, r4]\n "
                                "str r2, [r1, #4]"),
                                6,
                                1 + 2 + 1 + 1 + 1 + 3),
    "m4: two words": ("cortex-m4", "ldrd r2, r3, [r1]\n ldr r4, [r1]\n sdiv r4, r4, r1", 5,
                      3 + 2 + 7 + 1 + 3),
    "m4: float, one waits": ("cortex-m4", ("vldr s0, [r1]\n vldr s1, [r1, #4]\n vmul.f32 s2, s0, s1\n "
                             "vadd.f32 s3, s3, s2"), 6, 2 + 2 + 1 + 1 + 1 + 1 + 3),
    "m4: float, none waits": ("cortex-m4", ("vldm r1, {s0-s3}\n vmul.f32 s4, s0, s1\n vmul.f32 s5, s2, s3\n "
                              "vadd.f32 s6, s6, s4\n vadd.f32 s6, s6, s5"), 7, 5 + 1 + 1 + 2 + 1 + 1 + 3),
    "m4: float, slow ones": ("cortex-m4", ("vmla.f32 s0, s1, s2\n vdiv.f32 s3, s1, s1\n vmov r2, s4\n "
                             "vmov s4, r2"), 6, 3 + 14 + 1 + 1 + 1 + 3),
    "m4: a branch not taken": ("cortex-m4", "cmp r1, #0\n beq 2f\n it ne\n movne r2, #1\n 2:", 6,
                               1 + 1 + 2 + 1 + 3),
}  # fmt: skip


@pytest.mark.parametrize(
    "what", [pytest.param(w, marks=pytest.mark.long if turn % 3 else ()) for turn, w in enumerate(LOOPS)]
)
def test_cycles_counted_by_hand(what, tmp_path):
    """Ten more turns of a loop cost ten times its instructions and cycles."""
    name, body, instructions, cycles = LOOPS[what]
    few, many = (measured(name, body, turns, tmp_path) for turns in (10, 20))
    assert (many[0] - few[0], many[1] - few[1]) == (10 * instructions, 10 * cycles)


def measured(name: str, body: str, turns: int, tmp_path) -> tuple[int, float]:
    """Instructions and cycles of a function with the loop."""
    registers = "r2 r3 r4 r5 r6 lr memory cc" + (" s0 s1 s2 s3 s4 s5 s6" if name == "cortex-m4" else "")
    clobbers = ", ".join(f'"{r}"' for r in registers.split())
    lines = f".syntax unified\n movs r6, #{turns}\n movs r4, #0\n 1:\n {body}\n subs r6, #1\n bne 1b"
    text = "\\n\\t".join(line.strip() for line in lines.splitlines())
    held = '"+l"(p)'
    program = piece(name, f'{{ static float w[8]; float *p = w; register float *q __asm("r1") = p; w[1] = 1; '
                          f'__asm volatile("{text}" : {held.replace("p", "q")} : : {clobbers}); return 0; }}',
                    tmp_path)  # fmt: skip
    machine = Machine(program)
    machine.watch()
    machine.call("piece", seconds=5.0)
    ran = machine.executed()
    return int(ran.ran.sum()), timing(program).cycles(ran)


def test_no_cycles_where_none_are_published(tmp_path):
    for name in ("cortex-m7", "rv32imac"):
        assert timing(piece(name, "{ return 1; }", tmp_path)) is None
    assert core("cortex-m7").double
