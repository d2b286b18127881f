"""Processes that the package starts run nothing of the folder one stands in, which may be a stranger's.

Red when a file of the current folder stands in for a module of another process.
"""

import os
import subprocess
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from focgen import children, compiler
from focgen.logs.subprocess_reader import read_in_subprocess
from focgen.studies import sweep
from focgen.trials import run

ROOT = Path(children.__file__).resolve().parent
MODULES = ("json", "numpy", "multiprocessing", "pickle", "ziglang", "focgen")


@pytest.fixture
def hostile(tmp_path, monkeypatch) -> Path:
    """A current folder of modules that leave a mark when they are run."""
    for name in MODULES:
        (tmp_path / "here" / name).mkdir(parents=True)
        for file in ("__init__.py", "__main__.py"):
            text = f"open({str(tmp_path / 'mark')!r}, 'a').write({name!r})\nraise SystemExit(9)\n"
            (tmp_path / "here" / name / file).write_text(text)
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path


def test_the_folder_is_hostile(hostile):
    """Else the others could not fail."""
    words = [children.python()[0], "-c", "import json"]
    unsafe = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    assert subprocess.run(words, env=unsafe).returncode == 9 and (hostile / "mark").exists()


def test_a_case_of_a_trial_is_diagnosed_by_this_package(hostile):
    run.blind_diagnosis(hostile / "case", hostile / "out", 60.0)
    word = (hostile / "out" / "outcome.json").read_text()  # the worker's own
    assert "rig.toml: cannot be read" in word
    assert not (hostile / "mark").exists()


def test_workers_of_a_study(hostile):
    with sweep._pool(1) as pool, sweep._no_script():
        assert pool.submit(os.getcwd).result() == str(hostile / "here")
    assert not (hostile / "mark").exists() and "PYTHONSAFEPATH" not in os.environ


def test_a_reader_of_binary_logs(hostile):
    with pytest.raises(FileNotFoundError):  # the reader's own word
        read_in_subprocess("focgen.logs.mat_file", hostile / "log.mat")
    assert not (hostile / "mark").exists()


def test_zigs_compiler(hostile, monkeypatch):
    pytest.importorskip("ziglang")
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    monkeypatch.delenv("CC", raising=False)
    subprocess.run([*compiler.find_compiler(), "--version"], capture_output=True)
    assert not (hostile / "mark").exists()


def test_there_is_no_other_way_to_start_one():
    """Every command of Python's is from ``children``, and every pool of processes from ``pools``."""
    for path in ROOT.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert path.name == "children.py" or "sys.executable" not in text, path
        assert path.name == "pools.py" or f"{ProcessPoolExecutor.__name__}(" not in text, path
