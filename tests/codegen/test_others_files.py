"""Files of ``generate``'s own names that it has not written: somebody's, and left alone.

Red when a manifest, an archive or a link of somebody else's is lost without ``--force``, or when files are
left out of a folder without a word.
"""

import json
import zipfile

import pytest

import focgen
from focgen import output
from focgen.cli.main import main
from focgen.errors import InputError
from focgen.output import write_files
from tests.controllers import seed_controller


def generate(folder, **options):
    return focgen.generate(seed_controller(5), folder, "q15", name="one", **options)


def content(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


FOREIGN = {
    "of a web page": {"manifest.json": json.dumps({"name": "My web app", "icons": [1]})},
    "of a name that could be one": {"manifest.json": json.dumps({"name": "webapp"})},
    "no JSON": {"manifest.json": "mine"},
    "an archive": {"one.fmu": "mine"},
    "the digest of one": {"one.fmu.sha256": "mine"},
}


@pytest.mark.parametrize(
    "what", [pytest.param(w, marks=pytest.mark.long if turn % 2 else ()) for turn, w in enumerate(FOREIGN)]
)
def test_what_another_tool_has_written_stays(tmp_path, what):
    write_files(tmp_path, FOREIGN[what])
    before, package = content(tmp_path), "fmu" if "fmu" in next(iter(FOREIGN[what])) else "plain"
    with pytest.raises(InputError, match="not as generate wrote"):
        generate(tmp_path, for_=package)
    assert content(tmp_path) == before
    generate(tmp_path, for_=package, force=True)
    assert json.loads((tmp_path / "manifest.json").read_text())["name"] == "one"


def test_a_manifest_beside_is_of_a_controller_or_stays(tmp_path):
    generate(tmp_path)
    (tmp_path / "one.manifest.json").write_text('{"precious": 1}')
    with pytest.raises(InputError, match="one.manifest.json"):
        focgen.generate(seed_controller(6), tmp_path, "q31", name="two")
    assert "precious" in (tmp_path / "one.manifest.json").read_text()


@pytest.mark.parametrize(
    "again",
    [pytest.param("fmu", marks=pytest.mark.long), "plain"],
)
def test_an_archive_that_somebody_added_to_stays(tmp_path, again):
    """A binary of another system, for instance: built anew, or removed, it would be lost."""
    generate(tmp_path, for_="fmu")
    generate(tmp_path, for_="fmu")  # as it was built it is generate's own
    with zipfile.ZipFile(tmp_path / "one.fmu", "a") as archive:
        archive.writestr("binaries/x86_64-windows/one.dll", b"mine")
    before = content(tmp_path)
    with pytest.raises(InputError, match="one.fmu would be replaced"):
        generate(tmp_path, for_=again)
    assert content(tmp_path) == before


@pytest.mark.parametrize(
    "package, linked", [("plain", "example"), ("arduino", "src"), ("arduino", "examples")]
)
def test_a_folder_that_leads_elsewhere_is_told_of(tmp_path, package, linked, capsys):
    """Its files were left out: no example, or no C at all, at exit status 0."""
    (tmp_path / "fw").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "fw" / linked).symlink_to("../elsewhere")
    controller = tmp_path / "c.toml"
    from focgen.control.files import write_controller

    write_controller(seed_controller(5), controller)
    asked = [
        "generate",
        str(controller),
        "--out",
        str(tmp_path / "fw"),
        "--arithmetic",
        "q15",
        "--name",
        "one",
    ]
    assert main([*asked, "--for", package]) == 2
    said = capsys.readouterr().err
    assert f"fw/{linked}" in said and "leads out of" in said and said.count("\n") == 1
    assert content(tmp_path / "fw") == content(tmp_path / "elsewhere") == {}


def test_a_link_within_the_folder_is_followed(tmp_path):
    (tmp_path / "texts").mkdir()
    (tmp_path / "example").symlink_to("texts")
    generate(tmp_path)
    assert (tmp_path / "texts" / "main.c").is_file()


def test_what_goes_is_not_left_out_either(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "old").write_text("old")
    (tmp_path / "fw").mkdir()
    (tmp_path / "fw" / "sub").symlink_to("../elsewhere")
    with pytest.raises(InputError, match="leads out of"):
        output.write_files(tmp_path / "fw", {"a": "1"}, old=lambda: [tmp_path / "fw" / "sub" / "old"])
    assert content(tmp_path / "fw") == {} and (tmp_path / "elsewhere" / "old").exists()
