"""Logs → rig → controller → C: each says what it came from, and verify says what does not fit.

Red when a link of the chain is exchanged and nobody says so.
"""

import hashlib
import random
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from focgen import custody
from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.control.controller import Source
from focgen.control.files import controller_from, write_controller
from focgen.custody import sha256_within
from focgen.errors import FocgenError
from focgen.rig.files import read_rig, rig_text
from focgen.verification.folder import read_folder
from tests.fuzz import seeds

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Logs, rig, identified rig, a controller that names it, and its C."""
    place = tmp_path_factory.mktemp("chain")
    (place / "logs").mkdir()
    shutil.copy(EXAMPLES / "logs" / "steps.csv", place / "logs")
    shutil.copy(EXAMPLES / "rig.toml", place)
    new = place / "identified.toml"
    asked = ["identify", str(place / "logs" / "steps.csv"), "--rig", str(place / "rig.toml"), "--to", "10"]
    assert main([*asked, "--no-integer", "--out", str(new)]) == 0
    source = Source("identified.toml", digest(new))
    controller = replace(controller_from(EXAMPLES / "controller.toml"), designed_from=source)
    write_controller(controller, place / "controller.toml")
    asked = ["generate", str(place / "controller.toml"), "--out", str(place / "fw"), "--length", "5"]
    assert main(asked) == 0
    return place


@pytest.fixture
def chain(made, tmp_path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "chain"))


def test_a_rig_says_what_it_was_identified_from(made):
    told = tomllib.loads((made / "identified.toml").read_text())["identified_from"]
    assert told["files"] == [
        {"file": name, "sha256": digest(made / name)} for name in ("logs/steps.csv", "rig.toml")
    ]
    assert told["options"] == {"to": 10.0, "gain_degree": 1, "stages": ["actuator"], "delay": False}
    assert "identified_from" not in rig_text(read_rig(made / "identified.toml"))  # a refit has its own


def test_a_whole_chain_has_nothing_to_say(chain):
    assert read_folder(chain / "fw").notes == ()


@pytest.mark.parametrize(
    "name", ("logs/steps.csv", pytest.param("rig.toml", marks=pytest.mark.long), "identified.toml")
)
def test_any_link_that_does_not_fit_is_named(chain, name, capsys):
    (chain / name).write_bytes((chain / name).read_bytes() + b"\n")
    (note,) = read_folder(chain / "fw").notes
    assert note.startswith(f"{chain / name}: is not ")
    assert main(["verify", str(chain / "fw"), "--samples", "10"]) == 0  # the C is what its controller gives
    assert note in capsys.readouterr().out


@pytest.mark.parametrize("place", ("fw/q15", "fw/q31/../q15", "."))
def test_a_folder_among_several_is_followed_too(chain, place, monkeypatch):
    """Two below its controller, as the demo's are; or the one that one stands in."""
    (chain / "fw").rename(chain / "q15")
    (chain / "fw" / "q31").mkdir(parents=True)
    (chain / "q15").rename(chain / "fw" / "q15")
    monkeypatch.chdir(chain / "fw" / "q15" if place == "." else chain)
    assert read_folder(place).notes == ()
    for name in ("logs/steps.csv", "identified.toml"):
        (chain / name).write_bytes((chain / name).read_bytes() + b"\n")
        (note,) = read_folder(place).notes
        assert f"{name}: is not " in note


def test_a_rig_of_the_same_name_nearby_is_not_taken_for_it(chain):
    (chain / "fw" / "identified.toml").write_text("another")
    assert [note for note in read_folder(chain / "fw").notes if "is not the rig" in note] == []


def _many(chain, monkeypatch, count):
    """So many logs that the rig is said to be identified from, the last one another."""
    entry = f'{{ file = "logs/steps.csv", sha256 = "{digest(chain / "logs" / "steps.csv")}" }}'
    rig, own = chain / "identified.toml", chain / "fw" / "controller.toml"
    last = '{ file = "rig.toml", sha256 = "another" }'
    rig.write_text(
        (EXAMPLES / "rig.toml").read_text()
        + f"\n[identified_from]\nfiles = [{', '.join([*[entry] * (count - 1), last])}]\n"
    )
    before = tomllib.loads(own.read_text())["designed_from"]["sha256"]
    own.write_text(own.read_text().replace(before, digest(rig)))
    return [note for note in read_folder(chain / "fw").notes if not note.startswith("controller.toml")]


