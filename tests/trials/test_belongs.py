"""A kept result is of the case that it lies beside, as that case is.

Red when the result of another case, or of one that was changed, is scored as this one's, when what was kept
is used though it was edited, or when scoring writes outside of its trial.
"""

import errno
import json
import shutil
import signal
import sys
from pathlib import Path

import pytest

import focgen
from focgen.cli.main import main
from focgen.errors import InputError
from focgen.trials import achieved, belongs, worker
from focgen.trials import run as running
from focgen.trials import score as scoring
from focgen.trials.facts import achieved_in, facts_of, kept_achieved
from tests.trials.test_untrusted import RUN

NUMBERS = ("0001", "0002", "0003")


@pytest.fixture(scope="module")
def ran(tmp_path_factory) -> Path:
    """A trial whose diagnoses were made up, each with its number."""
    folder = tmp_path_factory.mktemp("trial") / "t"
    focgen.trial("make", folder, cases=3, seed=5, suite="short", kinds=("single", "none"), signals="A")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(running, "_process", made_up)
        assert focgen.trial("run", folder, jobs=1).now == 3
    return folder


def made_up(blind: Path, out: Path, *_: object) -> str:
    out.mkdir()
    said = {**RUN["diagnosis.json"], "notes": [(blind / "commitment.txt").read_text()]}
    (out / "diagnosis.json").write_text(json.dumps(said))
    (out / "outcome.json").write_text(json.dumps(RUN["outcome.json"]))
    for name in ("refitted.toml", "augmented.toml"):
        shutil.copy(blind / "rig.toml", out / name)
    return ""


@pytest.fixture
def trial(ran, tmp_path, monkeypatch) -> Path:
    monkeypatch.setattr(running, "_process", made_up)
    monkeypatch.setattr(achieved, "shrink", lambda *_: 0.5)  # replays take time
    return Path(shutil.copytree(ran, tmp_path / "t"))


def scored(trial: Path) -> int:
    return main(["trial", "score", str(trial), "--no-baseline", "--jobs", "1", "--json"])


def cut(path: Path) -> None:
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: len(lines) // 2]))


def another_case(trial: Path) -> None:
    shutil.rmtree(trial / "runs/0001")
    shutil.copytree(trial / "runs/0002", trial / "runs/0001")


def another_verdict(trial: Path) -> None:
    shutil.copy(trial / "runs/0002/diagnosis.json", trial / "runs/0001")


def an_edited_word(trial: Path) -> None:
    place = trial / "runs/0001/outcome.json"
    place.write_text(place.read_text().replace("1.0", "0.1"))


def an_added_rig(trial: Path) -> None:
    (trial / "runs/0001/augmented.toml").write_text("sample_time = 1.0")


