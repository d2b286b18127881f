"""What the fuzzer does for hours, for a moment: the corpus, and mutations from a fixed seed.

Red when a file of the corpus, or one made from it, brings a traceback or another exit status.
"""

import json
import os
import re
import signal
from pathlib import Path

import pytest

from focgen.cli.main import main
from focgen.errors import LogError
from tests.fuzz import commands, corpus, forked, guidance, mutate, seeds, targets
from tests.fuzz.campaign import Campaign, Group, supervised

INPUTS, READERS = 150, 25


def campaign(group: Group, folder: Path | None = None, known=None) -> Campaign:
    made = Campaign(group, folder, 5, corpus.known() if known is None else known)
    group.prepare(made.guidance)
    return made


def told(found) -> str:
    return "\n".join(f"{name}: {data[:200]!r}\n{trace}" for name, data, trace in found)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_nothing_that_is_read_is_a_traceback():
    """Every seed, the whole corpus, and mutations of both."""
    made = campaign(Group("inputs", targets.TARGETS, lambda guidance: None, 20.0))
    made.run(600.0, INPUTS)
    assert not made.found, told(made.found)
    counts = made.counts.values()
    assert sum(one.inputs for one in counts) > INPUTS + 100
    assert all(one.taken for one in counts), "of every kind, some are taken"


def test_no_damaged_log_ends_its_reader_unsaid(monkeypatch):
    for library in ("pyarrow", "nptdms", "h5py"):
        pytest.importorskip(library)
    from focgen.logs import subprocess_reader

    monkeypatch.setattr(subprocess_reader, "subprocess", subprocess_reader.subprocess)  # it goes again
    made = campaign(Group("readers", forked.TARGETS, forked.preloaded, 60.0), known={})
    made.run(600.0, READERS)
    assert not made.found, told(made.found)


@pytest.mark.long
def test_no_command_line_is_a_traceback():
    made = campaign(Group("commands", commands.TARGETS, lambda guidance: commands.loaded(), 120.0))
    made.run(3600.0, 200)
    assert not made.found, told(made.found)


def changed(raw: bytes, old: str, new: str) -> bytes:
    assert old.encode() in raw
    return raw.replace(old.encode(), new.encode(), 1)


def with_trace(change) -> bytes:
    whole = json.loads(seeds.diagnosis()["signals.json"])
    change(whole)
    return json.dumps(whole).encode()


def rig_with(old: str, new: str) -> bytes:
    return changed(seeds.rig()[0], old, new)


FOUND = {  # once a traceback, a hang or no line; the word that says what it is
    "a unit that is computed for ever": ("rig", lambda: rig_with('"kPa"', '"9**9**9"'), "no unit"),
    "and in superscripts": ("rig", lambda: rig_with('"kPa"', '"9⁹⁹⁹⁹⁹⁹⁹⁹"'), "no unit"),
    "and in words": (
        "rig",
        lambda: rig_with('"kPa"', '"9 squared squared squared squared squared"'),
        "no unit",
    ),
    "a column that is a list": ("rig", lambda: rig_with('column = "p"', "column = []"), "not text"),
    "a stage that lets nothing pass": ("rig", lambda: rig_with("[[10.0, 0.0]]", "[[-0.0, 0.0]]"), "is zero"),
    "a number too large for its square": ("rig", lambda: rig_with("0.345", "1e200"), "finite numbers"),
    "a zero in UTF-16": ("text", lambda: "t,u\n0,\0\n".encode("utf-16"), "is not text"),
    "a reading too large for its square": (
        "log",
        lambda: changed(seeds.text()[0], "\n0.1,2,", "\n0.1,1e200,"),
        "1e+200",
    ),
    "a clock without numbers": (
        "lvm",
        lambda: changed(seeds.lvm()[1], "Delta_X\t0.01", "Delta_X\t1e308"),
        "Delta_X",
    ),
    "a mean over nothing known": (
        "drawn",
        lambda: with_trace(lambda w: w["means"][0].update(over="it")),
        "signals.json",
    ),
    "an integer beyond every array": (
        "verified",
        lambda: changed(seeds.verified()[0], "1e-06", "1" + "0" * 25),
        "verif",
    ),
}


@pytest.mark.parametrize("what", FOUND)
def test_what_was_found_is_told_in_a_line(tmp_path, what):
    name, made, word = FOUND[what]
    (target,) = (one for one in targets.TARGETS if one.name == name)
    with pytest.raises(targets.FocgenError, match=re.escape(word)) as told:
        target.run(made(), tmp_path)
    targets.one_line(told.value)