def test_many_logs_are_followed(chain, monkeypatch):
    (note,) = _many(chain, monkeypatch, 200)
    assert note.endswith("rig.toml: is not what identified.toml was identified from")


def test_what_is_too_much_to_look_at_is_said(chain, monkeypatch):
    monkeypatch.setattr(custody, "_MOST", 4)
    (note,) = _many(chain, monkeypatch, 5)
    assert note.endswith("names 5 files, of which only the first 4 were looked at")
    monkeypatch.setattr(custody, "_LARGEST", 10)
    notes = read_folder(chain / "fw").notes
    assert any("steps.csv: was not looked at" in note for note in notes)
    assert not any("is not what" in note for note in notes)


@pytest.mark.parametrize("name", ("logs/steps.csv", "rig.toml", "identified.toml"))
def test_what_is_not_there_is_passed_over(chain, name):
    (chain / name).unlink()
    assert read_folder(chain / "fw").notes == ()


@pytest.mark.parametrize(
    "told",
    (
        "files = 3",
        "files = [1]",
        'files = [{ file = "/etc/passwd", sha256 = "x" }]',
        'files = [{ file = "a\\u0000" }]',
    ),
)
def test_a_strangers_table_leads_nowhere(chain, told):
    rig, own = chain / "identified.toml", chain / "fw" / "controller.toml"
    rig.write_text((EXAMPLES / "rig.toml").read_text() + f"\n[identified_from]\n{told}\n")
    before = tomllib.loads(own.read_text())["designed_from"]["sha256"]
    own.write_text(own.read_text().replace(before, digest(rig)))
    assert not [note for note in read_folder(chain / "fw").notes if "identified from" in note]
    assert read_rig(rig).name == read_rig(EXAMPLES / "rig.toml").name


@pytest.mark.parametrize("name", ("huge.toml", "/proc/self/mem", "/proc/kcore"))
def test_a_strangers_table_leads_to_nothing_without_end(chain, name, monkeypatch):
    """A file whose bytes nobody may have, one of no end, and one of a terabyte that no disk holds."""
    reach = "../" * len(chain.parents) + name.lstrip("/") if name.startswith("/") else name
    if not (chain / "fw" / reach).exists() and name.startswith("/"):
        pytest.skip("the system has no such file")
    if name == "huge.toml":
        with (chain / name).open("wb") as file:
            file.truncate(1 << 40)
    asked = []
    monkeypatch.setattr(custody, "check_regular", lambda path, *more: asked.append(str(path)))
    own = chain / "fw" / "controller.toml"
    own.write_text(own.read_text().replace('"identified.toml"', f'"{reach}"'))
    told = [note for note in read_folder(chain / "fw").notes if "is not the rig" in note]
    asked = [path for path in asked if path.endswith(name)]
    assert len(told) == len(asked) <= 1  # who may not read a file is not told of it


def test_no_more_of_a_file_is_read_than_is_said_to_be_there(tmp_path):
    (tmp_path / "a").write_bytes(bytes(3 << 20))
    assert sha256_within(tmp_path / "a", 3 << 20) == digest(tmp_path / "a")
    assert sha256_within(tmp_path / "a", (3 << 20) - 1) is None
    assert sha256_within(tmp_path, 3 << 20) is None is sha256_within(tmp_path / "b", 9)


def test_a_file_of_a_terabyte_is_named_and_not_read(packed, rendered_once):
    folder, files = packed
    for name in files:
        with (folder / name).open("r+b") as file:
            file.truncate(1 << 40)
        assert name in told_of(folder), name
        (folder / name).write_bytes(files[name])


def test_a_controller_says_what_it_was_designed_from_and_how(chain):
    asked = ["design", str(chain / "rig.toml"), "--out", str(chain / "made.toml"), "--settling", "1.6"]
    assert main([*asked, "--setpoints", "0.006", "--length", "100"]) in (0, 1)
    told = tomllib.loads((chain / "made.toml").read_text())["designed_from"]
    assert (told["file"], told["sha256"]) == ("rig.toml", digest(chain / "rig.toml"))
    wishes = {"settling": 1.6, "setpoints": [0.006], "length": 100, "delay": 1, "arithmetic": "q31"}
    assert told["options"].items() >= wishes.items() and "overshoot" not in told["options"]
    read = controller_from(chain / "made.toml")
    write_controller(read, chain / "again.toml")
    assert (chain / "again.toml").read_bytes() == (chain / "made.toml").read_bytes()