@pytest.mark.parametrize(
    "how",
    [
        pytest.param(another_case, marks=pytest.mark.long),
        pytest.param(another_verdict, marks=pytest.mark.long),
        an_edited_word,
        pytest.param(an_added_rig, marks=pytest.mark.long),
    ],
)
def test_a_result_that_is_not_of_its_case_is_refused_and_made_anew(trial, how, capsys):
    assert scored(trial) in (0, 1)
    how(trial)
    capsys.readouterr()
    assert scored(trial) == 2
    assert "runs/0001: is not the result of case 0001 as it is" in capsys.readouterr().err
    assert main(["trial", "run", str(trial), "--jobs", "1", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["now"] == 1 and "so it is made anew" in err
    assert scored(trial) in (0, 1)


def test_a_case_that_was_changed_is_not_scored(trial, capsys):
    """Its results are not of it, and it is not what was committed to, though the seal is whole."""
    logs = next((trial / "cases/0001/logs").iterdir())
    cut(logs)
    assert scored(trial) == 2
    assert "is not the result of case 0001" in capsys.readouterr().err
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 0
    capsys.readouterr()
    assert scored(trial) == 2
    assert f"logs/{logs.name}: is not the file that was committed to" in capsys.readouterr().err


def test_a_log_that_was_added_to_a_case_is_told(trial, capsys):
    shutil.copy(next((trial / "cases/0003/logs").iterdir()), trial / "cases/0001/logs/more.csv")
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 0
    capsys.readouterr()
    assert scored(trial) == 2
    assert "more.csv: is no part of the case as it was made" in capsys.readouterr().err


def test_what_is_laid_beside_the_unseen_logs_takes_no_part(trial, monkeypatch):
    asked = []
    monkeypatch.setattr(achieved, "shrink", lambda run, logs, floor: asked.extend(logs))
    unseen = trial / "sealed/0003/unseen"
    committed = sorted(unseen.iterdir())
    (unseen / "00.csv").write_text("t,u,y\n0,1,2\n")
    label = json.loads((trial / "sealed/0003/label.json").read_text())["label"]
    scoring._kept(trial, trial / "runs/0003", "0003", label)
    assert asked == committed


def test_a_kept_shrink_that_was_edited_or_copied_is_reckoned_anew(trial):
    assert scored(trial) in (0, 1)
    place = trial / "runs/0003/achieved.json"
    kept = place.read_text()
    for other in ("0.999", json.dumps(json.loads(kept) | {"achieved": 0.999})):
        place.write_text(other)
        assert scored(trial) in (0, 1)
        assert place.read_text() == kept
    place.write_text(json.dumps(kept_achieved(0.5, "a")))
    assert achieved_in(place.parent, "a") == (0.5,) and achieved_in(place.parent, "b") is None


def test_results_of_an_earlier_version_are_taken_for_their_places(trial):
    for number in NUMBERS:
        (trial / "runs" / number / "outcome.json").write_text(json.dumps(RUN["outcome.json"]))
    assert scored(trial) in (0, 1)
    assert focgen.trial("run", trial, jobs=1).now == 0


@pytest.mark.parametrize("linked", ["runs", "runs/0001"])
def test_scoring_writes_nothing_outside_of_the_trial(trial, tmp_path, linked, capsys):
    shutil.move(trial / linked, tmp_path / "elsewhere")
    (trial / linked).symlink_to(tmp_path / "elsewhere")
    before = sorted((tmp_path / "elsewhere").rglob("*"))
    assert scored(trial) == 2
    assert "leads out of" in capsys.readouterr().err
    assert sorted((tmp_path / "elsewhere").rglob("*")) == before


@pytest.mark.parametrize("loop", ["runs", "runs/0001"])
def test_links_that_lead_round_in_a_circle_are_told(trial, loop, capsys):
    shutil.rmtree(trial / loop)
    (trial / loop).symlink_to(trial / loop)
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith(f"focgen: error: {trial}/runs")


def test_scores_take_the_place_of_scores_only(trial, capsys):
    (trial / "scores.json").write_text("what I found out in March\n")
    assert scored(trial) == 2
    assert "and would be lost" in capsys.readouterr().err
    assert (trial / "scores.json").read_text() == "what I found out in March\n"


def test_no_case_is_made_outside_of_the_trial(tmp_path, capsys):
    """A stranger's folder that says it is this very trial's, whose cases lie elsewhere."""
    make = ["trial", "make", str(tmp_path / "t"), "--cases", "1", "--suite", "short", "--kinds", "none"]
    facts = {"focgen": focgen.__version__, "suite": "short", "signals": "C", "seed": 0, "kinds": ["none"]}
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "t").mkdir()
    (tmp_path / "t" / "cases").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "t" / "begun.json").write_text(json.dumps({**facts, "cases": 1}))
    assert main(make) == 2
    assert "leads out of" in capsys.readouterr().err and not list((tmp_path / "elsewhere").iterdir())


