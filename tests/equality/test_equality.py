"""The campaign of equality in short, and that it sees what it is there to see.

Red when C and reference differ in a bit, a bound is exceeded, or the campaign would not notice either.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from focgen.plan.execute import execute
from focgen.plan.scenario import to_raw
from focgen.verification.host import Library
from tests.equality import __main__ as campaign
from tests.equality.drawn import drawn
from tests.equality.inputs import DRIVEN, measured
from tests.equality.one import cases, compared, on_host, write
from tests.equality.table import table

SEEDS = {
    0: {"q31", "slew limit", "schedule"},
    3: {"q31", "continuous operator", "inner integral"},
    18: {"q15", "set-point filter", "recursion"},
    23: {"f32", "exponential memory"},
    35: {"f64", "tunable", "integrator"},
}


@pytest.mark.parametrize("seed", SEEDS)
def test_the_c_is_the_reference_and_no_bound_is_exceeded(seed):
    one = drawn(seed)
    assert SEEDS[seed] <= {one.plan.arithmetic, *one.kinds}
    found = on_host(one, 16, 160)
    assert found.differing == 0 and found.within, found.first
    assert found.samples >= 16 * 160 and 0.0 < found.share <= 1.0


def test_a_count_off_is_seen(tmp_path):
    """In the C: one weight; in a bound: one that is half of the worst error."""
    one = drawn(10)
    write(one.plan, tmp_path)
    source = tmp_path / f"{one.plan.name}.c"
    text, weight = source.read_text(), str(one.plan.direct.weights[0])
    assert text.count(weight) == 1
    source.write_text(text.replace(weight, str(int(weight) - 1)))
    library = Library([one.plan], [tmp_path])
    assert compared(one, library, 8, 100, "host").differing > 0
    bound = replace(
        one.plan.error_bound, operator=0.4 * one.plan.error_bound.operator, operator_per_sample=0.0
    )
    assert cases(replace(one.plan, error_bound=bound), 8, 100, 10)[1] > 1.0


def test_driven_inputs_find_larger_errors_than_mixed_ones():
    """Of a derivative in q15, whose weights' errors have signs of their own, most of the bound."""
    plan = drawn(10).plan
    assert cases(plan, 8, 200, 10)[1] > 0.8
    physical = measured(plan, 200, 10)
    (low, high), raw = plan.controller.ranges.reference, to_raw(plan, physical)
    assert low <= physical.ref.min() and physical.ref.max() <= high
    assert not (execute(plan, raw).flags & 8)[:DRIVEN].any(), "no driven input leaves its range"


@pytest.mark.parametrize("seed", (74, 77))
def test_a_breakpoint_beyond_the_range_of_its_signal_costs_nothing(seed):
    """No value comes there: the bound was by eleven orders that of a gain which is never used."""
    plan = drawn(seed).plan
    assert plan.floating and plan.schedule.breakpoints[-1] > plan.controller.ranges.schedule[1]
    assert 1e-3 < cases(plan, 8, 300, seed)[1] <= 1.0


def test_what_was_compared_is_not_compared_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(campaign, "_LANES", 8)
    monkeypatch.setattr(campaign, "_SAMPLES", 40)
    argv = ["--samples", "1", "--controllers", "2", "--cores", "--folder", str(tmp_path)]
    monkeypatch.setattr("sys.argv", ["equality", *argv])
    assert campaign.main() == 0
    first = (tmp_path / "compared.jsonl").read_text()
    monkeypatch.setattr("sys.argv", ["equality", *argv[:2], "--controllers", "3", *argv[4:]])
    assert campaign.main() == 0
    lines = (tmp_path / "compared.jsonl").read_text()
    assert lines.startswith(first) and lines.count("\n") == 3
    assert "| host | 3 |" in capsys.readouterr().out
    told = [json.loads(line) for line in lines.splitlines()]
    assert "differing" in table([{**told[0], "differing": 1}])
    assert Path(tmp_path / "table.md").exists()
