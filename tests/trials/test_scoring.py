"""The arithmetic of the scores on results made by hand.

Red when a score differs from the one computed by hand.
"""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

import focgen
from focgen.errors import InputError
from focgen.rig.files import write_rig
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.achieved import shrink
from focgen.trials.judging import forgone, judge
from focgen.trials.machine import Machine, simulate
from focgen.trials.recording import as_csv
from focgen.trials.rows import rows
from focgen.trials.run import outcome_of
from focgen.trials.statistics import calibration_error, interval, reliability, reliability_bins
from focgen.trials.tables import full_text, markdown, table

STAGES = {
    "hysteresis": "actuator",
    "creep": "actuator",
    "leak": "regulator",
    "sensor_lag": "sensor",
    "gain_nonlinearity": "actuator",
    "pick_up": "sensor",
    "folded_reading": "sensor",
}
DONE = {"status": "done", "seconds": 2.0}


def label(kind, *effects, visible=True, design=None):
    truth = [
        {"effect": e, "stage": STAGES[e], "form": "f", "severity": "mid", "visible": visible} for e in effects
    ]
    return {"kind": kind, "truth": truth, "design": design, "suite": "full"}


def said(verdict, *causes, stage=None, proposal="", shrink=None, spread=None):
    """``causes``: each a dict effect → confidence."""
    found = [{"candidates": [{"effect": e, "confidence": c} for e, c in cause.items()]} for cause in causes]
    first = next(iter(causes[0])) if causes else None
    return {
        "verdict": verdict,
        "where": {"stage": stage or STAGES.get(first)},
        "causes": found,
        "shrink": shrink,
        "shrink_interval": spread,
        "next_experiment": {"what": proposal, "why": ""},
    }


def one(kind, effects, diagnosis, number="1", outcome=DONE, **measured):
    return judge(number, label(kind, *effects), outcome, diagnosis, **measured)


def by_name(judged, signals="C"):
    return {row.name.strip(" …"): row for row in rows(judged, signals)}


def test_singles():
    judged = [
        one("single", ["hysteresis"], said("named", {"hysteresis": 0.9})),
        one("single", ["hysteresis"], said("named", {"creep": 0.9})),  # named wrongly
        one("single", ["leak"], said("named", {"leak": 0.9}, {"creep": 0.8})),  # a false second cause
        one("single", ["creep"], said("set", {"sensor_lag": 0.5, "creep": 0.4})),
        one("single", ["creep"], said("unknown", stage="actuator")),
        one("single", ["leak"], None, outcome={"status": "failed", "seconds": None}),  # a crash
        judge("7", label("single", "leak", visible=False), DONE, said("named", {"creep": 0.9})),
    ]
    found = by_name(judged)
    assert found["top-1 effect"].value == pytest.approx(2 / 6) and found["top-1 effect"].cases == 6
    assert found["stage right"].value == pytest.approx(4 / 6)
    assert found["named one effect, wrongly"].value == pytest.approx(2 / 6)
    assert found["truth in the reported set"].value == pytest.approx(3 / 5)
    assert found["its mean size"].value == pytest.approx((1 + 1 + 2 + 2 + 0) / 5)
    assert found["known wrongly abstained"].value == pytest.approx(2 / 6)
    assert found["singles: false extras per case"].value == pytest.approx(2 / 6)
    assert found["below visibility: named one effect, wrongly"].value == 1.0
    assert found["top-1 effect"].reached is False and found["top-1 effect"].target == "≥ 0.92"
    assert by_name(judged, "A")["top-1 effect"].target == "≥ 0.72"


def test_nulls_and_unknowns():
    judged = [
        one("none", [], said("none")),
        one("parameters", [], said("parameters")),
        one("parameters", [], said("named", {"leak": 0.9})),
        one("none", [], None, outcome={"status": "failed"}),
        one("outside", ["pick_up"], said("unknown", stage="sensor")),
        one("outside", ["pick_up"], said("named", {"sensor_lag": 0.9})),
        one("outside", ["folded_reading"], said("named", {"sensor_nonlinearity": 0.9})),  # rightly called so
    ]
    found = by_name(judged)
    assert found["false alarm on none or parameter error"].value == pytest.approx(2 / 4)
    assert found["unknown caught"].value == pytest.approx(2 / 3)


