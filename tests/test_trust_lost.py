"""Nothing is lost: edited files stay, results are whole or not there, and what a kill leaves goes."""

import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from focgen import output, scratch
from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.errors import InputError
from focgen.output import new_folder, replace_folder, write_file
from tests.controllers import seed_controller

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
CONTROLLER = str(EXAMPLES / "controller.toml")
killable = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system cannot kill so")


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


# -------------------------------------------------------------------------------------- edited files


@pytest.mark.parametrize(
    "name", ("spba.c", "spba.h", "foc_rt.h", "README.md", "example/main.c", "controller.toml")
)
def test_an_edited_file_is_named_and_stays(tmp_path, name, capsys):
    folder = tmp_path / "fw"
    generate(seed_controller(5), folder, "q15")
    (folder / name).write_bytes((folder / name).read_bytes() + b"\n/* mine */\n")
    before = content(folder)
    with pytest.raises(InputError, match=name):
        generate(seed_controller(6), folder, "q15", selftest=True)
    assert content(folder) == before
    generate(seed_controller(6), folder, "q15", force=True)
    assert b"/* mine */" not in (folder / name).read_bytes()


def test_the_command_has_the_option(tmp_path, capsys):
    asked = ["generate", CONTROLLER, "--out", str(tmp_path / "fw"), "--arithmetic", "q15", "--length"]
    assert main([*asked, "5"]) == 0 == main([*asked, "6"])
    (tmp_path / "fw" / "spba.c").write_text("mine")
    capsys.readouterr()
    assert main([*asked, "5"]) == 2
    said = capsys.readouterr().err
    assert "spba.c" in said and "--force" in said and said.count("\n") == 1
    assert main([*asked, "5", "--force"]) == 0


def test_an_edited_file_that_would_go_is_named_too(tmp_path):
    generate(seed_controller(5), tmp_path, "q15", selftest=True)
    (tmp_path / "spba_selftest.c").write_text("mine")
    with pytest.raises(InputError, match="spba_selftest.c"):
        generate(seed_controller(5), tmp_path, "q15")
    assert (tmp_path / "spba_selftest.c").read_text() == "mine"


def test_a_file_that_was_there_before_is_no_less_mine(tmp_path):
    (tmp_path / "README.md").write_text("my project")
    with pytest.raises(InputError, match="README.md would be replaced"):
        generate(seed_controller(5), tmp_path, "q15")
    assert content(tmp_path) == {"README.md": b"my project"}


# ---------------------------------------------------------------------------------- scratch and kills


def _writes_forever(place: str, ready) -> None:
    with new_folder(place) as scratch:
        (scratch / "half").write_text("half")
        ready.set()
        time.sleep(60)


@killable
def test_what_a_kill_leaves_goes_and_what_lives_stays(tmp_path):
    context = multiprocessing.get_context("fork")
    writers = []
    for _ in range(2):
        ready = context.Event()
        writers.append(context.Process(target=_writes_forever, args=(str(tmp_path), ready)))
        writers[-1].start()
        assert ready.wait(20)
    killed, alive = writers
    before = set(tmp_path.iterdir())
    assert len(before) == 2
    killed.kill()
    killed.join()
    (tmp_path / ".focgen-0123456789abcdef.part").write_text("left")
    (tmp_path / ".focgen-notes").write_text("mine")
    scratch._swept.clear()
    write_file(tmp_path / "result", "whole")
    left = {p.name for p in tmp_path.iterdir()}
    assert len(left) == 3 and {"result", ".focgen-notes"} < left
    alive.kill()
    alive.join()


def test_results_are_on_the_disk_before_they_take_their_place(tmp_path, monkeypatch):
    seen, real = [], (os.fsync, os.replace)
    monkeypatch.setattr(os, "fsync", lambda fd: (seen.append("sync"), real[0](fd))[1])
    monkeypatch.setattr(os, "replace", lambda a, b: (seen.append("place"), real[1](a, b))[1])
    write_file(tmp_path / "one", "1")
    assert seen == ["sync", "place", "sync"]
    seen.clear()
    output.write_files(tmp_path / "out", {"a": "1", "b/c": "2"})
    assert seen == ["sync", "sync", "place", "place", "sync", "sync"]


