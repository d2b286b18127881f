"""A folder is rendered anew and compared before anything of it is compiled.

Red when edited C is compiled unasked.
"""

import json
import re
import shutil
from pathlib import Path

import pytest

import focgen
from focgen.cli.main import main
from focgen.codegen.generate import folder_files, generate
from focgen.errors import InputError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.verification import costs, host
from focgen.verification import verify as verifying
from focgen.verification.folder import read_folder, sources
from focgen.verification.verify import verify
from tests.conftest import paper_controller
from tests.verification.test_mutations import rewrite

FORMS = {
    "q31": {"arithmetic": "q31"},
    "q15": {"arithmetic": "q15", "selftest": True},
    "f64": {"arithmetic": "f64", "name": "other"},
    "exponential": {"arithmetic": "q31", "memory": "exponential", "tolerance": 1e-3, "horizon": 1000},
    "kernels": {"arithmetic": "q15", "target": "cortex-m4", "length": 40},
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sound")
    for form, options in FORMS.items():
        generate(paper_controller(24), folder / form, **options)
    return folder


@pytest.fixture
def folder(sound, tmp_path) -> Path:
    return Path(shutil.copytree(sound / "q15", tmp_path / "folder"))


@pytest.fixture
def nothing_compiled(monkeypatch):
    """Fails where anything is compiled."""
    for module in (host, verifying, costs):
        for name in ("compile_shared", "Library", "on_core", "on_avr", "cost_on", "cost_on_avr"):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, lambda *a, **k: pytest.fail("something is compiled"))


@pytest.mark.parametrize(
    "form", [pytest.param(f, marks=pytest.mark.long if turn % 2 else ()) for turn, f in enumerate(FORMS)]
)
def test_an_untouched_folder_is_what_is_rendered(sound, form):
    read = read_folder(sound / form)
    assert read.differences == () and read.notes == ()
    assert verify(sound / form, 300).holds


def appended(name, text="\n/* mine */\n"):
    def change(folder):
        path = folder / name
        path.write_bytes(path.read_bytes() + text.encode())

    return change


def replaced(name, old, new):
    def change(folder):
        path = folder / name
        before = path.read_text()
        assert old in before
        path.write_text(before.replace(old, new, 1))

    return change


def signed(folder):
    """A header that runs a program, with its hash in the manifest: nothing in the folder contradicts it."""
    from focgen.codegen.manifest import sha256

    appended("foc_rt.h")(folder)
    digest = sha256((folder / "foc_rt.h").read_bytes())
    rewrite(folder, lambda manifest: manifest["inputs"].update({"foc_rt.h": digest}))


EDITED = {
    "a comment": ("spba.c", appended("spba.c")),
    "code at the end": (
        "spba.c",
        appended(
            "spba.c", "void abort(void);\n__attribute__((constructor)) static void x(void) { abort(); }"
        ),
    ),
    "a trigger": ("spba.c", replaced("spba.c", "unsigned flags = 0;", "unsigned flags = u == 123;")),
    "a coefficient in a comment": ("spba.h", replaced("spba.h", "1.32 s^0.6", "1.33 s^0.6")),
    "a member": ("spba.h", replaced("spba.h", "typedef struct {", "typedef struct {\n    int extra;")),
    "the header's end of line": ("spba.h", replaced("spba.h", "\n", "\r\n")),
    "the runtime": ("foc_rt.h", appended("foc_rt.h")),
    "runtime and manifest": ("foc_rt.h", signed),
    "the self-test": ("spba_selftest.c", appended("spba_selftest.c")),
    "a space in the manifest": ("manifest.json", appended("manifest.json", " ")),
    "a figure of the manifest": (
        "manifest.json",
        lambda folder: rewrite(folder, lambda manifest: manifest.update(U_LSB=2.0)),
    ),
    "the controller": ("controller.toml", appended("controller.toml", "# mine\n")),
}


