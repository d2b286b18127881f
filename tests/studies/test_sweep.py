"""The sweep: by one process, by two, on a Dask cluster, interrupted and gone on with, it finds the same.

Red when another number of processes, or an interruption, changes a row.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest

import focgen
from focgen.cli.main import main
from focgen.control.files import write_controller
from focgen.errors import FocgenError, InputError, MissingExtra
from focgen.rig.files import write_rig
from focgen.studies import sweep, write
from focgen.studies.jobs import Job
from focgen.studies.results import Band, Setup, Variant
from focgen.studies.store import Store
from tests.conftest import paper_controller, paper_rig
from tests.studies.here import answered_here

SMALL = dict(
    rig=paper_rig(),
    lengths=(20, 80),
    tolerances=(0.1,),
    arithmetic=("f64", "q15"),
    sample_times=(0.02,),
    setpoints=(0.004, 0.01),
)
SCRIPT = """
import focgen
from focgen.studies import write
from tests.studies.test_sweep import SMALL

write.files_of = lambda study: {}
focgen.study("memory", "controller.toml", "out", jobs=1, **SMALL)
"""
CONTROLLER = paper_controller(sample_time=0.02, length=80, arithmetic="q15")


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder of the small study, done by two processes."""
    folder = tmp_path_factory.mktemp("alone")
    focgen.study("memory", CONTROLLER, folder, jobs=2, **SMALL)
    return folder


@pytest.fixture(scope="module")
def alone(done):
    """What it wrote."""
    folder = done
    return (folder / "study.json").read_text()


@pytest.fixture
def counted(monkeypatch):
    """How many jobs are really done."""
    done, own = [], Store.keep
    monkeypatch.setattr(Store, "keep", lambda store, job, found: done.append(job) or own(store, job, found))
    return done


@pytest.fixture(autouse=True)
def plainly(monkeypatch):
    """Pictures take longer than the rest, and have tests of their own."""
    monkeypatch.setattr(write, "files_of", lambda study: {})


@pytest.mark.long
def test_a_dask_cluster_finds_the_same(alone, tmp_path):
    """A real scheduler with two worker processes, reached by its address."""
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        local_directory=str(tmp_path),
    )
    try:
        before = set(cluster.scheduler.workers)
        focgen.study("memory", CONTROLLER, tmp_path / "out", scheduler=cluster.scheduler_address, **SMALL)
        assert len(before) == 2
    finally:
        cluster.close()
    assert (tmp_path / "out" / "study.json").read_text() == alone


def test_what_is_there_is_not_done_again(done, alone, tmp_path, counted):
    shutil.copytree(done, tmp_path / "out")
    focgen.study("memory", CONTROLLER, tmp_path / "out", jobs=1, **SMALL)
    assert not counted
    lost = sorted((tmp_path / "out" / "rows").iterdir())[3]
    lost.write_text('{"half": ')
    with answered_here():
        focgen.study("memory", CONTROLLER, tmp_path / "out", jobs=1, **SMALL)
    assert [f"{job.key}.json" for job in counted] == [lost.name]
    assert (tmp_path / "out" / "study.json").read_text() == alone


def _other_number(kept):
    kept["answer"]["row"]["error"] = 0.5


def _other_kind(kept):
    kept["answer"]["row"] = "none"


def _no_key(kept):
    del kept["answer"]["curves"]


def _no_seal(kept):
    del kept["sha256"]


def _not_finite(kept):
    kept["answer"]["row"]["error"] = float("nan")


def test_what_was_edited_is_done_again_and_said(done, alone, tmp_path, counted, capsys):
    """Five answers, each edited in another way."""
    shutil.copytree(done, tmp_path / "out")
    rows = [p for p in sorted((tmp_path / "out" / "rows").iterdir()) if '"row"' in p.read_text()]
    edits = (_other_number, _other_kind, _no_key, _no_seal, _not_finite)
    for edited, edit in zip(rows, edits):
        kept = json.loads(edited.read_text())
        edit(kept)
        edited.write_text(json.dumps(kept))
    with answered_here():
        focgen.study("memory", CONTROLLER, tmp_path / "out", jobs=1, **SMALL)
    names = sorted(p.name for p in rows[: len(edits)])
    assert len(names) == len(edits) and sorted(f"{job.key}.json" for job in counted) == names
    said = capsys.readouterr().err
    assert all(f"{edited} is not as it was kept" in said for edited in rows[: len(edits)])
    assert (tmp_path / "out" / "study.json").read_text() == alone


def test_one_answer_does_not_stand_for_another(done, alone, tmp_path, counted):
    shutil.copytree(done, tmp_path / "out")
    one, other, *_ = sorted((tmp_path / "out" / "rows").iterdir())
    shutil.copy(one, other)
    with answered_here():
        focgen.study("memory", CONTROLLER, tmp_path / "out", jobs=1, **SMALL)
    assert [f"{job.key}.json" for job in counted] == [other.name]
    assert (tmp_path / "out" / "study.json").read_text() == alone


