"""Two controllers in one folder: each is generated again without force and takes nothing of the other.

Red when one controller replaces or removes a file of the other.
"""

import hashlib
import json

import pytest

from focgen.codegen.generate import generate
from focgen.errors import InputError
from focgen.verification.folder import read_folder
from tests.controllers import seed_controller
from tests.every_form import EXAMPLE


def pair(folder, **options):
    generate(seed_controller(5), folder, "q15", name="one", **options)
    generate(seed_controller(6), folder, "q31", name="two")


def content(folder) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_each_can_be_generated_again_without_force(tmp_path):
    pair(tmp_path)
    first = content(tmp_path)
    assert {"one.c", "two.c", "one.manifest.json", "one.controller.toml"} < first.keys()
    generate(seed_controller(7), tmp_path, "q15", name="one")  # changed since
    generate(seed_controller(5), tmp_path, "q15", name="one")
    assert "two.manifest.json" in content(tmp_path) and "one.manifest.json" not in content(tmp_path)
    generate(seed_controller(6), tmp_path, "q31", name="two")
    assert content(tmp_path) == first


def test_what_a_controller_keeps_generates_it_again(tmp_path):
    pair(tmp_path)
    before = (tmp_path / "one.c").read_bytes()
    again = generate(tmp_path / "one.controller.toml", tmp_path / "alone", "q15", name="one")
    assert (tmp_path / "alone" / "one.c").read_bytes() == before
    assert json.loads((tmp_path / "one.manifest.json").read_text())["files"] == again.manifest["files"]


def test_verify_tells_of_the_one_and_names_the_other(tmp_path):
    pair(tmp_path)
    read = read_folder(tmp_path)
    assert read.plan.name == "two" and read.differences == ()
    (note,) = read.notes
    assert note.startswith("one: stands here as well")
    (tmp_path / "stranger.c").write_text("mine")
    assert any("stranger.c" in note for note in read_folder(tmp_path).notes)


def test_a_strangers_manifest_hides_no_file(tmp_path):
    """Whatever it lists: what generate does not write is named, a header of the runtime that is another, too;
    the other's own files are named with it."""
    pair(tmp_path)
    path = tmp_path / "one.manifest.json"
    manifest = json.loads(path.read_text())
    for name in ("math.h", "Makefile", "foc_m4_f32.h", "foc_own.h", "example/math.h"):
        (tmp_path / name).write_text("mine")
        manifest["files"][name] = hashlib.sha256(b"mine").hexdigest()
    path.write_text(json.dumps(manifest))
    neighbour, *strangers = read_folder(tmp_path).notes
    assert "(one.c, one.controller.toml, one.h, one.manifest.json)" in neighbour
    named = {note.partition(":")[0] for note in strangers}
    assert named == {"math.h", "Makefile", "foc_m4_f32.h", "foc_own.h", "example/math.h"}


def test_what_the_other_needs_stays(tmp_path):
    """A self-test goes with the controller that had it; a header of the runtime stays while one has it."""
    pair(tmp_path, selftest=True)
    shared = {name for name in content(tmp_path) if name.startswith("foc_")}
    generate(seed_controller(5), tmp_path, "f32", name="one")
    left = content(tmp_path)
    assert "one_selftest.c" not in left and shared <= left.keys() and "two.c" in left


@pytest.mark.parametrize("name", ("one.c", "one.controller.toml", "two.c"))
def test_what_was_edited_of_either_stays(tmp_path, name):
    pair(tmp_path)
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=name):
        generate(seed_controller(7), tmp_path, "q15", name=name.partition(".")[0])
    assert (tmp_path / name).read_text() == "mine"


def test_names_that_differ_in_capitals_only_are_refused(tmp_path):
    """VALVE_U_MAX would stand for the limits of either, and of two files one on some file systems."""
    generate(seed_controller(5), tmp_path, "q15", name="valve")
    generate(seed_controller(5), tmp_path, "q15", name="two")
    before = content(tmp_path)
    for name in ("Valve", "TWO"):
        with pytest.raises(InputError, match="shares its macros"):
            generate(seed_controller(6), tmp_path, "q31", name=name, force=True)
    assert content(tmp_path) == before
    generate(seed_controller(6), tmp_path / "apart", "q31", name="Valve")


def test_from_one_package_to_another_and_back_nothing_is_edited(tmp_path):
    """With other options each time: the example of before was left where the package has none."""
    for k, package in enumerate(("cmake", "arduino", "plain", "arduino", "platformio", "plain")):
        generate(seed_controller(5), tmp_path, "q15", name="one", length=8 + k, for_=package)
        read = read_folder(tmp_path)
        assert read.differences == read.notes == (), package
    assert {path.name for path in tmp_path.iterdir() if path.is_dir()} == {"example"}


@pytest.mark.parametrize("package", ["arduino", "cmake"])
def test_what_a_package_of_the_other_has_belongs_to_it(tmp_path, package):
    pair(tmp_path, for_=package)
    folder = "examples" if package == "arduino" else "example"
    (note,) = read_folder(tmp_path).notes
    assert note.startswith("one: stands here as well")
    (tmp_path / folder / "stranger.c").write_text("mine")
    assert f"{folder}/stranger.c: does not belong to the folder" in read_folder(tmp_path).notes


def test_the_archive_of_the_other_belongs_to_it(tmp_path):
    pair(tmp_path, for_="fmu")
    assert (tmp_path / "one.fmu").is_file() and len(read_folder(tmp_path).notes) == 1


def test_a_controller_without_a_name_is_unedited(tmp_path):
    """Its file is called otherwise in the folder, and the C was another's there."""
    text = EXAMPLE.with_name("controller.toml").read_text(encoding="utf-8")
    (tmp_path / "valve.toml").write_text(text.replace('name = "spba"\n', ""), encoding="utf-8")
    generate(tmp_path / "valve.toml", tmp_path / "firmware")
    assert not read_folder(tmp_path / "firmware").differences