@pytest.mark.parametrize(
    "what", [pytest.param(w, marks=pytest.mark.long if turn % 2 else ()) for turn, w in enumerate(EDITED)]
)
def test_what_was_edited_is_named_and_not_compiled(folder, what, nothing_compiled, capsys):
    name, change = EDITED[what]
    change(folder)
    for target in ("host", "all"):
        assert main(["verify", str(folder), "--target", target, "--json"]) == 1
        found = json.loads(capsys.readouterr().out)
        assert any(line.startswith(f"{name}: ") for line in found["differences"]), found["differences"]
        assert all("--edited" in entry["skipped"] for entry in found["targets"].values())
    with pytest.raises(InputError, match="has been edited: .*--edited"):
        focgen.cost(folder, "cortex-m3")


def test_an_edited_folder_is_compiled_where_that_is_asked_for(folder, capsys):
    appended("spba.c")(folder)
    assert main(["verify", str(folder), "--samples", "200", "--edited"]) == 1
    out = capsys.readouterr().out
    assert "samples equal in every bit" in out
    assert "NOT verified: what ran agrees, but it has been edited" in out
    assert "spba.c: is not what focgen writes" in out


NOTED = {
    "README.md: has been edited": appended("README.md"),
    "README.md: is missing": lambda folder: (folder / "README.md").unlink(),
    "example/main.c: has been edited": appended("example/main.c"),
    "example/main.c: is missing": lambda folder: shutil.rmtree(folder / "example"),
    "mine.txt: does not belong to the folder": lambda folder: (folder / "mine.txt").write_text("x"),
    "example/x.c: does not belong to the folder": lambda folder: (folder / "example" / "x.c").write_text("x"),
}


@pytest.mark.parametrize(
    "note", [pytest.param(n, marks=pytest.mark.long if turn % 2 else ()) for turn, n in enumerate(NOTED)]
)
def test_what_nothing_is_compiled_from_is_a_note(folder, note, capsys):
    NOTED[note](folder)
    assert main(["verify", str(folder), "--samples", "200"]) == 0
    assert f"note: {note}\n" in capsys.readouterr().out


def test_costs_that_are_remembered_belong_there(folder):
    (folder / "cost.json").write_text("{}")
    assert read_folder(folder).notes == ()


def test_many_strangers_are_counted(folder):
    for i in range(30):
        (folder / f"s{i:02}\n.txt").write_text("x")
    notes = read_folder(folder).notes
    assert len(notes) == 9 and notes[0] == "s00?.txt: does not belong to the folder"
    assert notes[-1] == "22 more files do not belong to the folder"


@pytest.mark.parametrize(
    "name",
    (
        "stdint.h",
        pytest.param("math.h", marks=pytest.mark.long),
        pytest.param("stddef.h", marks=pytest.mark.long),
        "foc_extra.h",
    ),
)
def test_a_header_laid_beside_takes_no_part(folder, name):
    """The compiler looks for <stdint.h> in the folder, too."""
    (folder / name).write_text("#error this is not the header\n")
    found = verify(folder, 200)
    assert found.holds and found.notes == (f"{name}: does not belong to the folder",)


def test_what_is_compiled_is_what_was_compared(folder):
    """The folder may change between the comparison and the compiler's look at it."""
    read = read_folder(folder)
    (folder / "spba.c").write_text("#error changed meanwhile\n")
    with sources(read) as place:
        assert place != folder
        assert {p.name for p in place.glob("*.[ch]")} == {p.name for p in folder.glob("*.[ch]")}
        assert "#error changed" not in (place / "spba.c").read_text()
    assert not place.exists()


# ------------------------------------------------------------------------------------------- the manifest


