"""Bytes of constant tables, as they are said and as the C has them.

Red when the manifest counts a table that is not there, or leaves one out.
"""

from __future__ import annotations

import re
from itertools import product

import pytest

from focgen.codegen.generate import generate
from focgen.control.controller import GainSchedule
from focgen.fractional.transfer import TransferFunction
from tests.controllers import seed_controller, simple

SIZES = {"int16_t": 2, "int32_t": 4, "float": 4, "double": 8, "uint8_t": 1, "foc_block": 6}
MODES = {"foc_mode_q15": 4, "foc_slow_mode_q15": 8, "foc_mode_q31": 8, "foc_mode_f32": 8, "foc_mode_f64": 16}
TABLE = re.compile(r"^static const FOC_ROM (\w+) \w+\[(\d+)\] = \{$", re.MULTILINE)
LEAD = TransferFunction([(0.05, 0.6), (2.0, 0.0), (3.0, -0.4)], [(0.01, 0.8), (1.0, 0.0)])
ONE_TAP = TransferFunction([(1.0, 0.0)], [(0.5, 1.0), (1.0, 0.0)])


SLOW = [("lead", "exponential", "q15"), ("lead", "exponential", "q31")]  # to find the poles of


@pytest.mark.parametrize(
    "transfer, memory, arithmetic",
    [
        pytest.param(
            transfer, *how, id="-".join((name, *how)), marks=pytest.mark.long if (name, *how) in SLOW else ()
        )
        for name, transfer in (("lead", LEAD), ("one tap", ONE_TAP), ("schedule", None))
        for how in product(("short", "exponential"), ("q15", "q31", "f32"))
    ],
)
def test_the_bytes_of_tables_are_those_of_the_c(tmp_path, arithmetic, memory, transfer):
    if transfer is None:
        controller = seed_controller(60, gain=GainSchedule((0.05, 0.1, 0.2), (500.0, 420.0, 350.0)))
    else:
        controller = simple(transfer, sample_time=0.001)
    manifest = generate(controller, tmp_path, arithmetic, memory=memory, name="c").manifest
    found = TABLE.findall((tmp_path / "c.c").read_text())
    assert found
    assert manifest["sizes"]["table_bytes"] == sum(int(n) * {**SIZES, **MODES}[kind] for kind, n in found)