def test_pairs():
    pair = ["hysteresis", "leak"]
    judged = [
        one("pair", pair, said("named", {"leak": 0.9}, {"hysteresis": 0.9})),
        one("pair", pair, said("set", {"leak": 0.5, "hysteresis": 0.4})),  # one cause holds but one of them
        one("pair", pair, said("set", {"creep": 0.5, "hysteresis": 0.4}, {"hysteresis": 0.5, "leak": 0.5})),
        one("pair", pair, said("named", {"leak": 0.9}, {"creep": 0.9}, {"sensor_lag": 0.9})),
    ]
    found = by_name(judged)
    assert found["pairs: both found"].value == pytest.approx(2 / 4)
    assert found["pairs: false extras per case"].value == pytest.approx(2 / 4)


def test_missed_pairs_are_held_against_the_fit_of_the_true_ones():
    """Mean squares above the floor: of a gap of 10, what was found leaves 4, the true pair 3.9, 0 or 4.5."""
    gap = {"refitted": 11**0.5, "floor": 1.0, "explained": 5**0.5}
    said_, told = {"gap": gap}, [{"gap": {**gap, "explained": x**0.5}} for x in (4.9, 1.0, 5.5)]
    assert [forgone(said_, t) for t in told] == pytest.approx([0.01, 0.4, -0.05])
    assert forgone(said_, None) is None and forgone(None, said_) is None
    assert forgone({"gap": {**gap, "refitted": 1.0}}, said_) is None
    pair, found = ["leak", "creep"], said("named", {"leak": 0.9})
    judged = [one("pair", pair, found, forgone=f) for f in (0.01, 0.4, -0.05)]
    judged.append(one("pair", pair, said("named", {"leak": 0.9}, {"creep": 0.9}), forgone=0.3))  # no miss
    row = by_name(judged)["missed: the true pair closes < 0.02 more"]
    assert row.value == pytest.approx(2 / 3) and row.cases == 3


def test_promises():
    judged = [
        one(
            "single",
            ["leak"],
            said("named", {"leak": 1.0}, shrink=s, spread=(s - 0.1, s + 0.1)),
            achieved=a,
            oracle=o,
        )
        for s, a, o in ((0.9, 0.88, 0.9), (0.9, 0.5, 0.8), (0.8, 0.87, 0.9))
    ]
    judged.append(one("single", ["leak"], said("unknown"), oracle=0.4))  # nothing promised, nothing achieved
    found = by_name(judged)
    assert found["promised shrink: median error"].value == pytest.approx(0.07)
    assert found["promised shrink: within 0.10"].value == pytest.approx(2 / 3)
    assert found["promised shrink: 90 % interval covers"].value == pytest.approx(2 / 3)
    assert found["achieved shrink over the oracle's"].value == pytest.approx(2.25 / 3.0)


def test_others_stand_beside():
    """Each other method names one effect a case; its figures are over the cases in which it did."""
    judged = [
        one("single", ["leak"], said("named", {"leak": 0.9}), baseline="creep", best_fit="leak"),
        one("single", ["leak"], said("named", {"leak": 0.9}), baseline="leak", best_fit="leak"),
        one("single", ["creep"], said("unknown", stage="actuator"), baseline="hysteresis"),
        judge("7", label("single", "leak", visible=False), DONE, said("none"), baseline="leak"),
    ]
    found = by_name(judged)
    assert found["top-1 effect"].beside == {"correlation": pytest.approx(1 / 3), "best fit": 1.0}
    assert found["stage right"].beside["correlation"] == pytest.approx(2 / 3)
    assert found["named one effect, wrongly"].beside["correlation"] == pytest.approx(2 / 3)
    assert found["false alarm on none or parameter error"].beside == {}
    judged[0] = one("single", ["leak"], said("named", {"leak": 0.9}), achieved=0.6, oracle=0.8)
    mean = by_name(judged)["achieved shrink, mean"]
    assert mean.value == pytest.approx(0.6) and mean.beside == {"oracle": pytest.approx(0.8)}


