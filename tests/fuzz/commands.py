"""Whole commands in a folder of small files: an input is a command line, and the content of one of the
files.

The first line of an input says ``FILE WORD WORD …``; the rest is what FILE holds. A mutation may touch
either.
"""

from __future__ import annotations

import contextlib
import functools
import io
import json
import math
import os
import re
import shutil
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import focgen
import focgen.cli.diagnose as diagnosing
import focgen.cli.main as entry
from focgen import demonstration
from focgen.cli import faults
from focgen.errors import InputError
from tests.fuzz import seeds
from tests.fuzz.targets import Target, check

_LINE = re.compile(r"focgen: error: .+?: .+; .+\n")
_NEVER = ("--e", "--sc", "--targ", "--jobs", "--minutes", "--boot")
"""What asks for foreign C, other machines, every emulator, many processes, or hours."""
_SMALL = {
    "study": "--memory short --arithmetic q15 --sample-times 0.01 --lengths 5 --jobs 1".split(),
    "cost": "--target cortex-m0plus".split(),
}
"""Ahead of what a line says: by themselves these commands take minutes."""
_LOOKED_FOR = ("sensor_lag",)
"""The effects that a diagnosis looks for: for all of them it takes minutes."""
_LOGS = ("log.csv", "two.csv")
_BARE_NUMBER = re.compile(r"(?<![\w./'\"-])[-+]?(nan|inf)(?![\w./'\"-])", re.IGNORECASE)


@cache
def home(scratch: Path) -> dict[str, bytes]:
    """Every file that a command finds, made once."""
    text = seeds.text(60)
    files = {
        "log.csv": text[0],
        "two.csv": text[3],
        "rig.toml": seeds.rig()[0],
        "linear.toml": seeds.rig()[2],
        "c.toml": seeds.controller()[1],
        "e.toml": seeds.controller()[0],
        "verified.json": seeds.verified()[0],
    }
    files |= {f"fw/{name}": content for name, content in seeds.firmware().items()}
    files |= {f"gap/{name}": content for name, content in seeds.diagnosis().items()}
    files |= _trial(scratch) | _study(scratch)
    return files


def _trial(scratch: Path) -> dict[str, bytes]:
    folder = scratch / "trial"
    focgen.trial("make", folder, cases=1, seed=7, suite="short", kinds=("none",))
    return {
        f"trial/{p.relative_to(folder).as_posix()}": p.read_bytes() for p in folder.rglob("*") if p.is_file()
    }


def _study(scratch: Path) -> dict[str, bytes]:
    seeds.path_of(scratch, "c.toml", seeds.controller()[1])
    focgen.study(
        "memory",
        scratch / "c.toml",
        scratch / "study",
        lengths=[5],
        memory=["short"],
        arithmetic=["q15"],
        sample_times=[0.01],
        jobs=1,
    )
    found = [p for p in (scratch / "study").iterdir() if p.suffix == ".json"]
    return {f"study/{p.name}": p.read_bytes() for p in found}


_LINES = """
log.csv init log.csv --out out.toml
two.csv init two.csv log.csv --json
log.csv identify log.csv --rig linear.toml --out out.toml --no-integer
rig.toml identify log.csv --rig rig.toml --out out.toml --no-integer --from 0 --to 0.3 --json
linear.toml replay linear.toml log.csv --json
log.csv replay rig.toml log.csv
rig.toml design rig.toml --out out.toml --settling 1.5 --arithmetic f64
c.toml simulate rig.toml c.toml --setpoints 0.01 --duration 0.5 --json
rig.toml simulate rig.toml c.toml --setpoints 0.01 --duration 0.5
c.toml generate c.toml --out out --arithmetic q31 --length 12
e.toml generate e.toml --out out --arithmetic f32 --tunable --selftest --name pump --for cmake
c.toml generate c.toml --out fw --arithmetic q15 --force --json
c.toml generate c.toml --out out --for platformio --no-float
c.toml generate c.toml --out out --for arduino --memory exponential --tolerance 1e-3 --horizon 1000
fw/manifest.json verify fw --samples 10
fw/controller.toml verify fw --json
fw/lead.c verify fw
fw/manifest.json generate c.toml --out fw --arithmetic q15
gap/diagnosis.json report gap --out out.html
gap/signals.json report gap --out out.html
study/study.json report study --out out.html
study/curves.json report study --out out.html
verified.json report verified.json --out out.html
fw/manifest.json report fw c.toml --out out.html
rig.toml report rig.toml --out out.html
log.csv report rig.toml log.csv --out out.html
log.csv diagnose linear.toml log.csv --out out --json
rig.toml diagnose rig.toml log.csv two.csv --out gap
gap/diagnosis.json diagnose rig.toml log.csv --out gap
linear.toml diagnose linear.toml two.csv --plan
c.toml study memory c.toml --out study --json
e.toml study memory e.toml --out out --lengths 5 6
study/study.json study memory c.toml --out study
fw/manifest.json cost fw --json
fw/lead.c cost fw --against fw
- demo --out out
trial/trial.json trial score trial --partial --no-baseline --json
trial/sealed/0001/label.json trial score trial --no-baseline
- --help
- --print-completion zsh
- generate --help
""".strip().splitlines()


def seed_inputs() -> list[bytes]:
    """Each command line with the content of its file."""
    files = home(_scratch())
    return [f"{line}\n".encode() + files.get(line.split()[0], b"") for line in _LINES]


