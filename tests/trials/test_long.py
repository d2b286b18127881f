"""The whole way of a small trial: made, diagnosed blind, scored beside the baselines and the oracle.

Red when the way from making to scoring breaks anywhere.
"""

import json

import pytest

import focgen

pytestmark = pytest.mark.long


@pytest.mark.parametrize("signals, suite", [("C", "short"), ("A", "short"), ("C", "closed")])
def test_small_trial(tmp_path, signals, suite):
    """No case fails, and strong visible effects are found more often than the look of the residual does."""
    folder = tmp_path / "t"
    focgen.trial("make", folder, cases=10, seed=11, signals=signals, suite=suite, kinds=("single", "none"))
    assert focgen.trial("run", folder).failed == 0
    scores = focgen.trial("score", folder, oracle=True, jobs=2).sets[0]
    rows = {row.name.strip(" …"): row for row in scores.rows}
    top = rows["top-1 effect"]
    assert scores.failed == 0 and top.cases >= 5 and top.value >= 0.5
    assert top.value >= top.beside.get("correlation", 0.0)
    cases = json.loads((folder / "scores.json").read_text())["cases"]
    assert any(case["oracle"] is not None for case in cases)
