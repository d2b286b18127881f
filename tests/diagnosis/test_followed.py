"""What effects leave, and still follows the input, is said with the family that would take most of it.

Red when a second effect that is as likely as a wrong form of the first goes unsaid, when one is held out that
takes little, or when errors of other effects than those found are read.
"""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from focgen.diagnosis.hypotheses import explain
from focgen.diagnosis.verdict import cautions

LEFT = {"sensor_hysteresis": 0.66, "sensor_drift": 0.97, "sensor_quantization": 0.1}


def explained(amiss: float, beside: dict[str, float]) -> SimpleNamespace:
    segment = SimpleNamespace(entry="curvature", exit="output")
    return SimpleNamespace(amiss=amiss, beside=beside, segment=segment, causes=())


def said(e: SimpleNamespace) -> list[str]:
    made = SimpleNamespace(stands_for_more=False, follows_these_logs=False, causes=[(e, None)])
    return [*cautions.the_rest(made)]


def test_the_nearest_family_is_named_with_what_it_would_leave(monkeypatch):
    monkeypatch.setattr(cautions, "acts_besides", lambda e: False)
    (note,) = said(explained(0.57, LEFT))
    assert note.startswith(
        "curvature to output: 57% of what is left follows the curvature. With sensor_hysteresis"
    )
    assert "0.66 of the error would stay" in note


@pytest.mark.parametrize(
    "amiss, beside",
    [(0.1, LEFT), (0.57, {"sensor_drift": 0.9}), (0.57, {"sensor_quantization": 0.1}), (0.57, {})],
)
def test_nothing_is_said_of_little(amiss, beside, monkeypatch):
    """Of what inputs hardly predict, of a family that takes little of it, and of steps."""
    monkeypatch.setattr(cautions, "acts_besides", lambda e: False)
    assert said(explained(amiss, beside)) == []


def ranking(errors: dict[str, float], *families: str) -> SimpleNamespace:
    return SimpleNamespace(base=found(*families), errors=errors)


def found(*families: str) -> SimpleNamespace:
    return SimpleNamespace(problem=SimpleNamespace(families=families))


def test_errors_are_those_beside_the_effects_that_stand():
    """The last ranking may be beside one that left again. Another form of a family is no other effect."""
    first, second = ranking({"creep": 0.4}), ranking({"creep": 0.9, "contact": 0.7}, "creep")
    third = ranking({"leak": 0.5}, "creep", "contact")
    assert explain._beside(found("creep"), [first, second, third]) == {"contact": 0.7}
    assert explain._beside(found("contact", "creep"), [first, second, third]) == {"leak": 0.5}
    assert explain._beside(found("leak"), [first, second, third]) == {}
    assert explain._beside(found(), [first, second, third]) == {}