def test_pairs_are_split_by_stage():
    within = one("pair", ["hysteresis", "creep"], said("named", {"creep": 0.9}, {"hysteresis": 0.9}))
    across = one("pair", ["hysteresis", "leak"], said("named", {"leak": 0.9}))
    found = by_name([within, across])
    assert found["within one stage"].value == 1.0 and found["across stages"].value == 0.0


def test_achieved_shrink_by_hand(tmp_path):
    """Gains 10 % and 5 % off leave mean squares as 4 to 1: three quarters of the gap are closed."""
    signals = Signals("t", "y", command="u")
    true = Rig("bench", 0.02, signals, Actuator(0.9, 0.6, (0.5,)))
    for name, off in (("refitted", 1.10), ("augmented", 1.05)):
        write_rig(replace(true, actuator=Actuator(0.9, 0.6, (0.5 * off,))), tmp_path / f"{name}.toml")
    command = np.repeat([0.0, 1.0, 0.4, 0.8], 2000)
    trace = simulate(Machine(true), [command], [0.0], 0.0025)[0]
    columns = {"time": trace.time[::8], "command": command[::8], "output": trace.output[::8]}
    (tmp_path / "log.csv").write_text(as_csv([("log", columns)], signals, 1.0, False))
    logs = [tmp_path / "log.csv"]
    assert shrink(tmp_path, logs, 0.0) == pytest.approx(0.75, abs=0.01)
    error = 0.1 * np.sqrt(np.mean(trace.output**2))
    assert shrink(tmp_path, logs, 0.5 * error) == pytest.approx(1.0, abs=0.02)  # the rest is noise
    assert shrink(tmp_path, logs, 0.99 * error) is None


def test_unidentifiable():
    design = {"tied": ["gain_nonlinearity", "creep"], "resolves": ["repeat"]}

    def case(diagnosis):
        return judge("1", label("unidentifiable", "gain_nonlinearity", design=design), DONE, diagnosis)

    both = {"creep": 0.5, "gain_nonlinearity": 0.5}
    assert case(said("set", both, proposal="Repeat the first step at the end")).says_tied
    assert not case(said("set", both, proposal="a slow sine")).says_tied
    assert not case(said("named", {"gain_nonlinearity": 0.9}, proposal="repeat")).says_tied
    assert not case(said("set", {"creep": 0.5, "leak": 0.5}, proposal="repeat")).says_tied


def test_calibration_error_by_hand():
    confidence, right = np.array([0.5, 0.5, 0.9, 0.9]), np.array([1.0, 0.0, 1.0, 0.0])
    assert calibration_error(confidence, right, bins=2) == pytest.approx(0.5 * 0.0 + 0.5 * 0.4)


def test_reliability_accepts_calibrated_and_refuses_overconfident():
    accepted = []
    for seed in range(24):
        rng = np.random.default_rng(seed)
        stated = rng.uniform(0.3, 1.0, 150)
        accepted.append(reliability(stated, rng.random(150) < stated, draws=200)["p"] > 0.05)
        boast = reliability(np.full(150, 0.97), rng.random(150) < 0.8, draws=200)
        assert boast["p"] < 0.05 and boast["error"] > boast["perfect"]
    assert sum(accepted) >= 20  # 95 % of 24, less two and a half standard deviations


