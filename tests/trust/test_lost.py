"""Nothing is lost: edited files stay, results are whole or not there, and what a kill leaves goes.

Red when an edited file is replaced unasked, or a kill leaves half a result.
"""

import json
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

from focgen import journal, output, scratch
from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.errors import InputError
from focgen.output import new_folder, replace_folder, write_file
from tests.controllers import seed_controller
from tests.trust import lost

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
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
    first, last = seen.index("place"), len(seen) - seen[::-1].index("place")
    assert seen[:first].count("sync") >= 2 + 2, "both files, and the plan in its folder"
    assert seen.count("place") == 2 and seen[last:].count("sync") >= 2


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


# ---------------------------------------------------------------------------- a folder, whole or not at all

BEFORE = {"a": b"1", "b/c": b"1", "manifest.json": b"1", "mine": b"1", "gone": b"1"}
AFTER = {"a": b"2", "b/c": b"2", "d": b"2", "manifest.json": b"2", "mine": b"1"}


class Died(BaseException):
    """As if the process had been killed."""


def _interrupted(monkeypatch, folder: Path, at: int) -> None:
    """A result is written over another one, and the process dies ahead of the step ``at`` of its moves."""
    for name, text in BEFORE.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(text)
    real, steps = {name: getattr(os, name) for name in ("rename", "replace", "unlink")}, []

    def dying(name):
        def step(*arguments, **options):
            steps.append(name)
            if len(steps) > at:
                raise Died
            return real[name](*arguments, **options)

        return step

    with monkeypatch.context() as patched:
        for name in real:
            patched.setattr(os, name, dying(name))
        patched.setattr(shutil, "rmtree", lambda *arguments, **options: None)
        new = {name: text for name, text in AFTER.items() if name != "mine"}
        with pytest.raises(Died):
            output.write_files(folder, new, old=lambda: [folder / "gone"])


def visible(folder: Path) -> dict[str, bytes]:
    return {name: text for name, text in content(folder).items() if not name.startswith(".focgen-")}


@killable
@pytest.mark.parametrize("at", range(6))
def test_what_a_kill_interrupts_the_next_run_finishes(tmp_path, monkeypatch, at):
    """Before the first step nothing is moved; from then on the new result counts."""
    _interrupted(monkeypatch, tmp_path, at)
    scratch._swept.clear()
    write_file(tmp_path / "other", "x")
    journal.finish(tmp_path)
    (tmp_path / "other").unlink()
    assert visible(tmp_path) == (AFTER if at else BEFORE)
    scratch.clear(tmp_path)
    journal.finish(tmp_path)
    scratch._swept.clear()
    scratch.clear(tmp_path)
    assert content(tmp_path) == (AFTER if at else BEFORE), "and nothing is left"


def _another_disk(monkeypatch) -> None:
    """The same files; only their disk is counted otherwise, as after a restart or another mount."""
    monkeypatch.setattr(journal, "_number", lambda folder: [-1, os.stat(folder).st_ino])


