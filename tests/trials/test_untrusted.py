"""A trial's folder from elsewhere: its files are checked where they are read, and nothing outside it goes.

Red when a file of a stranger's trial is believed unread, or one outside of it goes.
"""

import copy
import json
import os
import random
import shutil
from pathlib import Path

import pytest

import focgen
from focgen.cli.main import main
from focgen.errors import InputError
from focgen.output import replace_folder
from focgen.trials import run as running
from focgen.trials.sealing import commitment


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("trial") / "t"
    focgen.trial("make", folder, cases=2, seed=7, suite="short", kinds=("single", "none"))
    return folder


@pytest.fixture
def trial(made, tmp_path, monkeypatch) -> Path:
    """A copy to spoil; its cases are not diagnosed, which would take long."""
    monkeypatch.setattr(running, "_process", lambda *arguments: "left out")
    return Path(shutil.copytree(made, tmp_path / "t"))


def rewritten(path: Path, change) -> None:
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


@pytest.fixture
def precious(tmp_path) -> Path:
    """A folder outside the trial that looks like a case and must stay as it is."""
    folder = tmp_path / "precious"
    (folder / "logs").mkdir(parents=True)
    (folder / "data.txt").write_text("years of work")
    return folder


@pytest.mark.parametrize(
    "name",
    ("{0}", "../../precious", "0001/../../../precious", ".", "..", "", "1", "0001\n", "٠٠٠١", "00012345678"),
)
def test_a_case_number_is_a_number(trial, precious, name, capsys):
    name = name.format(precious)
    rewritten(trial / "trial.json", lambda facts: facts["commitments"].update({name: "0" * 64}))
    before = sorted(trial.rglob("*"))
    for action in ("run", "score"):
        assert main(["trial", action, str(trial)]) == 2
        assert "which is no number such as 0001" in capsys.readouterr().err
    assert (precious / "data.txt").read_text() == "years of work" and sorted(trial.rglob("*")) == before


@pytest.mark.parametrize("linked", ("runs", "runs/0001"))
def test_links_do_not_lead_out_of_a_trial(trial, precious, linked, capsys):
    """The number is a number, and its place is still outside."""
    outside = precious if linked == "runs/0001" else precious.parent
    if linked == "runs":
        outside = precious.parent / "elsewhere"
        shutil.copytree(precious, outside / "0001")
    (trial / linked).parent.mkdir(exist_ok=True)
    (trial / linked).symlink_to(outside)
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 2
    assert "leads out of" in capsys.readouterr().err
    kept = outside / "data.txt" if linked == "runs/0001" else outside / "0001" / "data.txt"
    assert kept.read_text() == "years of work"


@pytest.mark.parametrize("how", ("a device", "a pipe", "a link", "a linked folder", "a linked case"))
def test_a_case_is_copied_from_within_its_trial_only(trial, precious, how, capsys):
    """A log that is /dev/zero would fill the disk, a link to / would copy it all."""
    case = trial / "cases" / "0001"
    if how == "a pipe":
        os.mkfifo(case / "logs" / "more.csv")
    elif how == "a linked case":
        shutil.rmtree(case)
        case.symlink_to(precious)
    else:
        to = {"a device": "/dev/zero", "a link": precious / "data.txt", "a linked folder": precious}[how]
        (case / "logs" / "more.csv").symlink_to(to)
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 2
    assert "is neither a file nor a folder of the trial" in capsys.readouterr().err
    assert not (trial / "runs" / "0001").exists()


def test_a_case_that_would_fill_the_disk_is_not_copied(trial, capsys):
    with (trial / "cases" / "0001" / "logs" / "more.csv").open("wb") as file:
        file.truncate(300 << 30)  # holes, that a copy fills
    assert main(["trial", "run", str(trial), "--jobs", "1"]) == 2
    assert "larger than" in capsys.readouterr().err
    assert not (trial / "runs" / "0001").exists()


@pytest.mark.parametrize("how", ("a pipe", "a device", "a terabyte"))
def test_a_commitment_is_a_small_file(trial, how, capsys):
    path = trial / "cases" / "0001" / "commitment.txt"
    path.unlink()
    if how == "a pipe":
        os.mkfifo(path)
    elif how == "a device":
        path.symlink_to("/dev/zero")
    else:
        with path.open("wb") as file:
            file.truncate(1 << 40)
    assert main(["trial", "score", str(trial), "--no-baseline", "--jobs", "1"]) == 2
    assert "commitment.txt: cannot be read" in capsys.readouterr().err


def test_a_folder_is_replaced_within_its_root_only(tmp_path, precious):
    made = tmp_path / "made"
    for target in (tmp_path / "root" / ".." / "precious", precious, tmp_path / "root" / ".."):
        made.mkdir(exist_ok=True)
        (tmp_path / "root").mkdir(exist_ok=True)
        with pytest.raises(InputError, match="leads out of"):
            replace_folder(made, target, tmp_path / "root")
    assert (precious / "data.txt").exists()
    (tmp_path / "root" / "runs" / "0001").mkdir(parents=True)
    (tmp_path / "root" / "runs" / "0001" / "old").write_text("old")
    (made / "new").write_text("new")
    replace_folder(made, tmp_path / "root" / "runs" / "0001", tmp_path / "root")
    assert [p.name for p in (tmp_path / "root" / "runs" / "0001").iterdir()] == ["new"]


