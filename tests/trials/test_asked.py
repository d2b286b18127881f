"""A case made again from its seed: the same rig goes on after its session.

Red when a case made again is another case.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from focgen.errors import InputError
from focgen.trials.facts import Facts
from focgen.trials.make import Drawing
from focgen.trials.proposed import _remade, resolved


@pytest.fixture(scope="module")
def drawn():
    drawing = Drawing(2, 5, "C", "short", ("none",))
    return drawing.case(1)[0], Facts("short", "C", 5, {"0001": "", "0002": ""}, ("none",))


def test_a_case_is_made_again_from_its_seed_and_a_foreign_label_is_refused(drawn, tmp_path):
    case, facts = drawn
    label = json.loads(json.dumps({**case.label, "unseen": {}}))
    again = _remade(tmp_path, facts, "0001", label)
    assert all(np.array_equal(a[1]["output"], b[1]["output"]) for a, b in zip(case.logs, again.logs))
    with pytest.raises(InputError, match="not what its seed gives"):
        _remade(tmp_path, replace(facts, seed=6), "0001", label)


def test_a_further_experiment_goes_on_where_the_session_ended(drawn):
    case, _ = drawn
    bench, command = case.bench, case.logs[-1][1]["command"]
    log = bench.further(command, np.random.default_rng(0))
    assert len(log["output"]) == len(command)
    noise = bench.recorder.noise["output"]
    last = bench.programme[bench.seen][2]
    apart = np.std(log["output"] - case.logs[-1][1]["output"])
    assert 0.5 * noise < apart < 3.0 * noise  # a healthy rig does the same again, with noise of its own
    if bench.recorder.absolute:
        assert log["time"][0] == pytest.approx(last, abs=0.1)


@pytest.mark.parametrize("suite", ["engine", "plants"])
def test_rigs_of_other_suites_make_further_experiments(suite):
    if suite == "engine":
        pytest.importorskip("mujoco")
    case, _ = Drawing(1, 5, "A", suite, ("none",)).case(1)
    at = next(i for i, (name, *_) in enumerate(case.bench.programme) if name == case.logs[0][0])
    log = case.bench.further(case.logs[at][1]["command"], np.random.default_rng(0))
    apart, noise = np.std(log["output"] - case.logs[at][1]["output"]), case.bench.recorder.noise["output"]
    assert 0.5 * noise < apart < 3.0 * noise  # healthy: the first experiment again, behind the last


def test_resolved_is_the_truth_named_and_nothing_else(tmp_path):
    label = {"kind": "single", "truth": [{"effect": "leak", "stage": "regulator", "visible": True}]}
    label["truth"][0] |= {"severity": "mid", "form": "x"}
    said = {"proposed": ["leak"], "menu0": ["leak", "contact"], "menu1": ["contact"]}
    for which, names in said.items():
        run = tmp_path / "asked" / "0001" / which
        run.mkdir(parents=True)
        word = {"status": "done", "seconds": 1.0, "fault": None}
        (run / "outcome.json").write_text(json.dumps(word))
        candidates = [{"effect": name, "confidence": 0.9 / len(names)} for name in names]
        diagnosis = {
            "verdict": "named" if len(names) == 1 else "set",
            "causes": [{"candidates": candidates}],
            "gap": {"refitted": 2.0, "explained": 1.0, "floor": 0.5},
        }
        (run / "diagnosis.json").write_text(json.dumps(diagnosis))
    assert resolved(tmp_path, "0001", label) == {"proposed": True, "menu0": False, "menu1": False}
    assert resolved(tmp_path, "0002", label) == {}
