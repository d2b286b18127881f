"""A manifest or a controller that is not what was generated, and folders and options that cannot be used.

Red when a folder passes that is not what was generated.
"""

import json
import re
import shutil
import sys
from pathlib import Path

import pytest

from focgen.cli.main import main
from focgen.errors import FocgenError
from focgen.targets import emulator
from focgen.verification import compare
from focgen.verification.folder import read_folder
from focgen.verification.verify import verify
from tests.verification.test_mutations import ARITHMETICS, SAMPLES, Fault, copied, rewrite, sound_folders, sow


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> Path:
    return sound_folders(tmp_path_factory.mktemp("sound"))


# ------------------------------------------------------------------- the manifest and the controller


def doubled(*path):
    """Multiply one number of the manifest by 2."""

    def change(manifest):
        entry = manifest
        for key in path[:-1]:
            entry = entry[key]
        entry[path[-1]] = entry[path[-1]] * 2

    return change


def halved_bounds(manifest):
    """A promise that cannot be kept."""
    for key in ("operator", "output_per_sample"):
        manifest["error_bound"]["quantisation"][key] *= 0.01


DOCTORED = {
    "bound of the operator": doubled("error_bound", "quantisation", "operator"),
    "bound of the output": doubled("error_bound", "quantisation", "output_per_sample"),
    "bound of truncation": doubled("error_bound", "truncation", "operator"),
    "bounds too tight": halved_bounds,
    "reference LSB": doubled("REF_LSB"),
    "output LSB": doubled("U_LSB"),
    "schedule LSB": doubled("SCHED_LSB"),
    "a range": doubled("ranges", "output", 1),
    "bytes": doubled("sizes", "state_bytes"),
    "sample time": doubled("sample_time"),
    "longer": doubled("length"),
    "shorter": lambda manifest: manifest.update(length=39),
    "a hash": lambda manifest: manifest["inputs"].update({"controller.toml": "0" * 64}),
    "no proofs": lambda manifest: manifest.update(proofs=[{}]),
    "more than there is": lambda manifest: manifest.update(certified=True),
}