@pytest.mark.parametrize("where", ["diagnosis", "result"])
def test_a_full_disk_is_no_fault_of_a_case(ran, tmp_path, where, capsys, monkeypatch):
    """It counted as a miss in every row of the scores, for good: the next run passed it over."""

    def full(*_: object, **__: object) -> None:
        try:
            raise OSError(errno.ENOSPC, "No space left on device")
        except OSError as reason:  # as the writers of results tell it
            told = InputError("out", f"cannot be written ({reason.strerror})", "choose another")
            raise (told if where == "result" else reason) from None

    trial = Path(shutil.copytree(ran, tmp_path / "t"))
    shutil.rmtree(trial / "runs")
    monkeypatch.setattr(focgen, "diagnose", full)
    status = worker._status_of(trial / "cases/0001", tmp_path / "out", ())
    assert status == worker.NO_ROOM and not (tmp_path / "out" / "outcome.json").exists()
    program = ("-c", f"raise SystemExit({status})")
    monkeypatch.setattr(running, "python", lambda *_: [sys.executable, *program])
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 2
    assert "had no room for a diagnosis" in capsys.readouterr().err and not list(trial.glob("runs/*/*"))


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGKILL", "asked"])
def test_a_diagnosis_that_is_ended_from_outside_is_no_fault_of_its_case(
    ran, tmp_path, name, capsys, monkeypatch
):
    """By whoever shuts a machine down, or for want of memory: a miss, for good."""
    trial = Path(shutil.copytree(ran, tmp_path / "t"))
    shutil.rmtree(trial / "runs")
    # as usual, not as under nohup
    usual = "" if name == "SIGKILL" else f"signal.signal(signal.{name}, signal.SIG_DFL); "
    end = f"import os, signal; {usual}os.kill(os.getpid(), signal.{name})"
    asked = f"import signal; from focgen.trials.worker import _end; _end({signal.SIGTERM.value}, None)"
    program = ("-c", asked if name == "asked" else end)
    monkeypatch.setattr(running, "python", lambda *_: [sys.executable, *program])
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 2
    assert "was ended from outside" in capsys.readouterr().err and not list(trial.glob("runs/*/*"))


def test_memory_that_there_is_none_of_is_no_fault_of_a_case(tmp_path, monkeypatch):
    monkeypatch.setattr(focgen, "diagnose", raising(MemoryError()))
    (tmp_path / "logs").mkdir()
    assert worker._status_of(tmp_path, tmp_path / "out", ()) == worker.NO_ROOM


def test_what_a_system_or_somebody_leaves_beside_a_case_is_no_part_of_it(trial, capsys):
    """It was: the finder of a Mac, looking in, made every result one of another case, or a case a miss."""
    for name in (".DS_Store", "notes.txt", "rig.toml~", "logs/.DS_Store"):
        (trial / "cases/0001" / name).write_text("nothing")
    (trial / "cases/0002/elsewhere").symlink_to("/")
    assert scored(trial) in (0, 1)
    assert focgen.trial("run", trial, jobs=1).now == 0
    blind = trial.parent / "blind"
    belongs.copy_case(trial / "cases/0001", blind)
    found = {path.relative_to(blind).as_posix() for path in blind.rglob("*") if path.is_file()}
    given = json.loads((trial / "sealed/0001/label.json").read_text())["label"]["given"]
    assert found == {"commitment.txt", *given}


@pytest.mark.parametrize("name", ["notes.txt", ".notes.md", "mine/diagnosis.json"])
def test_what_somebody_keeps_beside_a_result_is_not_removed_with_it(trial, name, capsys):
    """The whole folder once went, without a word, where its case was diagnosed anew."""
    path, left = trial / "runs/0001" / name, trial / "runs/0001/.DS_Store"
    path.parent.mkdir(exist_ok=True)
    for place in (path, left):
        place.write_text("mine")
    (trial / "runs/0001/outcome.json").unlink()
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 2
    assert f"/{name.split('/')[0]}: is no part of a result" in capsys.readouterr().err
    assert path.read_text() == "mine"
    shutil.move(path, trial / "elsewhere.txt")
    shutil.rmtree(trial / "runs/0001/mine", ignore_errors=True)
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 0


def test_nor_beside_experiments_that_were_asked_for(tmp_path):
    place = tmp_path / "asked/0001"
    (place / "proposed").mkdir(parents=True)
    (place / "proposed/outcome.json").write_text("{}")
    belongs.check_only_results(tmp_path, "asked", "0001", depth=2)
    (place / "proposed/notes.txt").write_text("mine")
    with pytest.raises(InputError, match="notes.txt: is no part of a result"):
        belongs.check_only_results(tmp_path, "asked", "0001", depth=2)


