"""Fronts, the shortest length that serves, and the sentence that says so.

Red when a shorter or cheaper memory would have served, or the sentence says another one.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.studies.recommend import Requirement, leanest, pareto, sentence, shortest
from focgen.studies.results import Band, Ideal, Loop, Row
from focgen.studies.study import _unsettled
from tests.conftest import paper_controller

BAND = Band(0.3, 30.0, "")
LOOP = Loop(1.0, 3.0, 0.5, 60.0, 12.0, 0.2, True)


def row(length=None, **values):
    filled = dict(error=1.0, ram_bytes=100, multiplies=10, stable=True, settling_s=1.0, phase_error_deg=1.0)
    memory = "short" if length is not None else "exponential"
    return Row(memory, "q31", values.pop("sample_time", 0.01), length, None, None, **{**filled, **values})


@pytest.mark.parametrize("seed", range(20))
def test_a_front_is_what_nothing_beats(seed):
    random = np.random.default_rng(seed)
    values = random.integers(1, 12, size=(40, 2))
    rows = [
        row(5, error=float(e), ram_bytes=int(c), sample_time=0.01 if i % 4 else 0.02)
        for i, (e, c) in enumerate(values)
    ]
    front = pareto(rows, 0.01)["ram_bytes"]
    mine = [i for i in range(40) if i % 4]

    def beaten(i):
        return any(np.all(values[j] <= values[i]) and np.any(values[j] < values[i]) for j in mine)

    assert {tuple(values[i]) for i in front} == {tuple(values[i]) for i in mine if not beaten(i)}
    assert list(values[list(front), 1]) == sorted(set(values[list(front), 1]))


def test_nothing_without_numbers_is_on_a_front():
    rows = [row(5, error=None), row(6, ram_bytes=None), row(7)]
    found = pareto(rows, 0.01)
    assert (
        found["ram_bytes"] == (2,)
        and found["multiplies"] == (1,)
        and found["cycles"] == found["instructions"] == ()
    )


@pytest.mark.parametrize("needed", [1, 7, 63, 180, 181, 999, 4000, 4993])
def test_the_shortest_length_is_found_to_two_digits(needed):
    """As a search one by one would, up to the second digit."""
    requirement = Requirement(BAND, Ideal(0.01, 0.0, 0.0, LOOP))

    def measured(length):
        return row(length, phase_error_deg=1.9 if length >= needed else 2.1)

    asked = []
    tried = [measured(length) for length in (1, 20, 100, 500, 5000)]
    best, more = shortest(tried, requirement, lambda n: asked.append(n) or measured(n))
    unit = 10 ** max(0, len(str(needed)) - 2)
    assert needed <= best.length < needed + unit or best.length == 5000
    assert [r.length for r in more] == asked and len(asked) <= 7


def test_a_length_serves_only_if_all_longer_ones_do():
    requirement = Requirement(BAND, Ideal(0.01, 0.0, 0.0, LOOP))
    lucky = [row(10), row(20, phase_error_deg=5.0), row(40), row(80)]
    assert shortest(lucky, requirement, lambda n: row(n, phase_error_deg=5.0))[0].length == 40
    assert shortest([row(10, phase_error_deg=5.0)], requirement, row) == (None, ())


@pytest.mark.parametrize(
    "values, kept",
    [
        ({}, True),
        ({"phase_error_deg": 2.01}, False),
        ({"phase_error_deg": None}, False),
        ({"settling_s": 1.029}, True),
        ({"settling_s": 1.031}, False),
        ({"settling_s": 0.96}, False),
        ({"settling_s": None}, False),
        ({"stable": False}, False),
    ],
    ids=str,
)
def test_what_a_memory_must_do(values, kept):
    assert Requirement(BAND, Ideal(0.01, 0.0, 0.0, LOOP)).kept(row(5, **values)) is kept


def test_without_a_loop_the_phase_decides():
    requirement = Requirement(BAND, Ideal(0.01, 0.0, 0.0, None))
    assert requirement.kept(row(5, settling_s=None, stable=None)) and "settling" not in str(requirement)


def test_the_leanest_is_the_smallest_that_serves():
    requirement = Requirement(BAND, Ideal(0.01, 0.0, 0.0, LOOP))
    rows = [
        row(ram_bytes=20, phase_error_deg=3.0),
        row(ram_bytes=48),
        row(ram_bytes=40, settling_s=2.0),
        row(),
    ]
    assert leanest(rows, requirement) is rows[1] and leanest(rows[:1], requirement) is None


def test_the_sentence():
    requirement, controller = Requirement(BAND, Ideal(0.01, 0.0, 0.0, LOOP)), paper_controller()
    short = row(180, ram_bytes=720, multiplies=181)
    exponential = row(states=10, ram_bytes=48, multiplies=21)
    both = {"short", "exponential"}
    said = sentence(controller, requirement, short, exponential, both, 5000)
    assert said == (
        "L = 180 keeps the phase within 2° above 0.3 rad/s and the settling within 3 % of ideal "
        "(in q31 at 0.01 s), "
        "at 720 B and 181 multiplies. The exponential form does it in 48 B (10 states, 21 multiplies)."
    )
    counted = sentence(controller, requirement, replace(short, cycles=3108.4), exponential, both, 5000)
    assert "720 B and 181 multiplies, 3108 cycles. The" in counted
    assert sentence(controller, requirement, None, exponential, both, 5000).startswith(
        "No length up to L = 5000 keeps the"
    )
    assert sentence(controller, requirement, None, None, both, 5000).startswith("None of the")
    assert sentence(controller, requirement, short, None, {"short"}, 5000).endswith("181 multiplies.")


def test_an_ideal_loop_that_does_not_settle_is_said():
    unstable = replace(LOOP, settling_s=None, stable=False)
    assert "is not stable" in _unsettled(Ideal(0.01, 0.0, 0.0, unstable))[0]
    assert "does not settle" in _unsettled(Ideal(0.01, 0.0, 0.0, replace(unstable, stable=True)))[0]
    assert _unsettled(Ideal(0.01, 0.0, 0.0, LOOP)) == _unsettled(Ideal(0.01, 0.0, 0.0, None)) == []
