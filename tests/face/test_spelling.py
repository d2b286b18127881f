"""Rig first, then logs, in every function; the spellings of before work, with a warning that says the new.

Red when an argument is named otherwise than its option, or an old spelling stops working.
"""

import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.diagnosis.proposals.identifiability import plan
from focgen.errors import ControllerError, LogError, RigError
from focgen.logs.experiment import Experiment
from focgen.resources import shipped
from focgen.rig import Signals
from focgen.spelling import respelled

EXAMPLES = shipped("examples")
RIG, LOG = EXAMPLES / "rig.toml", EXAMPLES / "logs" / "steps.csv"
TABLE = tomllib.loads(RIG.read_text(encoding="utf-8"))


def columns():
    """The log as a dictionary of arrays."""
    names = LOG.read_text(encoding="utf-8").splitlines()[0].split(",")
    cells = np.genfromtxt(LOG, delimiter=",", skip_header=1, dtype=str).T
    return {n: c if n == TABLE["signals"]["run"] else c.astype(float) for n, c in zip(names, cells)}


@pytest.fixture(scope="module")
def truth():
    return focgen.replay(RIG, LOG).logs


@pytest.mark.parametrize(
    "rig, logs",
    [
        (RIG, [LOG]),
        (str(RIG), str(LOG)),
        (TABLE, columns()),
        (focgen.read_rig(RIG), [columns()]),
        (RIG, focgen.read_rig and (path for path in [LOG])),
    ],
    ids=["paths", "texts", "dictionaries", "objects", "an iterator"],
)
@pytest.mark.parametrize(
    "turned", [pytest.param(False, marks=pytest.mark.long), True], ids=["rig first", "logs first"]
)
def test_either_order_is_told_by_the_types(rig, logs, turned, truth, recwarn):
    logs = iter([LOG]) if hasattr(logs, "__next__") else logs
    warnings.simplefilter("always")
    found = focgen.replay(logs, rig) if turned else focgen.replay(rig, logs)
    assert [one.rmse for one in found.logs.values()] == [one.rmse for one in truth.values()]
    said = [w for w in recwarn if w.category is DeprecationWarning]
    assert len(said) == turned and all("replay(rig, logs" in str(w.message) for w in said)
    assert all(w.filename == __file__ for w in said)


class _Asked(Exception):
    """What identify takes for its rig."""


def test_identify_as_it_was_called_before(monkeypatch):
    from focgen.identification import identify as module

    def asked(rig):
        raise _Asked(rig)

    monkeypatch.setattr(module, "rig_of", asked)
    rig, experiment = focgen.read_rig(RIG), Experiment("a", 0.01, {"output": np.zeros(5)})
    for way in (
        lambda: focgen.identify([LOG], rig, None, stages=("sensor",)),
        lambda: focgen.identify(experiment, rig=rig),
        lambda: focgen.identify(columns(), rig),
    ):
        with pytest.warns(DeprecationWarning, match=r"order is now identify\(rig, logs"):
            with pytest.raises(_Asked) as caught:
                way()
        assert caught.value.args[0] is rig
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for way in (lambda: focgen.identify(logs=[LOG], rig=rig), lambda: focgen.identify(rig, LOG)):
            with pytest.raises(_Asked):
                way()


def test_the_names_are_those_of_the_options(tmp_path):
    new = focgen.replay(RIG, LOG, from_=1.0, to=5.0)
    with pytest.warns(DeprecationWarning) as said:
        old = focgen.replay(RIG, LOG, first=1.0, last=5.0)
    assert {str(w.message) for w in said} == {
        "replay(first=…) is now replay(from_=…)",
        "replay(last=…) is now replay(to=…)",
    }
    assert [x.rmse for x in old.logs.values()] == [x.rmse for x in new.logs.values()]
    assert [x.rmse for x in new.logs.values()] != [x.rmse for x in focgen.replay(RIG, LOG).logs.values()]
    with pytest.raises(TypeError, match="both 'first' and 'from_'"):
        focgen.replay(RIG, LOG, first=1.0, from_=1.0)
    with pytest.warns(DeprecationWarning, match=r"generate\(for_=…\)"):
        focgen.generate(EXAMPLES / "controller.toml", tmp_path, package="plain")