def test_a_folder_that_cannot_be_replaced_stays(tmp_path, monkeypatch):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "result").write_text("years")
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "result").write_text("new")

    def full(*arguments, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(shutil, "copytree", full)
    with pytest.raises(InputError, match="No space left"):
        replace_folder(tmp_path / "made", tmp_path / "old", tmp_path)
    assert content(tmp_path / "old") == {"result": b"years"}


def _generate_again(folder: str, length: int) -> None:
    generate(seed_controller(length), folder, "q15")


def kills(count: int, tmp_path: Path, seed: int, capsys) -> None:
    """Kill ``generate`` at random moments: its folder is the one before, the one after, or told apart."""
    rng, context = random.Random(seed), multiprocessing.get_context("fork")
    folder = tmp_path / "fw"
    wholes = []
    for length in (5, 6):
        begun = time.perf_counter()
        generate(seed_controller(length), tmp_path / str(length), "q15")
        lasted = time.perf_counter() - begun
        wholes.append(content(tmp_path / str(length)))
    shutil.copytree(tmp_path / "5", folder)
    died = 0
    for turn in range(count):
        process = context.Process(target=_generate_again, args=(str(folder), 5 + (turn + 1) % 2))
        process.start()
        process.join(rng.uniform(0.0, 1.3 * lasted))
        died += process.is_alive()
        process.kill()
        process.join()
        found = {name: text for name, text in content(folder).items() if not name.startswith(".focgen-")}
        if found not in wholes:
            torn = [name for name, text in found.items() if text not in [w.get(name) for w in wholes]]
            assert not torn and found.keys() == wholes[0].keys()
            capsys.readouterr()
            main(["verify", str(folder), "--samples", "10"])
            told = capsys.readouterr().out
            before = next(w for w in wholes if w["manifest.json"] == found["manifest.json"])
            assert all(f"{name}: " in told for name in found if found[name] != before[name]), "not named"
            generate(seed_controller(5 + (turn + 1) % 2), folder, "q15")  # once more, without force
    assert died > 0.3 * count
    scratch._swept.clear()
    generate(seed_controller(5), folder, "q15", force=True)
    assert content(folder) == wholes[0]


@killable
def test_killed_at_random_moments(tmp_path, capsys):
    kills(12, tmp_path, 1, capsys)


@killable
@pytest.mark.long
def test_killed_at_two_hundred_random_moments(tmp_path, capsys):
    kills(200, tmp_path, 2, capsys)


COMMANDS = {
    "rig.toml": ["init", str(EXAMPLES / "logs" / "steps.csv"), "--out", "rig.toml"],
    "fw/spba.c": ["generate", CONTROLLER, "--out", "fw", "--length", "50"],
    "c.toml": ["design", str(EXAMPLES / "rig.toml"), "--out", "c.toml", "--settling", "1.5"],
    "page.html": ["report", CONTROLLER, "--out", "page.html"],
}


@killable
@pytest.mark.long
@pytest.mark.parametrize("result", COMMANDS)
def test_commands_killed_at_random_moments(tmp_path, result):
    """A result of before is there, whole, whenever the command that would replace it dies."""
    rng, command = random.Random(result), [sys.executable, "-m", "focgen", *COMMANDS[result]]
    begun = time.monotonic()
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    lasted = time.monotonic() - begun
    before = content(tmp_path)
    for _ in range(50):
        process = subprocess.Popen(
            command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            process.wait(rng.uniform(0.5, 1.0) * lasted)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        found = content(tmp_path)
        assert {name: text for name, text in found.items() if ".focgen-" not in name} == before
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert content(tmp_path) == before