def test_a_key_too_many_and_a_bound_of_zero_are_no_faults(tmp_path):
    (drawn,) = (one for one in targets.TARGETS if one.name == "drawn")
    drawn.run(with_trace(lambda whole: whole["means"][0].update(more=1)), tmp_path)
    (verified,) = (one for one in targets.TARGETS if one.name == "verified")
    verified.run(seeds.verified()[0].replace(b"1e-06", b"0.0"), tmp_path)


def test_a_message_is_one_line_whatever_it_tells_of(capsys):
    """Of a value without end its ends; of what would steer a terminal nothing."""
    assert main(["generate", "\x1b[31m\u202e" + "a" * 5000, "--out", "out"]) == 2
    said = capsys.readouterr().err
    assert said.isprintable() == (said.count("\n") == 0) and said.count("\n") == 1 and len(said) < 2000
    assert "\x1b" not in said and "\u202e" not in said and said.rstrip().isprintable()
    assert main(["", "--out", "x"]) == 2
    assert re.fullmatch("focgen: error: .+: .+; .+\n", capsys.readouterr().err)


# ------------------------------------------------------------------------------------ the fuzzer itself


def raising(fault):
    def run(data: bytes, place: Path) -> None:
        if b"9" in data:
            raise fault
        if data != b"1":
            raise LogError("log", "is none", "give one")

    return run


@pytest.mark.parametrize(
    "fault", (KeyError("x"), MemoryError(), RecursionError(), targets.Fault("NaN"), LogError("", "", ""))
)
def test_a_fault_is_found_and_kept(tmp_path, fault):
    target = targets.Target("made", raising(fault), lambda: [b"1"], 1.0, "", (b"9",))
    made = Campaign(Group("made", [target], lambda guidance: None, 5.0), tmp_path, 1, {})
    made.run(60.0, 60)
    assert made.found and made.counts["made"].taken >= 0
    (kept, *_), text = sorted((tmp_path / "found").glob("*.bin")), sorted((tmp_path / "found").glob("*.txt"))
    assert b"9" in kept.read_bytes() and text
    counts = json.loads((tmp_path / "counts.json").read_text())["made"]
    assert counts["inputs"] == 61


@pytest.mark.parametrize("end", ("never", "killed"))
def test_an_input_that_does_not_return_is_found(tmp_path, end):
    def run(data: bytes, place: Path) -> None:
        while data == b"1" and end == "never":
            pass
        if end == "killed":
            os.kill(os.getpid(), signal.SIGKILL)

    target = targets.Target("made", run, lambda: [b"1"], 1.0)
    group = Group("made", [target], lambda guidance: None, 0.2)
    said = []
    supervised(group, tmp_path, 1.5, {}, said.append)
    (found, *_) = (tmp_path / "found").glob("*.bin")
    assert found.read_bytes() == b"1"
    assert ("Hang" if end == "never" else "ended with") in found.with_suffix(".txt").read_text()


def test_what_takes_a_new_branch_is_led_by(tmp_path):
    """A rig's keys are met one after the other, by no word of theirs: branches lead to more than chance
    does."""
    from focgen.rig.files import read_rig

    looked = guidance.Guidance()
    looked.begin()
    try:
        seen = []
        for text in (b"", b"sample_time = 1\n", b"sample_time = 1\n[signals]\n", b"sample_time = 1\n"):
            with looked.watched(always=True):
                with pytest.raises(targets.FocgenError):
                    read_rig(seeds.path_of(tmp_path, "rig.toml", text))
            seen.append(len(looked.new))
    finally:
        looked.end()
    assert all(seen[:3]) and not seen[3]


def test_mutations_keep_to_what_they_are_told():
    import random

    rng = random.Random(2)
    for form, sound in (("toml", seeds.rig()[0]), ("json", seeds.verified()[0]), ("", seeds.text()[0])):
        made = [mutate.mutated(sound, sound, (b"word",), form, rng) for _ in range(300)]
        assert sum(one != sound for one in made) > 250 and max(map(len, made)) <= mutate.LARGEST
        assert len(set(made)) > 200


def test_no_command_line_leads_out_of_its_folder():
    for word in (
        "/etc/passwd",
        "--out=/etc/x",
        "../../x",
        "a/../../x",
        "~root/x",
        "--out=~/x",
        "\0/x",
        "//x",
        ",/x",
    ):
        tame = commands._tame(word)
        assert ".." not in tame and "\0" not in tame and not tame.startswith(("/", "~"))
        assert "=/" not in tame and "=~" not in tame and ",/" not in tame