def test_an_unseen_log_is_a_name_and_no_path(trial, precious, capsys):
    """A label that is consistently sealed anew, but whose log lies elsewhere."""
    place = trial / "sealed" / "0001" / "label.json"
    sealed = json.loads(place.read_text())
    sealed["label"]["unseen"] = {str(precious / "data.txt"): "0" * 64}
    place.write_text(json.dumps(sealed))
    digest = commitment(sealed["salt"], sealed["label"])
    (trial / "cases" / "0001" / "commitment.txt").write_text(digest)
    rewritten(trial / "trial.json", lambda facts: facts["commitments"].update({"0001": digest}))
    assert main(["trial", "score", str(trial)]) == 2
    assert "no unseen log" in capsys.readouterr().err


@pytest.mark.parametrize("missing", ("cases/0002", "sealed/0002", "cases/0002/commitment.txt", "trial.json"))
def test_what_a_trial_lacks_is_told_in_one_line(trial, missing, capsys):
    place = trial / missing
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    assert main(["trial", "score", str(trial), "--no-baseline"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


# ------------------------------------------------------------------------------------------- mutations

ODD = (None, True, 0, -1, 1e999, 10**400, 0.5, "", "x", "../x", "/", "\x00", "C" * 300,
       [], [[]], {}, {"a": 1})  # fmt: skip


def mutated(text: str, rng: random.Random) -> bytes:
    """One mutation: of the bytes, or of one value or key."""
    if rng.random() < 0.4:
        raw = bytearray(text.encode())
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(raw))
            raw[at : at + rng.randint(0, 3)] = rng.choice(
                (b"", b"\xff", b"[", b"}", b'"', b"9" * 5000, b"[" * 3000, bytes([rng.randrange(256)]))
            )
        return bytes(raw)
    content = json.loads(text)
    holders, waiting = [], [content]
    while waiting:
        one = waiting.pop()
        if isinstance(one, (dict, list)) and one:
            holders.append(one)
            waiting += one.values() if isinstance(one, dict) else one
    holder = rng.choice(holders)
    key = rng.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    how = rng.random()
    if how < 0.2:
        del holder[key]
    elif how < 0.4 and isinstance(holder, dict):
        holder[rng.choice(("", ".", "/tmp/x", "9999", "١٢٣٤", "x" * 300))] = copy.deepcopy(holder[key])
    else:
        holder[key] = rng.choice(ODD)
    return json.dumps(content).encode()


@pytest.mark.parametrize(
    "file", [pytest.param("trial.json", marks=pytest.mark.long), "sealed/0001/label.json"]
)
def test_no_mutation_is_a_traceback(trial, file, capsys):
    """Of 150 of each file every one is either used as it stands or an error of one line."""
    rng = random.Random(f"mutations of {file}")
    text = (trial / file).read_text()
    refused = 0
    for _ in range(150):
        (trial / file).write_bytes(mutated(text, rng))
        action = "run" if file == "trial.json" and rng.random() < 0.5 else "score"
        options = ["--jobs", "1"] if action == "run" else ["--partial", "--no-baseline", "--jobs", "1"]
        if file != "trial.json":
            options.remove("--partial")
        status = main(["trial", action, str(trial), *options])
        err = capsys.readouterr().err
        assert status in (0, 1, 2)
        refused += status == 2
        if status == 2:
            assert err.startswith("focgen: error: ") and err.count("\n") == 1, err
    assert refused > 75


RUN = {
    "outcome.json": {"status": "done", "seconds": 1.0, "fault": None},
    "achieved.json": {"achieved": 0.5, "sha256": "0" * 64},
    "diagnosis.json": {
        "verdict": "named",
        "where": {"stage": "actuator"},
        "causes": [{"stage": "actuator", "candidates": [{"effect": "creep", "confidence": 0.9}]}],
        "gap": {"as_given": 2.0, "refitted": 1.5, "explained": 1.0, "floor": 0.5},
        "shrink": 0.6,
        "shrink_interval": [0.5, 0.7],
        "next_experiment": {"what": "hold", "why": "creep"},
    },
}


@pytest.mark.parametrize(
    "file",
    ["outcome.json", *(pytest.param(f, marks=pytest.mark.long) for f in ("diagnosis.json", "achieved.json"))],
)
def test_no_mutation_of_a_result_is_a_traceback(trial, file, capsys):
    rng = random.Random(f"mutations of {file}")
    run = trial / "runs" / "0001"
    run.mkdir(parents=True)
    for name, content in RUN.items():
        (run / name).write_text(json.dumps(content))
    whole = json.dumps(RUN[file])
    for _ in range(12):
        (run / file).write_bytes(mutated(whole, rng))
        status = main(["trial", "score", str(trial), "--partial", "--no-baseline", "--json", "--jobs", "1"])
        out, _ = capsys.readouterr()
        assert status in (0, 1)
        json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} in the scores"))
