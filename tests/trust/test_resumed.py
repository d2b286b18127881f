"""Trials and records that are killed half-way, and go on: the same bytes as in one go.

Red when a run that goes on gives another byte, does again what was done, or leaves something out.
"""

import hashlib
import json
import multiprocessing
import signal
import time
from dataclasses import replace
from pathlib import Path

import pytest

import focgen
from focgen.trials import run as running
from tests.records import __main__ as records
from tests.records.benchmarks import BENCHMARKS

killable = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system cannot kill so")


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def killed(work, folder: Path, until: str, count: int, *arguments) -> None:
    """Begin ``work`` in a process, and kill it when as many files ``until`` are there."""
    process = multiprocessing.get_context("fork").Process(target=work, args=(folder, *arguments))
    process.start()
    end = time.monotonic() + 60.0
    while len(list(folder.glob(until))) < count and process.is_alive() and time.monotonic() < end:
        time.sleep(0.002)
    assert process.is_alive(), "it was killed, not done"
    process.kill()
    process.join()


def make(folder: Path) -> None:
    focgen.trial("make", folder, cases=5, seed=11, suite="short", kinds=("none",))


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("trial") / "t"
    make(folder)
    return folder


@killable
@pytest.mark.parametrize("count", [pytest.param(1, marks=pytest.mark.long), 3])
def test_a_trial_that_is_killed_while_it_is_made_is_made_the_same(made, tmp_path, count):
    killed(make, tmp_path / "t", "sealed/0*/label.json", count)
    assert not (tmp_path / "t" / "trial.json").exists(), "what is not whole is no trial"
    make(tmp_path / "t")
    assert content(tmp_path / "t") == content(made)


def diagnosed(blind: Path, out: Path, limit: float, effects: tuple[str, ...]) -> str:
    """In the place of a diagnosis, which takes long: what depends on every byte of the case, and a while."""
    digest = hashlib.sha256(repr(sorted(content(blind).items())).encode()).hexdigest()
    out.mkdir()
    (out / "diagnosis.json").write_text(json.dumps({"of": digest}))
    time.sleep(0.05)
    (out / "outcome.json").write_text(json.dumps({"status": "done", "seconds": 1.0, "fault": None}))
    return ""


def run(folder: Path, jobs: int) -> None:
    focgen.trial("run", folder, jobs=jobs)


@killable
@pytest.mark.parametrize("jobs", (1, 3))
def test_a_trial_that_is_killed_goes_on_to_the_same_bytes(made, tmp_path, monkeypatch, jobs):
    import shutil

    asked = []
    monkeypatch.setattr(running, "_process", diagnosed)
    whole, halved = (Path(shutil.copytree(made, tmp_path / name)) for name in ("whole", "halved"))
    run(whole, 1)
    killed(run, halved, "runs/0*/outcome.json", 2, jobs)
    done = {path: path.stat().st_mtime_ns for path in halved.glob("runs/0*/*")}
    monkeypatch.setattr(running, "_process", lambda *given: (asked.append(given[1]), diagnosed(*given))[1])
    run(halved, jobs)
    assert content(halved) == content(whole) and 0 < len(asked) <= 3
    assert all(path.stat().st_mtime_ns == when for path, when in done.items())


class Killed(BaseException):
    """As if the process had been."""


def test_records_that_are_killed_go_on_to_the_same_bytes(tmp_path, monkeypatch, capsys):
    benchmarks = [replace(BENCHMARKS[0], name=name, train="a.csv", test="b.csv") for name in "xyz"]
    monkeypatch.setattr(records, "BENCHMARKS", benchmarks)
    (tmp_path / "a.csv").write_text("1")
    (tmp_path / "b.csv").write_text("2")
    measured, dies = [], []

    def standing_in(benchmark, data, out):
        if benchmark.name in dies:
            raise Killed
        measured.append(benchmark.name)
        return [benchmark.name, "named: `creep` 0.90", "1 mm", "1 mm", "2 mm", "3 mm", "7"]

    def table(out: str, *more: str) -> str:
        argv = ["records", "--data", str(tmp_path), "--out", str(tmp_path / out), *more]
        monkeypatch.setattr("sys.argv", argv)
        records.main()
        return capsys.readouterr().out

    monkeypatch.setattr(records, "measured", standing_in)
    whole = table("whole")
    dies.append("y")
    with pytest.raises(Killed):
        table("halved")
    dies.clear()
    capsys.readouterr()
    assert table("halved") == whole and content(tmp_path / "halved") == content(tmp_path / "whole")
    assert measured == ["x", "y", "z", "x", "y", "z"]
    (tmp_path / "b.csv").write_text("3")
    table("halved"), table("halved", "--again")
    assert measured[6:] == ["x", "y", "z"] * 2, "of other data nothing is kept, nor where all is asked anew"