@killable
@pytest.mark.parametrize("kept", [1, 10**9], ids=["nanoseconds", "seconds"])
@pytest.mark.parametrize("at", range(1, 6))
def test_a_disk_that_comes_back_under_another_number_is_finished(tmp_path, monkeypatch, at, kept):
    """What a small disk keeps of the time are its seconds."""
    _interrupted(monkeypatch, tmp_path, at)
    _another_disk(monkeypatch)
    made = journal._made
    monkeypatch.setattr(journal, "_made", lambda folder: [made(folder)[0], made(folder)[1] // kept * kept])
    journal.finish(tmp_path)
    assert visible(tmp_path) == AFTER


@killable
@pytest.mark.parametrize("how", ["copied", "made anew", "no mark"])
def test_under_another_number_a_copy_moves_nothing(tmp_path, monkeypatch, how):
    """The mark's number could be guessed; when it was made could not."""
    _interrupted(monkeypatch, tmp_path, 1)
    (whole,) = tmp_path.glob(".focgen-*.whole")
    if how == "copied":
        shutil.copytree(whole, tmp_path / ".focgen-0123456789abcdef.whole")
        shutil.rmtree(whole)
    elif how == "made anew":
        (whole / "mark").touch()
    else:
        (whole / "mark").unlink()
        plan = json.loads((whole / "plan.json").read_text())
        (whole / "plan.json").write_text(json.dumps({**plan, "mark": []}))
    _another_disk(monkeypatch)
    before = visible(tmp_path)
    journal.finish(tmp_path)
    assert visible(tmp_path) == before


@killable
def test_what_was_edited_meanwhile_stays(tmp_path, monkeypatch):
    _interrupted(monkeypatch, tmp_path, 1)
    (tmp_path / "a").write_text("mine")
    journal.finish(tmp_path)
    assert visible(tmp_path) == {**AFTER, "a": b"mine"}


@killable
@pytest.mark.parametrize("how", ("from elsewhere", "leads out", "no plan", "of a link"))
def test_a_folder_from_a_stranger_moves_nothing(tmp_path, monkeypatch, how):
    """What looks like the rest of a killed run, and came with an archive, or was bent."""
    folder, outside = tmp_path / "shared", tmp_path / "outside"
    outside.mkdir()
    (outside / "precious").write_text("years")
    _interrupted(monkeypatch, folder, 1)
    (whole,) = folder.glob(".focgen-*.whole")
    plan = json.loads((whole / "plan.json").read_text())
    if how == "from elsewhere":
        copied = whole.with_name(".focgen-0123456789abcdef.whole")
        shutil.copytree(whole, copied)
        shutil.rmtree(whole)
    elif how == "leads out":
        plan["files"] = {"../outside/precious": journal._digest(outside / "precious")}
        (whole / "outside").mkdir()
        (whole / "outside" / "precious").write_text("stolen")
        (whole / "plan.json").write_text(json.dumps(plan))
    elif how == "no plan":
        (whole / "plan.json").write_text("[" * 3000)
    else:
        (folder / "out").symlink_to(outside)
        plan["files"] = {"out/precious": journal._digest(outside / "precious")}
        (whole / "files" / "out").mkdir()
        (whole / "files" / "out" / "precious").write_text("stolen")
        old = {"out/precious": plan["files"]["out/precious"]}
        (whole / "plan.json").write_text(json.dumps({**plan, "old": old}))
    before = dict(visible(folder))
    journal.finish(folder)
    assert visible(folder) == before and (outside / "precious").read_text() == "years"


@killable
def test_a_folder_that_takes_anothers_place_is_never_missing(tmp_path, monkeypatch):
    for at in range(3):
        root, made = tmp_path / str(at), tmp_path / f"made{at}"
        (root / "0001").mkdir(parents=True)
        (root / "0001" / "result").write_text("old")
        made.mkdir()
        (made / "result").write_text("new")
        real, steps = os.rename, []

        def dying(*arguments):
            steps.append(arguments)
            if len(steps) > at:
                raise Died
            real(*arguments)

        with monkeypatch.context() as patched:
            patched.setattr(os, "rename", dying)
            patched.setattr(shutil, "rmtree", lambda *arguments, **options: None)
            with pytest.raises(Died):
                replace_folder(made, root / "0001", root)
        journal.finish(root)
        assert (root / "0001" / "result").read_text() == ("new" if at else "old")


def _writes_all(folder: str, mark: str, count: int) -> None:
    for _ in range(20):
        output.write_files(folder, {f"file{i}": mark for i in range(count)})


@killable
def test_two_that_write_at_once_do_not_mix(tmp_path):
    context = multiprocessing.get_context("fork")
    writers = [context.Process(target=_writes_all, args=(str(tmp_path), mark, 12)) for mark in "ab"]
    for one in writers:
        one.start()
    for one in writers:
        one.join(60)
        assert one.exitcode == 0
    assert len(set(content(tmp_path).values())) == 1 and len(content(tmp_path)) == 12


def _generate_again(folder: str, length: int) -> None:
    generate(seed_controller(length), folder, "q15")


def kills(count: int, tmp_path: Path, seed: int, capsys) -> None:
    """Kill ``generate`` at random moments: its folder is the one before or the one after."""
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
        journal.finish(folder)
        found = {name: text for name, text in content(folder).items() if not name.startswith(".focgen-")}
        assert found in wholes
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


# ----------------------------------------------------------------------------------- the whole campaign


@killable
def test_no_end_of_generate_loses_a_result():
    """Killed, on a full disk, and two at a time: for the others `make trust-lost` takes minutes."""
    found, runs = lost.campaign(4, 2, 4, ("generate --selftest",))
    assert runs == 8 and not found, found


@killable
@pytest.mark.long
def test_a_torn_result_is_seen(monkeypatch, tmp_path):
    """Files that take their places one by one, by names of their own: what the campaign has to see."""

    def torn(scratch, target, names, old=()) -> None:
        for name in names:
            time.sleep(0.2)
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(scratch / "files" / name, target / name)

    monkeypatch.setattr(journal, "put", torn)
    found, _ = lost.campaign(6, 0, 4, ("generate --selftest",))
    assert any("neither result" in one.what for one in found)


@killable
@pytest.mark.long
def test_no_end_of_any_command_loses_a_result():
    found, _ = lost.campaign(200, 50, 5)
    assert not found, found