def test_what_has_changed_is_done_again():
    """Whatever an answer depends on is in its name."""
    setup = Setup(CONTROLLER, paper_rig(), Band(0.1, 10.0, ""), 1000, (0.004,))
    variant = Variant("short", "q15", 0.02, length=80)
    twice = replace(CONTROLLER.gain, gains=tuple(2.0 * g for g in CONTROLLER.gain.gains))
    others = [
        replace(setup, controller=replace(CONTROLLER, gain=twice)),
        replace(setup, controller=replace(CONTROLLER, ranges=replace(CONTROLLER.ranges, output=(0.0, 9.0)))),
        replace(setup, rig=replace(paper_rig(), actuator=replace(paper_rig().actuator, T=1.4))),
        replace(setup, rig=None),
        replace(setup, band=Band(0.2, 10.0, "")),
        replace(setup, samples=1001),
        replace(setup, setpoints=(0.004, 0.011)),
        replace(setup, target="cortex-m4"),
    ]
    jobs = [Job("row", setup, variant), *(Job("row", other, variant) for other in others)]
    jobs += [Job("ideal", setup, variant), Job("row", setup, replace(variant, length=81))]
    assert len({job.key for job in jobs}) == len(jobs)
    assert Job("row", setup, variant).key == jobs[0].key


def _files(folder):
    write_rig(paper_rig(), folder / "rig.toml")
    write_controller(CONTROLLER, folder / "controller.toml")
    return [
        sys.executable,
        "-m",
        "focgen",
        "study",
        "memory",
        str(folder / "controller.toml"),
        "--rig",
        str(folder / "rig.toml"),
        "--out",
        str(folder / "out"),
        "--jobs",
        "2",
        "--arithmetic",
        "f64",
        "q15",
        "--sample-times",
        "0.02",
        "--setpoints",
        "0.004",
        "0.01",
        "--tolerances",
        "0.1",
        "--lengths",
        "20",
        "80",
    ]


def _some_rows(folder, process, count=2):
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and process.poll() is None:
        if len(list(folder.glob("out/rows/[!.]*.json"))) >= count:
            return
        time.sleep(0.01)
    raise AssertionError("no rows came")


def _children(pid):
    return [int(c) for c in open(f"/proc/{pid}/task/{pid}/children").read().split()]


def _gone(pid):
    try:
        return open(f"/proc/{pid}/stat").read().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def _interruptible():
    """Where the tests run in the background, SIGINT is ignored, and a child would inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
@pytest.mark.parametrize(
    "ends", [(signal.SIGKILL,), pytest.param((signal.SIGINT, signal.SIGKILL), marks=pytest.mark.long)]
)
def test_an_interrupted_and_a_killed_study_go_on(alone, tmp_path, ends):
    command, rows = _files(tmp_path), {}
    for how in ends:
        status = 130 if how == signal.SIGINT else -how
        pipes = dict(stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        process = subprocess.Popen(command, preexec_fn=_interruptible, **pipes)
        _some_rows(tmp_path, process, len(rows) + 2)
        children = _children(process.pid)
        os.kill(process.pid, how)
        _, said = process.communicate(timeout=60)
        assert process.returncode == status and "Traceback" not in said
        assert not (tmp_path / "out" / "study.json").exists()
        deadline = time.monotonic() + 20.0
        while not all(map(_gone, children)) and time.monotonic() < deadline:
            time.sleep(0.02)
        assert all(map(_gone, children))
        found = {p: p.stat().st_mtime_ns for p in tmp_path.glob("out/rows/[!.]*.json")}
        assert len(found) >= len(rows) + 2 and rows.items() <= found.items()
        rows = found
    # the rest by one process, called from a plain script: it finds what two have found
    (tmp_path / "plain.py").write_text(SCRIPT)
    subprocess.run([sys.executable, "plain.py"], cwd=tmp_path, check=True)
    assert all(p.stat().st_mtime_ns == when for p, when in rows.items())
    assert (tmp_path / "out" / "study.json").read_text() == alone


def test_no_cluster_is_one_line(tmp_path, capsys):
    pytest.importorskip("distributed")
    write_controller(CONTROLLER, tmp_path / "c.toml")
    out = tmp_path / "out"
    argv = [
        "study",
        "memory",
        str(tmp_path / "c.toml"),
        "--out",
        str(out),
        "--scheduler",
        "tcp://127.0.0.1:9",
    ]
    sweep_patience, sweep._PATIENCE = sweep._PATIENCE, "1s"
    try:
        assert main(argv) == 2
    finally:
        sweep._PATIENCE = sweep_patience
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1].startswith("focgen: error: --scheduler: ") and not out.exists()


def test_without_dask_the_extra_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"pip install 'focgen\[cluster\]'"):
        focgen.study("memory", CONTROLLER, tmp_path / "out", scheduler="tcp://127.0.0.1:9", **SMALL)


@pytest.mark.parametrize(
    "options",
    [
        {"lengths": (0,)},
        {"lengths": (70_000,)},
        {"tolerances": (0.5,)},
        {"horizon": 10},
        {"arithmetic": ("q7",)},
        {"sample_times": (0.0,)},
        {"memory": ("long",)},
        {"setpoints": (0.0,)},
        {"setpoints": (5.0,)},
    ],
    ids=str,
)
def test_what_cannot_be_swept_is_refused_before_anything_is_written(tmp_path, options):
    with pytest.raises(FocgenError):
        focgen.study("memory", CONTROLLER, tmp_path / "out", **{**SMALL, **options})
    assert not (tmp_path / "out").exists()


def test_there_is_one_subject(tmp_path):
    with pytest.raises(InputError, match="choose memory"):
        focgen.study("gravity", CONTROLLER, tmp_path)
