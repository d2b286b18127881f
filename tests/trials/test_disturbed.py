"""The suites "off" and "begun": the cases of "full", of which only what is given changes.

Red when more of a case changes than its suite says.
"""

import json

import numpy as np
import pytest

from focgen.rig.files import read_rig
from focgen.rig.rig import Relative, Uncertainty
from focgen.trials.cases import make_case
from focgen.trials.disturbed import disturbed
from focgen.trials.make import make
from focgen.trials.plan import Assignment

SEEDS = range(8)


@pytest.fixture(scope="module")
def case():
    return make_case(Assignment("none", (), "low"), "C", "short", np.random.default_rng(3))


@pytest.mark.long
def test_a_suite_of_disturbed_cases_plays_the_same_rigs(tmp_path):
    """Sealed logs and truth are those of "full" with the same seed; of what is given only the rig changes."""
    files = {}
    for suite in ("full", "off"):
        make(tmp_path / suite, cases=1, seed=5, signals="C", suite=suite, kinds=("single",))
        root = tmp_path / suite
        files[suite] = {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*.*")}
    changed = {name for name, content in files["full"].items() if files["off"][name] != content}
    assert {name.split("/")[-1] for name in changed} == {
        "rig.toml",
        "commitment.txt",
        "label.json",
        "trial.json",
    }
    labels = [json.loads(files[suite]["sealed/0001/label.json"])["label"] for suite in files]
    assert labels[0]["truth"] == labels[1]["truth"] and labels[0]["suite"] != labels[1]["suite"]
    assert read_rig(tmp_path / "off" / "cases" / "0001" / "rig.toml")


OFF = {"off": Uncertainty().regulator, "sound": Relative(0.03, 0.2)}


@pytest.mark.parametrize("suite", OFF)
@pytest.mark.parametrize("seed", SEEDS)
def test_off_moves_gains_and_times_of_regulator_and_sensor_within_their_uncertainty(case, seed, suite):
    near = disturbed(case, suite, np.random.default_rng(seed))
    assert near.rig.actuator == case.rig.actuator and near.logs is case.logs
    for stage in ("regulator", "sensor"):
        a, b, known = getattr(near.rig, stage), getattr(case.rig, stage), OFF[suite]
        assert 0.0 < abs(a.dc_gain / b.dc_gain - 1.0) <= known.gain
        ratios = {t.order: t.coefficient / s.coefficient for t, s in zip(a.den, b.den)}
        factor = ratios[1.0] / ratios[0.0]
        assert 0.0 < abs(factor - 1.0) <= known.time
        assert all(ratio == pytest.approx(ratios[0.0] * factor**order) for order, ratio in ratios.items())


def test_begun_cuts_about_half_of_the_logs_behind_their_first_step(case):
    """A cut log is the end of the whole one, on a clock that begins anew unless it runs through."""
    cuts = []
    for seed in SEEDS:
        made = disturbed(case, "begun", np.random.default_rng(seed))
        assert made.rig == case.rig and [n for n, _ in made.logs] == [n for n, _ in case.logs]
        for (_, ours), (_, whole) in zip(made.logs, case.logs):
            count, length = len(ours["time"]), len(whole["time"])
            assert all(np.array_equal(ours[k], whole[k][length - count :]) for k in whole if k != "time")
            begin = 0.0 if case.recorder.absolute or count == length else whole["time"][length - count]
            assert np.allclose(ours["time"], whole["time"][length - count :] - begin)
            moved = whole["time"][np.argmax(whole["command"] != whole["command"][0])]
            assert count == length or (
                length // 2 <= count and whole["time"][length - count] >= moved + 0.2 - 1e-9
            )
            cuts.append(count < length)
    assert 0.3 < np.mean(cuts) < 0.7
