"""The tool that changes the sources: what it changes, what it leaves alone, how it counts.

Red when a change is not made, not taken back, or a survivor is counted as killed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.mutants import of_c, of_python
from tests.mutants.change import Change
from tests.mutants.known import ROOT, Known
from tests.mutants.sample import ROOMS, drawn, files
from tests.mutants.table import counted, interval, judged, weighted
from tests.mutants.trying import restored

PYTHON = '''"""Of 3 things."""


def limited(x: int = 5) -> int:
    if x < 2 and not x == 0:
        raise ValueError(f"{x + 1} is too small: {7 * 2}")
    return max(-x, 1.5) << 3
'''
C = """/* n + 1 */
{% if fixed %}
#define SIZE 4u
static int32_t f(int64_t x, uint8_t n) { return foc_sat32(foc_shift64(x + 2, n)) & {{ mask + 1 }}; }
    s->carry = 0;
{% endif %}
"""


def made(found: list[Change], text: str) -> set[str]:
    return {change.applied(text).splitlines()[change.line(text) - 1].strip() for change in found}


def test_what_is_changed_of_python():
    lines = made(of_python.changes("x.py", PYTHON), PYTHON)
    assert "if x <= 2 and not x == 0:" in lines and "if x < 2 or not x == 0:" in lines
    assert "if x < 2 and x == 0:" in lines and "if x < 3 and not x == 0:" in lines
    assert "return min(-x, 1.5) << 3" in lines and "return max(x, 1.5) << 3" in lines
    assert "return max(-x, 1.5) >> 3" in lines and "return max(-x, 3.0) << 3" in lines
    assert "def limited(x: int = 6) -> int:" in lines
    assert not any("raise" in line or "things" in line for line in lines), "what is said is no mathematics"


def test_what_is_changed_of_c():
    lines = made(of_c.changes("x.c.jinja", C), C)
    inner = "static int32_t f(int64_t x, uint8_t n) { return %s & {{ mask + 1 }}; }"
    assert inner % "(foc_shift64(x + 2, n))" in lines and inner % "foc_sat32(((x + 2) >> (n)))" in lines
    assert inner % "foc_sat32(foc_shift64(x - 2, n))" in lines and "{% if not (fixed) %}" in lines
    assert "#define SIZE 5u" in lines and ";" in lines
    assert not any("n - 1" in line or "mask - 1" in line for line in lines)


def test_what_is_changed_of_assembly():
    text = '__asm__ volatile(\n    "adds r0, #64\\n" /* add */\n    "beq 1f\\n");\n'
    lines = made(of_c.changes("x.h", text), text)
    assert {'"subs r0, #64\\n" /* add */', '"adds r0, #128\\n" /* add */', '"bne 1f\\n");'} <= lines


def test_a_larger_sample_goes_on_where_a_smaller_one_ends():
    few, more = drawn(ROOT, 1, 8), drawn(ROOT, 1, 20)
    assert few == more[:8] and {room for room, _ in few} == set(ROOMS)
    assert [room for room in ROOMS if not files(ROOT, room)] == []
    assert drawn(ROOT, 2, 8) != few


@pytest.fixture
def place(tmp_path) -> Path:
    """A package of one function, and a test of it."""
    (tmp_path / "small.py").write_text("def larger(a, b):\n    return a if a > b else b\n")
    test = "from small import larger\n\n\ndef test_it():\n    assert larger(1, 2) == 2\n"
    (tmp_path / "test_small.py").write_text(test)
    return tmp_path


TRYING = """
import json, sys
from pathlib import Path
from tests.mutants import of_python
from tests.mutants.trying import tried

place, test = Path(sys.argv[1]), "test_small.py::test_it"
by_sign = {c.new: c for c in of_python.changes("small.py", (place / "small.py").read_text())}
asked = (("<", [test]), (">=", [test]), ("<", []))
found = [tried(place, by_sign[sign], tests, 60.0) for sign, tests in asked]
print(json.dumps([(one.outcome, one.by) for one in found]))
"""


def test_a_change_that_a_test_tells_is_killed_another_survives(place):
    # In an interpreter of its own, as the tool runs: a worker of this suite is no place to fork from.
    # Without plugins: focgen's own is looked for in the copy, and this copy holds no focgen.
    text = (place / "small.py").read_text()
    ran = subprocess.run(
        [sys.executable, "-c", TRYING, str(place)],
        cwd=ROOT,
        env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    log = (place / "tried.log").read_text()
    test = "test_small.py::test_it"
    expected = [["killed", test], ["survived", ""], ["no test", ""]]
    assert json.loads(ran.stdout) == expected, ran.stderr + log
    assert (place / "small.py").read_text() == text


def test_what_a_killed_run_has_left_is_put_back(place):
    (place / "changed.json").write_text(json.dumps({"file": "small.py", "text": "whole"}))
    restored(place)
    assert (place / "small.py").read_text() == "whole" and not (place / "changed.json").exists()


def test_the_fastest_tests_of_a_line_come_first():
    change, text = Change("focgen/a.py", 8, "1", "2", "constant"), "x = 0\ny=1\n"
    known = Known(
        {"slow": 9.0, "fast": 1.0, "huge": 99.0}, {"focgen/a.py": {2: ["huge", "slow", "fast"]}}, {}
    )
    assert known.tests(change, text, Counter(), 40.0) == ["fast", "slow"]
    reading = Known({"slow": 9.0}, {}, {"c_runtime/a.h": ["slow"]})
    assert reading.tests(Change("c_runtime/a.h", 0, "x", "y", ""), text, Counter(), 40.0) == ["slow"]


def test_lines_alike_are_changes_apart():
    text = "i = 0\nj = 1\ni = 0\n"
    first, second = (Change("x.c", place, "0", "1", "constant") for place in (4, 16))
    assert first.key(text) == first.key(text + "i = 0\n") != second.key(text)


def test_what_has_told_of_others_comes_before_what_is_fast():
    seconds = {"a::fast": 1.0, "a::slow": 3.0, "b::slow": 2.0, "b::told": 4.0}
    known = Known(seconds, {}, {"c_runtime/a.h": sorted(seconds)})
    change = Change("c_runtime/a.h", 0, "x", "y", "")
    assert known.tests(change, "", Counter(), 40.0) == ["a::fast", "b::slow", "a::slow", "b::told"]
    told = known.tests(change, "", Counter({"b::told": 5}), 40.0)
    assert told == ["b::told", "a::fast", "b::slow", "a::slow"]


def test_shares_and_their_intervals():
    """Clopper's and Pearson's of 9 in 10, from their tables; a survivor that is equivalent does not count."""
    assert interval(9, 10) == pytest.approx((0.6058, 0.9949), abs=1e-4)
    equal = next(key for key, told in judged().items() if told["verdict"] == "equivalent")
    results = [{"room": "plan", "outcome": "killed", "key": str(i)} for i in range(9)]
    results += [{"room": "plan", "outcome": how, "key": key} for how, key in
                (("survived", "x"), ("survived", equal), ("stillborn", "y"), ("not run", "z"))]  # fmt: skip
    counts = counted(results, {"plan": 100, "runtime": 50})
    assert (counts["plan"].tried, counts["plan"].killed, counts["plan"].live) == (11, 9, 10)
    share, low, high = weighted(list(counts.values()))
    assert share == 0.9 and low < 0.9 < high


def test_every_survivor_that_was_judged_says_why():
    assert all(told["verdict"] in ("equivalent", "open") and told["why"] for told in judged().values())
