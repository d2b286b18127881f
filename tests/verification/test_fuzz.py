"""The fuzzer's targets: clean for a moment on what is generated, and faults that were sown are found.

Red when a sown fault is not found, or a clean controller complains.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.proofs.fuzz import fuzz, missing
from tests.proofs.spread import generated

FAULTS = {
    "ring wraps with >": ("f32", "foc_rt.h", r"now \+ 1u < size", "now < size"),
    "NaN gets in": ("f32", "inverse.c", r" \|\| !foc_usable_f32\(meas\)", ""),
    "infinity gets in": ("f64", "foc_rt.h", r"0x5ff0000000000000u", "0x7ff0000000000001u"),
    "product too large": ("q15", "foc_rt.h", r"\(int32_t\)weights\[i\] \*", "4 * (int32_t)weights[i] *"),
    "output clamp lost": ("q31", "inverse.c", r"foc_clamp64\((s->integral.*), \S+, \S+\);", r"\1;"),
}


def target(folder: Path, arithmetic: str):
    if lacks := missing():
        pytest.skip(lacks)
    return generated(folder, "inverse", arithmetic, 6)


@pytest.mark.parametrize("arithmetic", ["q31"])
def test_what_is_generated_is_clean_for_a_moment(arithmetic, tmp_path):
    """``make fuzz-c`` gives it more than a moment."""
    done = fuzz(target(tmp_path, arithmetic), tmp_path, 2)
    assert done.found == "" and done.executions > 500 and done.coverage > 50


@pytest.mark.parametrize(
    "fault", [name if i == 0 else pytest.param(name, marks=pytest.mark.long) for i, name in enumerate(FAULTS)]
)
def test_a_fault_is_found(fault, tmp_path):
    arithmetic, file, pattern, by = FAULTS[fault]
    plan = target(tmp_path, arithmetic)
    text, places = re.subn(pattern, by, (tmp_path / file).read_text())
    assert places, fault
    (tmp_path / file).write_text(text)
    assert fuzz(plan, tmp_path, 60).found, fault