NAMES = ("{0}/outside", "../outside", "a/b", "", "int", "x;y", "spba\n", "..", "NULL")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("edited", (False, True))
def test_a_name_that_leads_elsewhere_is_refused(folder, tmp_path, name, edited, nothing_compiled, capsys):
    name = name.format(tmp_path)
    rewrite(folder, lambda manifest: manifest.update(name=name))
    before = sorted(tmp_path.rglob("*"))
    assert main(["verify", str(folder), *["--edited"] * edited]) == (2 if edited else 1)
    said = capsys.readouterr()
    assert "manifest.json: " in said.out + said.err and "the name " in said.out + said.err
    assert "--name" not in said.out + said.err
    with pytest.raises(InputError, match="the name "):
        focgen.cost(folder, "cortex-m3", edited=edited)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "change, told",
    [
        ({"arithmetic": "q7"}, "choose one of"),
        ({"memory": "long"}, "choose one of"),
        ({"length": 10**9}, "beyond"),
        ({"length": 0}, "beyond"),
        ({"length": True}, "lacks 'length'"),
        ({"length": 10**400}, "lacks 'length'|beyond"),
        ({"kernels": {"target": "-march=native"}}, "choose one of"),
        ({"kernels": {"target": "../x"}}, "choose one of"),
        ({"kernels": []}, "lacks 'kernels'"),
        ({"selftest": "yes"}, "lacks 'selftest'"),
        ({"memory": "exponential"}, "lacks 'tolerance'"),
        ({"memory": "exponential", "tolerance": 1e-30, "horizon": 1000}, "beyond"),
        ({"error_bound": {}}, "lacks 'error_bound'"),
        ({"generator": "focgen 0.0.9"}, "was written by focgen 0.0.9, and this is .*; use focgen 0.0.9"),
        ({"generator": "gcc 12"}, "lacks 'generator'"),
        ({"generator": None}, "lacks 'generator'"),
    ],
)
def test_an_option_that_is_none_is_refused(folder, change, told, nothing_compiled, capsys):
    rewrite(folder, lambda manifest: manifest.update(change))
    assert main(["verify", str(folder), "--edited"]) == 2
    err = capsys.readouterr().err
    assert re.search(told, err) and err.count("\n") == 1, err


@pytest.mark.parametrize(
    "file, old, new, told",
    [
        ("manifest.json", '"name": "spba"', '"name": "spbb"', "manifest.json: .*'spbb'"),
        ("manifest.json", '"length": 24', '"length": "x"', "manifest.json: .*'length'"),
        ("manifest.json", '"arithmetic": "q15"', '"arithmetic": "q7"', "manifest.json: .*'q7'"),
        ("controller.toml", "length = 24", "length = -60", r"controller.toml: .*\[length\] is -60"),
        ("controller.toml", "sample_time =", "sample =", "controller.toml: .*'sample_time'"),
    ],
)
def test_an_edit_that_nothing_can_be_rendered_from_is_named(
    folder, file, old, new, told, nothing_compiled, capsys
):
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1))
    assert main(["verify", str(folder), "--json"]) == 1
    (difference,) = json.loads(capsys.readouterr().out)["differences"]
    assert re.search(told, difference), difference
    assert main(["verify", str(folder), "--edited"]) == 2


def test_a_file_that_is_missing_is_no_edit(folder, capsys):
    (folder / "spba.h").unlink()
    assert main(["verify", str(folder)]) == 2
    assert "lacks spba.h" in capsys.readouterr().err


RAW = (b"[" * 3000, b'{"length": ' + b"9" * 5000 + b"}", b"\xff", b"NaN", b'{"a": 1e999}')


@pytest.mark.parametrize("raw", RAW)
def test_what_is_no_manifest_is_refused(folder, raw, capsys):
    (folder / "manifest.json").write_bytes(raw)
    assert main(["verify", str(folder)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_plan_of_any_name_writes_no_c(tmp_path):
    """The door that every generated file goes through."""
    for name in ("../x", "/abs", "My loop", "x;", "printf"):
        plan = build_plan(paper_controller(8), "q15", name=name)
        with pytest.raises(InputError, match="the name"):
            folder_files(plan, b"")


@pytest.mark.parametrize("name", ("../outside.c", "/tmp/outside.c", "a/../../outside.c"))
def test_files_are_written_within_their_folder(tmp_path, name):
    with pytest.raises(InputError, match="outside of it"):
        write_files(tmp_path / "folder", {"inside.c": "", name: ""})
    assert not list(tmp_path.iterdir())


def test_a_study_counts_a_controller_of_any_name():
    """What it is called is no name in C, and no path."""
    from focgen.studies.costs import costs as studied

    plans = [build_plan(paper_controller(8, name=name), "q15") for name in ("spba", "../My loop; x")]
    named = [studied(plan, None) for plan in plans]
    assert named[0].flash_bytes == named[1].flash_bytes > 0 and named[1].note is None