@pytest.mark.parametrize("doctored", DOCTORED)
def test_a_doctored_manifest(sound, tmp_path, doctored, capsys):
    folder = copied(sound, tmp_path, "spba", ARITHMETICS[len(doctored) % 3])
    rewrite(folder, DOCTORED[doctored])
    assert main(["verify", str(folder), "--samples", "500", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["differences"]


def test_bounds_that_are_exceeded_are_seen_as_such(sound, tmp_path):
    """What the samples show, whatever the plan says of the bounds."""
    folder = copied(sound, tmp_path, "spba", "q15")
    rewrite(folder, halved_bounds)
    assert not verify(folder, SAMPLES, edited=True).targets["host"].within


def leaves(entry, path=()):
    """The path of every value in the manifest."""
    items = entry.items() if isinstance(entry, dict) else enumerate(entry) if isinstance(entry, list) else ()
    for key, value in items:
        yield from leaves(value, (*path, key)) if isinstance(value, (dict, list)) else [(*path, key)]


@pytest.mark.parametrize(
    "arithmetic, by",
    [
        ("f32", None),
        pytest.param("q15", 0, marks=pytest.mark.long),
        *(pytest.param("f32", by, marks=pytest.mark.long) for by in ("x", -1, float("nan"), [])),
    ],
)
def test_no_value_of_the_manifest_may_be_anything_else(sound, tmp_path, arithmetic, by):
    """Each of them in turn: either a difference, or an error of one line."""
    folder = copied(sound, tmp_path, "filter", arithmetic)
    whole = (folder / "manifest.json").read_text()
    for path in leaves(json.loads(whole)):
        entry = manifest = json.loads(whole)
        for key in path[:-1]:
            entry = entry[key]
        if path == ("generator",) or entry[path[-1]] == by:
            continue
        entry[path[-1]] = by
        (folder / "manifest.json").write_text(json.dumps(manifest))
        try:
            assert read_folder(folder).differences, path
        except FocgenError as error:
            assert "\n" not in str(error)


CHANGED = {
    "order": (r"0\.6\]", "0.61]"),
    "coefficient": (r"\[\[1\.32,", "[[1.33,"),
    "a gain": (r"gains = \[\d", "gains = [4"),
    "a breakpoint": (r"0\.07,", "0.071,"),
    "sample time": (r"sample_time = 0\.01", "sample_time = 0.02"),
    "output limits": (r"output = \[0\.0, 10\.0\]", "output = [0.0, 9.0]"),
    "integrator": (r"integrator = true", "integrator = false"),
    "a comment": (r"\Z", "# harmless\n"),
}


@pytest.mark.parametrize("what", CHANGED)
def test_a_doctored_controller(sound, tmp_path, what):
    folder = copied(sound, tmp_path, "spba", ARITHMETICS[len(what) % 3])
    sow(folder, "spba", Fault(what, "controller.toml", *CHANGED[what]))
    assert main(["verify", str(folder), "--samples", "500"]) in ((1,) if what != "integrator" else (1, 2))


# ------------------------------------------------------------------------------------------ unusable folders


def missing(name):
    return lambda folder: (folder / name).unlink()


def written(name, text):
    return lambda folder: (folder / name).write_text(text)


def appended(path, text):
    path.write_text(path.read_text() + text)


UNUSABLE = {
    "no manifest": missing("manifest.json"),
    "no header": missing("spba.h"),
    "no source": missing("spba.c"),
    "no runtime": missing("foc_rt.h"),
    "no controller": missing("controller.toml"),
    "broken JSON": written("manifest.json", '{"name": "spba",'),
    "no object": written("manifest.json", "[1, 2]"),
    "empty object": written("manifest.json", "{}"),
    "not text": lambda folder: (folder / "manifest.json").write_bytes(b"\xff\xfe\x00"),
    "broken TOML": written("controller.toml", "name = \n"),
    "no name": lambda folder: rewrite(folder, lambda manifest: manifest.pop("name")),
    "a name that leads outside": lambda folder: rewrite(folder, lambda m: m.update(name="../spba")),
    "no such arithmetic": lambda folder: rewrite(folder, lambda m: m.update(arithmetic="q7")),
    "no such length": lambda folder: rewrite(folder, lambda m: m.update(length="long")),
    "bound in words": lambda folder: rewrite(
        folder, lambda m: m["error_bound"]["quantisation"].update(operator="small")
    ),
    "does not compile": written("spba.c", "this is no C\n"),
    "does not link": lambda folder: appended(
        folder / "spba.c",
        "int spba_x(void);\nint spba_x(void)\n{\n    extern int nowhere(void);\n    return nowhere();\n}\n",
    ),
    "everything": lambda folder: shutil.rmtree(folder),
}


@pytest.mark.parametrize("what", UNUSABLE)
def test_an_unusable_folder_is_an_error_of_one_line(sound, tmp_path, what, capsys):
    folder = copied(sound, tmp_path, "spba", "q15")
    UNUSABLE[what](folder)
    assert main(["verify", str(folder), "--samples", "500", "--edited"]) == 2
    out, err = capsys.readouterr()
    assert not out and re.fullmatch(r"focgen: error: [^\n]+: [^\n]+; [^\n]+\n", err), err


def test_a_target_that_is_not_there_is_skipped_and_says_why(sound, capsys, monkeypatch):
    """With nothing that ran there is nothing that holds."""
    monkeypatch.setitem(sys.modules, "unicorn", None)
    emulator._unicorn.cache_clear()
    assert main(["verify", str(sound / "spba_q15"), "--samples", "100", "--target", "all", "--json"]) == 0
    targets = json.loads(capsys.readouterr().out)["targets"]
    assert "skipped" not in targets.pop("host") and len(targets) == 6
    targets.pop("avr")
    for entry in targets.values():
        assert list(entry) == ["skipped"] and "focgen[targets]" in entry["skipped"]
    assert main(["verify", str(sound / "spba_q15"), "--target", "cortex-m3"]) == 1
    assert "skipped: needs unicorn" in capsys.readouterr().out


def test_c_that_never_returns_is_a_mismatch_that_says_so(sound, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(compare, "PATIENCE", 0.5)
    folder = copied(sound, tmp_path, "spba", "q15")
    sow(
        folder,
        "spba",
        Fault("hang", "@.c", r"s->error_now = 0;", "s->error_now = 0; for (;;) { s->flags++; }"),
    )
    assert main(["verify", str(folder), "--samples", "500", "--edited"]) == 1
    assert "did not return within" in capsys.readouterr().out


@pytest.mark.parametrize(
    "option", (["--samples", "0"], ["--seed", "-1"], ["--target", "z80"], ["--samples", "many"])
)
def test_unusable_options(sound, option, capsys):
    assert main(["verify", str(sound / "spba_q15"), *option]) == 2
    assert capsys.readouterr().err.count("\n") == 1