@cache
def _scratch() -> Path:
    import atexit
    import tempfile

    made = tempfile.TemporaryDirectory(prefix="focgen-fuzz-")
    atexit.register(made.cleanup)
    return Path(made.name)


def run(data: bytes, place: Path) -> None:
    """Run the command of an input. Raises Fault where it ends in anything but a result or one line."""
    line, _, content = data.partition(b"\n")
    words = line.decode("utf-8", "replace").split(" ")
    file, argv = words[0], [word for word in map(_tame, words[1:]) if not word.startswith(_NEVER)]
    argv = argv[:1] + _SMALL.get(argv[0] if argv else "", []) + argv[1:]
    if argv[:1] == ["trial"] and "score" not in argv:
        argv = argv[:1]
    with _in(place, file, content):
        status, out, error, said = _called(argv)
        _judge(argv, status, out, error, said, data)
        _check_files(place)


def _tame(word: str) -> str:
    """A word that leads out of the folder leads into it: this runs with the rights of who fuzzes."""
    word = word.replace("\0", "")
    while ".." in word:
        word = word.replace("..", ".")
    return re.sub(r"(^|=|,|:)[/~\\]+", r"\1", word)


@contextlib.contextmanager
def _in(place: Path, file: str, content: bytes) -> Iterator[None]:
    """The folder with all files, one of them as the input has it; put in order where a command has changed
    it."""
    files, before = home(_scratch()), Path.cwd()
    if _state(place) != _known.get(place):
        for entry_ in place.iterdir():
            shutil.rmtree(entry_) if entry_.is_dir() and not entry_.is_symlink() else entry_.unlink()
        for name, whole in files.items():
            seeds.path_of(place, name, whole)
        _known[place] = _state(place)
    os.chdir(place)
    try:
        if file in files:
            Path(file).write_bytes(content)
        yield
    finally:
        os.chdir(before)
        if file in files:
            (place / file).write_bytes(files[file])
            os.utime(place / file, ns=(1, 1))


_known: dict[Path, dict] = {}


def _state(place: Path) -> dict:
    """Name and size of all that is there."""
    found = {}
    for folder, _, names in os.walk(place):
        for name in names:
            found[os.path.join(folder, name)] = os.lstat(os.path.join(folder, name)).st_size
    return found


class _Said(list):
    """Faults that nobody foresaw, instead of files that tell of them."""


def _called(argv: list[str]) -> tuple[int, str, str, _Said]:
    """Status, stdout and stderr of a command; and what it was that nobody foresaw."""
    said, out, error = _Said(), io.StringIO(), io.StringIO()
    real = faults._unforeseen, faults._foreseen, entry.to_json, demonstration._chain, diagnosing.diagnose

    def unforeseen(fault, words):
        said.append(fault)
        return "unforeseen"

    def foreseen(fault, command):
        if isinstance(fault, (MemoryError, RecursionError)):
            said.append(fault)
        return real[1](fault, command)

    def chain(folder):
        """Of the demo all but its chain, each command of which has lines of its own."""
        (folder / "begun").write_text("half")
        raise InputError("demo", "ends here", "run it by itself")

    faults._unforeseen, faults._foreseen = unforeseen, foreseen
    demonstration._chain = chain
    diagnosing.diagnose = functools.partial(real[4], only=_LOOKED_FOR)
    entry.to_json = lambda value: real[2](value)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = entry.main(argv)
    except SystemExit as end:  # --help
        status = end.code or 0
    finally:
        faults._unforeseen, faults._foreseen, entry.to_json, demonstration._chain = real[:4]
        diagnosing.diagnose = real[4]
    return status, out.getvalue(), error.getvalue(), said


def _judge(argv, status: int, out: str, error: str, said: _Said, data: bytes) -> None:
    if said:
        raise said[0]
    check(status in (0, 1, 2), f"exit status {status}")
    if status == 2:
        check(_LINE.fullmatch(error[error.rfind("focgen: error") :]) is not None, f"stderr {error!r}")
        check(out == "", f"stdout {out[:100]!r} beside an error")
        return
    if "--json" in argv:
        json.loads(out, parse_constant=lambda word: check(False, f"{word} in the JSON"))
    elif not _BARE_NUMBER.search(data.decode("utf-8", "replace")):
        found = _BARE_NUMBER.search(out)
        check(
            found is None,
            f"{found and out[max(0, found.start() - 40) : found.end() + 20]!r} at exit {status}",
        )


def _check_files(place: Path) -> None:
    """What was written is whole, and no scratch is left."""
    for _, folders, names in os.walk(place):
        for name in (*folders, *names):
            check(not name.startswith(".focgen-"), f"{name} is left")
    for path in filter(Path.is_file, place.glob("out*.toml")):
        import tomllib

        content = tomllib.loads(path.read_text("utf-8"))
        check(all(map(math.isfinite, _floats(content))), f"{path.name} holds a number that is none")


def _floats(content) -> Iterator[float]:
    if isinstance(content, dict):
        for one in content.values():
            yield from _floats(one)
    elif isinstance(content, list):
        for one in content:
            yield from _floats(one)
    elif isinstance(content, float):
        yield content


_WORDS = (
    b" --json| --out out| --report out.html| --length 5| --name x| --memory exponential| fw| rig.toml|c.toml"
).split(b"|")
TARGETS = (Target("command", run, seed_inputs, 1.0, "", tuple(_WORDS)),)


def loaded() -> None:
    """Load what every command loads, ahead of the first."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        for name in entry.commands():
            with contextlib.suppress(SystemExit):
                entry.main([name, "--help"])
    sys.stdout.flush()