def test_reliability_bins_by_hand():
    found = reliability_bins([0.2, 0.2, 0.9, 0.9, 0.9, 0.9], [False, True, True, True, True, True], 2)
    (c1, r1, _, _, n1), (c2, r2, low, high, n2) = found
    assert (c1, r1, n1) == (pytest.approx((0.2 + 0.2 + 0.9) / 3), pytest.approx(2 / 3), 3)
    assert (c2, r2, n2) == (pytest.approx(0.9), 1.0, 3)
    assert low <= 2 / 3 and high == 1.0  # two or three of three, at 0.9 each, in 97 % of draws


def test_interval_covers_as_often_as_it_says():
    covered = 0
    for seed in range(200):
        hits = np.random.default_rng(seed).random(100) < 0.7
        low, high = interval(hits, draws=300)
        covered += low <= 0.7 <= high
    assert 168 <= covered <= 192  # 90 % of 200, within three standard deviations
    low, high = interval([1.0] * 20)
    assert high == 1.0 and 0.9 < low < 0.93  # not "surely 1": the 5 % quantile of Beta(20.5, 0.5) is 0.910
    covered = sum(a <= 0.5 <= b for a, b in (_median_interval(seed) for seed in range(100)))
    assert 80 <= covered <= 98


def _median_interval(seed):
    return interval(np.random.default_rng(seed).random(60), np.median, draws=300)


def test_failed_diagnosis_is_noted_and_not_repeated(tmp_path):
    folder = tmp_path / "t"
    focgen.trial("make", folder, cases=1, seed=5, suite="short", kinds=("none",))
    rig = folder / "cases" / "0001" / "rig.toml"
    given = rig.read_text()
    rig.write_text("nonsense = [")
    ran = focgen.trial("run", folder, jobs=1)
    assert (ran.now, ran.before, ran.failed, ran.waiting) == (1, 0, 1, 0)
    assert "RigError" in outcome_of(folder / "runs" / "0001")["fault"]
    again = focgen.trial("run", folder, jobs=1)
    assert (again.now, again.before, again.failed) == (0, 1, 1)
    rig.write_text(given)  # what is no more what was committed to is not scored
    late = focgen.trial("run", folder, jobs=1, limit=0.0)
    assert (late.now, late.failed) == (1, 1) == (focgen.trial("run", folder, jobs=1).before, 1)
    scores = focgen.trial("score", folder, baseline=False).sets[0]
    assert scores.failed == 1 and json.loads((folder / "scores.json").read_text())["scores"]["failed"] == 1
    assert "missed" in table(scores.rows)
    shutil.rmtree(folder / "runs")
    assert focgen.trial("score", folder, baseline=False).sets[0].failed == 1
    assert focgen.trial("run", folder, jobs=1, minutes=0).waiting == 1  # no time left: none is begun
    partial = focgen.trial("score", folder, baseline=False, partial=True).sets[0]
    assert (partial.cases, partial.waiting, partial.failed) == (0, 1, 0)


def test_several_trials_in_one_table(tmp_path):
    """Trials take turns, are scored by one command, and stand side by side."""
    folders = [tmp_path / signals for signals in "CA"]
    for folder in folders:
        focgen.trial("make", folder, cases=2, seed=5, suite="short", signals=folder.name, kinds=("none",))
    assert focgen.trial("run", *folders, jobs=1, limit=0.0).now == 4
    begun = {p: (p / "outcome.json").stat().st_mtime_ns for f in folders for p in (f / "runs").iterdir()}
    order = [f"{p.parent.parent.name}{p.name}" for p in sorted(begun, key=begun.get)]
    assert order == ["C0001", "A0001", "C0002", "A0002"]
    summary = focgen.trial("score", *folders, baseline=False)
    assert [s.signals for s in summary.sets] == ["C", "A"] and not summary.reached
    text, page = full_text(summary.sets), markdown(summary.sets)
    assert "C short" in text and "A short" in text and "1.000 (≤ 0.02) !" in text
    row = next(line for line in page.splitlines() if line.startswith("| false alarm"))
    assert row.count("**1.000** †") == 2 and row.count("n = 2") == 2
    with pytest.raises(InputError):
        focgen.trial("make", *folders)
