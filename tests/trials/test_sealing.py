"""Cases: the same for the same seed, sealed so that tampering shows, readable, silent about their truth.

Red when a seal can be broken unseen, or a case tells its truth.
"""

import json
import shutil

import numpy as np
import pytest

import focgen
from focgen.errors import InputError
from focgen.trials.recording import coloured
from focgen.trials.score import score
from focgen.trials.vocabulary import OUTSIDE, VOCABULARY

KINDS = ("single", "none")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trial") / "t"
    focgen.trial("make", folder, cases=3, seed=7, suite="short", kinds=KINDS)
    return folder


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_same_seed_same_bytes(made, tmp_path):
    focgen.trial("make", tmp_path / "again", cases=3, seed=7, suite="short", kinds=KINDS)
    assert contents(tmp_path / "again") == contents(made)
    focgen.trial("make", tmp_path / "other", cases=1, seed=8, suite="short", kinds=KINDS)
    first, other = contents(made), contents(tmp_path / "other")
    assert all(first[n] != other[n] for n in first if n.startswith("cases") and n in other)


def test_case_folders_say_nothing_of_the_truth(made):
    words = [w.encode() for w in (*VOCABULARY, *OUTSIDE, "truth", "severity")]
    words += [form.name.encode() for _, forms in VOCABULARY.values() for form in forms]
    for path in sorted((made / "cases").rglob("*")):
        if path.is_file():
            assert not any(word in path.read_bytes() for word in words), path
            assert path.name in ("rig.toml", "commitment.txt") or path.parent.name == "logs"


def _label(folder):
    return next(iter(sorted((folder / "sealed").rglob("label.json"))))


def _change_label(folder):
    content = json.loads(_label(folder).read_text())
    content["label"]["kind"] = "outside"
    _label(folder).write_text(json.dumps(content))


def _change_salt(folder):
    content = json.loads(_label(folder).read_text())
    content["salt"] = content["salt"][::-1]
    _label(folder).write_text(json.dumps(content))


def _change_unseen(folder):
    log = next(iter(sorted((folder / "sealed").rglob("*.csv"))))
    log.write_text(log.read_text().replace("1", "2", 1))


def _change_commitment(folder):
    path = folder / "cases" / "0001" / "commitment.txt"
    path.write_text("0" * 64 + "\n")


def _lose_unseen(folder):
    next(iter(sorted((folder / "sealed").rglob("*.csv")))).unlink()


@pytest.mark.parametrize(
    "tamper", [_change_label, _change_salt, _change_unseen, _change_commitment, _lose_unseen]
)
def test_tampering_shows(made, tmp_path, tamper):
    folder = tmp_path / "t"
    shutil.copytree(made, folder)
    tamper(folder)
    with pytest.raises(InputError):
        score(folder, baseline=False)


def test_untampered_unrun_trial_scores_as_misses(made, tmp_path):
    folder = tmp_path / "t"
    shutil.copytree(made, folder)
    scores = score(folder, baseline=False).sets[0]
    assert scores.failed == 3 and not scores.reached
    rows = {row.name: row for row in scores.rows}
    assert rows["false alarm on none or parameter error"].value == 1.0


@pytest.mark.parametrize(
    "signals, roles",
    [
        pytest.param("C", {"command", "pressure", "curvature", "output"}, marks=pytest.mark.long),
        pytest.param("B", {"command", "pressure", "output"}, marks=pytest.mark.long),
        ("A", {"command", "output"}),
    ],
)
def test_logs_are_readable_and_carry_their_signals(tmp_path, signals, roles):
    for seed in range(3):
        folder = tmp_path / str(seed)
        focgen.trial("make", folder, cases=1, seed=seed, suite="short", signals=signals, kinds=("single",))
        case = folder / "cases" / "0001"
        rig = focgen.read_rig(case / "rig.toml")
        logs = focgen.read_logs(rig, sorted((case / "logs").iterdir()))
        assert [log.name for log in logs] and set(logs[0].signals) == roles
        seconds = sum(len(log) for log in logs) * rig.sample_time
        assert 220 < seconds < 320
        for log in logs:
            assert np.all(np.isfinite(log["output"]))
            assert log.sample_time == pytest.approx(rig.sample_time, rel=1e-3)


def test_every_number_of_cases_is_made_in_full(tmp_path):
    from focgen.trials.plan import assignments

    for count in (1, 2, 5, 23, 200):
        for suite in ("full", "closed"):
            kinds = ("single", "none") if suite == "closed" else ("single", "pair", "none", "outside")
            assert len(assignments(count, kinds, "C", suite, np.random.default_rng(1))) == count
    found = assignments(207, ("single",), "C", "full", np.random.default_rng(2))
    dealt = {effect: [a.severity for a in found if a.effects == (effect,)] for effect in VOCABULARY}
    assert all(sorted(s) == sorted(["low", "mid", "high"] * 3) for s in dealt.values())


def test_noise_is_half_white_half_autocorrelated():
    for seed in range(5):
        noise = coloured(np.random.default_rng(seed), 200_000, 0.3)
        power = np.mean(noise**2)
        lags = [np.mean(noise[k:] * noise[:-k]) / power for k in (1, 2, 5)]
        assert np.sqrt(power) == pytest.approx(0.3, rel=0.03)
        assert lags == pytest.approx([0.5 * 0.9**k for k in (1, 2, 5)], abs=0.02)


@pytest.mark.parametrize(
    "wrong",
    [
        dict(cases=0),
        dict(seed=-1),
        dict(signals="D"),
        dict(suite="long"),
        dict(kinds=("singel",)),
        dict(suite="closed", kinds=("pair",)),
    ],
)
def test_arguments_that_make_no_sense_are_refused(tmp_path, wrong):
    with pytest.raises(InputError):
        focgen.trial("make", tmp_path / "x", **wrong)
    assert not (tmp_path / "x").exists()
