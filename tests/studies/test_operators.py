"""Which operator a loop needs, and the sentence that says why.

Red when the sentence recommends an operator that the loops do not.
"""

from __future__ import annotations

import math

import pytest

from focgen.control.controller import Controller, ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.studies.operators import chosen, compared_band, continuous_variants
from focgen.studies.results import Band, Row
from focgen.studies.study import study


def row(operator, **values):
    filled = dict(error=1e-3, error_s=0.05, ram_bytes=100, multiplies=10, stable=True, settling_s=1.0)
    filled["margin_deg"] = 60.0
    return Row("exponential", "q31", 0.01, None, 0.01, None, operator=operator, **{**filled, **values})


GL = row("gl")


@pytest.mark.parametrize(
    "weights, fit, operator, said",
    (
        (GL, {}, "gl", "settling no later"),
        (GL, {"margin_deg": 62.5}, "continuous", "costs 2.5° of phase margin"),
        (GL, {"settling_s": 0.9}, "continuous", "settles more than 3 % later"),
        (GL, {"stable": False, "margin_deg": 70.0}, "gl", "with the fit it is not"),
        (row("gl", stable=False), {}, "continuous", "with the weights it is not"),
        (row("gl", margin_deg=None, settling_s=None), {}, "continuous", "more than 3.5 % from s^α"),
        (row("gl", margin_deg=None, error_s=0.02), {"margin_deg": None}, "gl", "within 3.5 %"),
    ),
)
def test_what_the_lag_costs_the_loop_decides(weights, fit, operator, said):
    found = chosen(weights, [row("continuous", **{"error_s": 0.01, **fit})])
    assert found.operator == operator and said in found.why, found.why
    assert "gl: " in found.why and "continuous: 1 % from s^α" in found.why


def test_the_leanest_fit_that_is_as_close_is_compared():
    fits = [row("continuous", error_s=e, ram_bytes=n) for e, n in ((0.08, 10), (0.04, 50), (0.001, 90))]
    assert chosen(GL, fits).rows == (GL, fits[1])
    assert chosen(GL, fits[:1]).rows == (GL, fits[0])
    assert chosen(None, fits) is None and chosen(GL, []) is None


def test_the_fit_is_asked_for_where_the_loop_needs_it():
    band = compared_band(Band(0.3, 200.0, ""), 0.01)
    asked = continuous_variants(band, "q31", 0.01)
    assert {v.operator for v in asked} == {"continuous"}
    assert asked[0].band == (0.3, pytest.approx(0.25 * math.pi / 0.01))
    assert compared_band(Band(0.3, 3.0, ""), 0.01) == Band(0.3, 3.0, "")
    assert compared_band(Band(30.0, 200.0, ""), 0.01) is None


@pytest.mark.long
@pytest.mark.parametrize("time, operator", ((10.0, "gl"), (0.03, "continuous")))
def test_a_slow_loop_needs_the_weights_alone_and_a_fast_one_the_fit(time, operator):
    """s^-0.9 through s^0.6 of a crossover a long way from, and near to, the sampling."""
    signals = Signals(time="t", pressure="p", output="y")
    rig = Rig("lag", 0.01, signals, actuator=Actuator(time**0.6, 0.6, (1.0,)))
    gain = 1.0 / time
    transfer = TransferFunction([(time**0.6, 0.6), (1.0, 0.0)])
    ranges = ControllerRanges((0.0, 1.0), (0.0, 1.0), (0.0, 2.0))
    controller = Controller("c", 0.01, transfer, gain, True, ranges)
    given = dict(memory=["exponential"], tolerances=[1e-2], arithmetic=["q31"], sample_times=[0.01])
    found = study("memory", controller, rig=rig, setpoints=[0.5], horizon=10_000, jobs=1, **given)
    assert f"Operator {operator}: " in found.recommendation, found.recommendation
    assert [r.operator for r in found.operators] == ["gl", "continuous"]
    assert found.operators[1].error_s < found.operators[0].error_s