# ------------------------------------------------------------------------------- any byte that is changed

FOLDERS = {"plain": {}, "arduino": {"for_": "arduino", "selftest": True}, "cmake": {"for_": "cmake"},
           "platformio": {"for_": "platformio"}, "fmu": {"for_": "fmu", "fmi": 2},
           "tunable": {"tunable": True, "arithmetic": "f32"}}  # fmt: skip
CHANGES = {  # of a file's bytes, at a place
    "a bit": lambda raw, at: raw[:at] + bytes([raw[at] ^ 1]) + raw[at + 1 :],
    "a high bit": lambda raw, at: raw[:at] + bytes([raw[at] ^ 128]) + raw[at + 1 :],
    "a byte less": lambda raw, at: raw[:at] + raw[at + 1 :],
    "a blank more": lambda raw, at: raw[:at] + b" " + raw[at:],
}


QUICK = ("plain", "fmu")  # of the packages, the one in which files lie within a file


@pytest.fixture(
    scope="module",
    params=[name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in FOLDERS],
)
def packed(request, tmp_path_factory) -> tuple[Path, dict[str, bytes]]:
    folder = tmp_path_factory.mktemp("packed") / "fw"
    made = controller_from({**tomllib.loads(seeds.controller()[1].decode()), "length": 5})
    generate(made, folder, **({"arithmetic": "q15"} | FOLDERS[request.param]))
    assert read_folder(folder).differences == ()
    names = [p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()]
    return folder, {name: (folder / name).read_bytes() for name in names}


@pytest.fixture
def rendered_once(monkeypatch) -> None:
    """What the same bytes are rendered to is remembered: that takes most of the time."""
    from focgen.verification import folder

    for name in ("build_plan", "folder_files"):
        known, real = {}, getattr(folder, name)

        def remembered(*arguments, known=known, real=real):
            key = repr(arguments)
            if key not in known:
                known[key] = real(*arguments)
            return known[key]

        monkeypatch.setattr(folder, name, remembered)


def told_of(folder: Path) -> str:
    """What verify says of a folder before it compiles anything, or why it does not read it."""
    try:
        read = read_folder(folder)
    except FocgenError as refused:
        return str(refused)
    return "\n".join((*read.differences, *read.notes))


def test_any_changed_byte_of_any_file_is_named(packed, rendered_once):
    """At the first place, the last, and one in between, in every way; and a file that is not there."""
    folder, files = packed
    rng = random.Random(3)
    for name, raw in files.items():
        for how, change in CHANGES.items():
            for at in {0, rng.randrange(len(raw)), len(raw) - 1}:
                (folder / name).write_bytes(change(raw, at))
                assert name in told_of(folder), (name, how, at)
        (folder / name).unlink()
        assert name in told_of(folder), name
        (folder / name).write_bytes(raw)
    assert told_of(folder) in ("", "lead.fmu: its binary was not compared, only the C that it is made from")


def test_any_added_file_is_named(packed, rendered_once):
    folder, _ = packed
    for name in (
        "extra.c",
        "stdint.h",
        ".hidden",
        "example/more.c",
        "Makefile",
        "lead.fmu",
        "manifest.json~",
    ):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("mine")
        assert Path(name).parts[0] in told_of(folder), name
        (folder / name).unlink()
    (folder / "sub").mkdir()
    (folder / "sub" / "deep.h").write_text("mine")
    assert "sub" in told_of(folder)
    shutil.rmtree(folder / "sub")


@pytest.mark.parametrize("name", ("lead.c", "lead.h", "README.md", "controller.toml", "manifest.json"))
def test_a_link_in_the_place_of_a_file_is_its_content(packed, name, tmp_path):
    folder, files = packed
    (tmp_path / "elsewhere").write_bytes(files[name] + b" ")
    (folder / name).unlink()
    (folder / name).symlink_to(tmp_path / "elsewhere")
    assert name in told_of(folder)
    (folder / name).unlink()
    (folder / name).write_bytes(files[name])