def test_a_case_that_is_read_only_is_copied_without_its_rights(trial, tmp_path):
    """Its copies could not be removed, nor written beside: each run left one, and proposals were refused."""
    case = trial / "cases/0001"
    for path in (*case.rglob("*"), case):
        path.chmod(0o555 if path.is_dir() else 0o444)
    belongs.copy_case(case, tmp_path / "blind")
    for path in (*case.rglob("*"), case):
        path.chmod(0o755 if path.is_dir() else 0o644)
    assert all(path.stat().st_mode & 0o200 for path in (tmp_path / "blind").rglob("*"))


def test_what_cannot_be_read_is_no_miss_and_no_other_case(trial, capsys, monkeypatch):
    """A table of misses, where whoever scores has no rights to the results; of a case, that it changed."""
    with monkeypatch.context() as patched:
        patched.setattr("os.access", lambda *_: False)
        assert scored(trial) == 2
    assert "runs/0001/outcome.json: cannot be read" in capsys.readouterr().err
    monkeypatch.setattr(belongs, "sha256_within", lambda *_: None)
    assert scored(trial) == 2
    assert "cases/0001/commitment.txt: cannot be read" in capsys.readouterr().err


def test_a_damaged_word_of_a_run_is_told(trial, capsys):
    (trial / "runs/0001/outcome.json").write_text("")
    assert scored(trial) in (0, 1)
    assert "runs/0001 is damaged, so it counts as a miss" in capsys.readouterr().err


def test_a_fault_of_a_case_is_one(tmp_path, monkeypatch):
    for fault in (OSError(errno.ENOENT, "gone"), ValueError("no"), InputError("a", "b", "c")):
        monkeypatch.setattr(focgen, "diagnose", raising(fault))
        (tmp_path / "logs").mkdir(exist_ok=True)
        assert worker._status_of(tmp_path, tmp_path / "out", ()) == 0
        assert json.loads((tmp_path / "out" / "outcome.json").read_text())["status"] == "failed"


def raising(fault: Exception):
    def call(*_: object, **__: object) -> None:
        raise fault

    return call


@pytest.mark.parametrize("key, other", (("signals", "C"), ("suite", "full")))
def test_a_trial_that_says_it_is_another_is_not_scored(trial, capsys, key, other):
    """The table had that one's rows and targets. Every sealed label says what it was made for."""
    facts = json.loads((trial / "trial.json").read_text())
    (trial / "trial.json").write_text(json.dumps({**facts, key: other}))
    assert scored(trial) == 2
    assert f"says {key} {other!r}, and the label of case 0001 says" in capsys.readouterr().err


def test_a_case_that_was_taken_off_the_list_is_told(trial, capsys):
    """A table of the others passed for one of the trial."""
    facts = json.loads((trial / "trial.json").read_text())
    del facts["commitments"]["0002"]
    (trial / "trial.json").write_text(json.dumps(facts))
    assert scored(trial) == 2
    said = capsys.readouterr().err
    assert "sealed/0002/label.json: is of a case that trial.json does not name" in said
    for folder in ("sealed", "cases"):
        shutil.rmtree(trial / folder / "0002")
    assert scored(trial) in (0, 1)


@pytest.mark.parametrize("version", ["0", "0.0.9", "99.0.0", "", "newest", 0, None, "0.1.0000000000"])
def test_a_trial_of_a_version_that_is_not_known_is_told(trial, version, capsys):
    facts = json.loads((trial / "trial.json").read_text())
    (trial / "trial.json").write_text(json.dumps({**facts, "focgen": version}))
    assert scored(trial) == 2
    assert f"says that focgen {str(version)!r} made it, and this is" in capsys.readouterr().err


def test_a_trial_of_an_earlier_version_is_one(trial, monkeypatch):
    monkeypatch.setattr(focgen, "__version__", "0.12.3")
    assert facts_of(trial).suite == "short"
    monkeypatch.setattr(focgen, "__version__", "0.12.3rc1")
    facts = json.loads((trial / "trial.json").read_text())
    (trial / "trial.json").write_text(json.dumps({**facts, "focgen": "0.12.3rc1"}))
    assert facts_of(trial).suite == "short"