def test_every_function_of_a_rig_and_its_logs_takes_both_orders():
    session = focgen.read_logs(RIG, LOG, to=3.0)
    bare = focgen.read_rig(RIG)
    with pytest.warns(DeprecationWarning, match=r"plan\(rig, logs"):
        turned = plan(session[:1], bare)
    assert turned == plan(bare, session[:1])
    with pytest.warns(DeprecationWarning, match=r"diagnose\(rig, logs"), pytest.raises(LogError):
        focgen.diagnose([Experiment("short", 0.01, {"output": np.zeros(5)})], bare)


def test_logs_are_read_as_the_rig_says_them():
    rig = focgen.read_rig(RIG)
    new = focgen.read_logs(RIG, [LOG])
    with pytest.warns(DeprecationWarning, match=r"read_logs\(rig, logs, from_, to\)"):
        old = focgen.read_logs([LOG], rig.signals, rig.sample_time)
    assert [e.name for e in old] == [e.name for e in new] and len(new) > 1
    assert all(np.array_equal(a["output"], b["output"]) for a, b in zip(old, new))
    assert len(focgen.read_logs(RIG, LOG, from_=1.0, to=2.0)[0]) == 51


def test_rigs_and_controllers_are_files_dictionaries_or_objects(tmp_path):
    """The same comes out, whichever is given."""
    path = EXAMPLES / "controller.toml"
    table, made = tomllib.loads(path.read_text(encoding="utf-8")), focgen.read_controller(path)
    steps = [
        focgen.simulate(rig, controller, [0.01]).setpoints
        for rig, controller in ((RIG, path), (TABLE, table), (focgen.read_rig(RIG), made))
    ]
    assert steps[0] == steps[1] == steps[2]
    assert focgen.design(TABLE, setpoints=[0.01]).controller.designed_from is None
    folders = [focgen.generate(given, tmp_path / str(i)) for i, given in enumerate((path, table, made))]
    assert folders[0].manifest["proofs"] == folders[1].manifest["proofs"] == folders[2].manifest["proofs"]
    with pytest.raises(ControllerError, match="give a Controller, a controller.toml or a dictionary"):
        focgen.generate(3.0, tmp_path)
    with pytest.raises(ControllerError, match="controller: lacks the table"):
        focgen.generate({"sample_time": 0.01}, tmp_path)


def test_a_study_without_a_folder_leaves_nothing(tmp_path):
    from focgen.studies import study

    with study._folder(None) as place:
        (place / "row.json").write_text("{}", encoding="utf-8")
    with study._folder(tmp_path) as kept:
        (kept / "row.json").write_text("{}", encoding="utf-8")
    assert not place.exists() and (tmp_path / "row.json").exists()


@pytest.mark.parametrize("rig", [7, None, [RIG]])
def test_what_is_no_rig_is_said(rig):
    with pytest.raises(RigError, match="give a Rig, a rig.toml or a dictionary"):
        focgen.design(rig)


def test_what_is_no_log_is_said():
    with pytest.raises(LogError, match="give a path, a frame, a dictionary of arrays"):
        focgen.replay(RIG, 3.0)


def test_the_rig_of_two_paths_is_the_toml(tmp_path):
    odd = tmp_path / "rig"
    odd.write_bytes(RIG.read_bytes())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert focgen.replay(odd, LOG).logs and focgen.replay(str(odd), [str(LOG)]).logs


def test_a_signature_is_that_of_the_function():
    import inspect

    assert list(inspect.signature(focgen.identify).parameters)[:5] == ["rig", "logs", "out", "from_", "to"]
    assert respelled({})(Path).__name__ == "Path"
    assert isinstance(focgen.read_rig(RIG).signals, Signals)
