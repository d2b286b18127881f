"""A trial that was interrupted while it was made: the same arguments finish it, others do not get into it.

Red when the logs of two trials stand in one case.
"""

import json

import pytest

import focgen
from focgen import scratch
from focgen.errors import InputError
from focgen.trials import make as making


def make(folder, **other):
    asked = {"cases": 2, "seed": 11, "signals": "A", "suite": "short", "kinds": ("none",)}
    return focgen.trial("make", folder, **asked | other)


def content(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture
def interrupted(tmp_path, monkeypatch):
    """A folder with the first case of two."""
    write = making._write

    def first(folder, number, case, salt):
        if number == "0002":
            raise KeyboardInterrupt
        return write(folder, number, case, salt)

    with monkeypatch.context() as patched:
        patched.setattr(making, "_write", first)
        with pytest.raises(KeyboardInterrupt):
            make(tmp_path / "t")
    return tmp_path / "t"


@pytest.mark.parametrize(
    "other",
    [
        {"seed": 12},
        pytest.param({"cases": 1}, marks=pytest.mark.long),
        {"signals": "C"},
        pytest.param({"suite": "full"}, marks=pytest.mark.long),
        {"kinds": ("parameters",)},
    ],
)
def test_another_trial_does_not_get_among_its_cases(interrupted, other):
    before = content(interrupted)
    with pytest.raises(InputError, match="holds part of another trial"):
        make(interrupted, **other)
    assert content(interrupted) == before


def test_the_same_arguments_finish_it(interrupted, tmp_path):
    make(interrupted)
    make(tmp_path / "whole")
    assert content(interrupted) == content(tmp_path / "whole") and not (interrupted / "begun.json").exists()


@pytest.mark.parametrize("left", ["cases", "sealed", "runs"])
def test_cases_of_which_nothing_tells_are_left_alone(tmp_path, left):
    (tmp_path / "t" / left / "0001").mkdir(parents=True)
    with pytest.raises(InputError, match=f"holds {left}, and no begun.json"):
        make(tmp_path / "t")
    assert content(tmp_path / "t") == {}


def test_one_of_another_version_is_another(interrupted):
    told = json.loads((interrupted / "begun.json").read_text())
    (interrupted / "begun.json").write_text(json.dumps(told | {"focgen": "0.0.0"}))
    with pytest.raises(InputError, match="holds part of another trial"):
        make(interrupted)


def test_two_that_are_made_at_once_do_not_mix(tmp_path, monkeypatch):
    """The one that begins second is refused, although the first has written no case."""
    write, seen = making.write_file, []

    def meanwhile(path, text):
        if not seen:
            seen.append(path)
            with pytest.raises(InputError, match="another process"):
                make(tmp_path / "t", seed=12)
        write(path, text)

    monkeypatch.setattr(scratch, "PATIENCE", 0.1)
    monkeypatch.setattr(making, "write_file", meanwhile)
    made = make(tmp_path / "t")
    assert json.loads((tmp_path / "t" / "trial.json").read_text())["commitments"] == made.commitments
