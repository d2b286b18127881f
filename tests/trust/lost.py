"""``make trust-lost``: every command that writes, killed at random moments, on a full disk, and two at a
time.

Each has two forms, whose results differ. Wherever it ends, its folder then holds the one result or the
other, whole, and nothing else once the next run has come by; a command that fails says so in one line.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import focgen.cli.main as entry
from focgen import journal, scratch
from tests.fuzz import seeds
from tests.fuzz.commands import loaded

Content = dict[str, bytes]
COMMANDS = {  # {} is what the two forms have of their own
    "init": ("init log.csv {} --out out/rig.toml", "", "two.csv"),
    "identify": (
        "identify log.csv --rig linear.toml --no-integer {} --out out/rig.toml",
        "--from 0",
        "--to 0.5",
    ),
    "identify --report": (
        "identify log.csv --rig linear.toml --no-integer {} --out out/r.toml --report out",
        "--from 0",
        "--to 0.5",
    ),
    "simulate --report": (
        "simulate rig.toml c.toml --setpoints 0.01 --duration {} --report out/page.html",
        "0.3",
        "0.4",
    ),
    "generate": ("generate c.toml --out out --arithmetic {}", "q15", "q31"),
    "generate --selftest": ("generate c.toml --out out --length {}", "9 --selftest", "10 --for arduino"),
    "study": (
        (
            "study memory c.toml --out out --memory short --arithmetic q15 --sample-times 0.01 --jobs 1"
            " --lengths {}"
        ),
        "5",
        "6",
    ),
    "report": ("report {} --out out/page.html", "c.toml", "linear.toml"),
    "trial make": ("trial make out/t --cases 1 --suite short --kinds none --seed {}", "1", "2"),
}
_REPEATED = ("trial make",)  # refuses a folder that holds a trial: what stands is then never replaced
_UNLIKE = ("rows/",)  # answers that a study keeps: more of them are no other result


@dataclass(frozen=True)
class Lost:
    """What went wrong: the command, how it ended, and what its folder held then."""

    command: str
    how: str
    what: str


def argv_of(command: str, form: int) -> list[str]:
    """The words of a command in its first (0) or second form (1)."""
    text, *forms = COMMANDS[command]
    return text.format(forms[form]).split()


def inputs() -> Content:
    """The files that the commands read."""
    text = seeds.text(60)
    return {
        "log.csv": text[0],
        "two.csv": text[0],
        "rig.toml": seeds.rig()[0],
        "linear.toml": seeds.rig()[2],
        "c.toml": seeds.controller()[1],
    }


def visible(folder: Path) -> Content:
    """Name and content of what a command has written, without what it keeps for a later run."""
    files = (p for p in sorted(folder.rglob("*")) if p.is_file())
    named = {p.relative_to(folder).as_posix(): p for p in files}
    return {name: path.read_bytes() for name, path in named.items() if not name.startswith(_UNLIKE)}


def started(argv: Sequence[str], place: Path, largest: int | None = None) -> int:
    """The number of a forked process that runs a command in a folder; ``largest``: bytes that a file may
    have."""
    child = os.fork()
    if child:
        return child
    status = 9
    try:
        os.chdir(place)
        if largest is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
        said = io.StringIO()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            status = entry.main(list(argv))
        told = said.getvalue()
        if status == 2 and (told.count("focgen: error") != 1 or "fault of its own" in told):
            status = 8
    finally:
        os._exit(status)


def ended(child: int) -> int:
    """The status that a process ends with."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


class Place:
    """A folder with the inputs, and what each form of a command makes of them."""

    def __init__(self, command: str, folder: Path):
        self.command, self.folder, self.out = command, folder, folder / "out"
        self.wholes, self.lasted = [], 0.0
        for form in (0, 1):
            self._clear()
            begun = time.monotonic()
            if ended(started(argv_of(command, form), folder)) not in (0, 1):
                raise RuntimeError(f"{command} does not run")
            self.lasted = max(self.lasted, time.monotonic() - begun)
            self.wholes.append(visible(self.out))
        self.before = 1

    def _clear(self) -> None:
        import shutil

        shutil.rmtree(self.folder, ignore_errors=True)
        for name, content in inputs().items():
            seeds.path_of(self.folder, name, content)

    def next(self) -> int:
        """The form whose result is not the one that stands."""
        self.before = 1 - self.before
        return self.before

    def fault(self, status: int, done: bool | None = None) -> str:
        """What is wrong with what stands; empty where nothing is. ``done``: whether it is the new result."""
        for folder in (self.out, *(p for p in self.out.rglob("*") if p.is_dir() and "focgen-" not in p.name)):
            journal.finish(folder)
            scratch._swept.clear()
            scratch.clear(folder)
        found = visible(self.out)
        if status in (8, 9):
            return f"ended with {status}"
        if any(".focgen-" in name for name in found):
            return f"left {[name for name in found if '.focgen-' in name][:3]}"
        if found not in self.wholes:
            return f"holds {sorted(found)[:6]}, which is neither result"
        stands = self.wholes.index(found)
        if done is not None and self.wholes[0] != self.wholes[1] and (stands == self.before) != done:
            return "replaced a result and failed" if not done else "says that it is done, and is not"
        self.before = stands
        return ""


def killed(place: Place, rng: random.Random) -> str:
    """Kill a command at a random moment."""
    child = started(argv_of(place.command, place.next()), place.folder)
    time.sleep(rng.uniform(0.0, 1.05 * place.lasted))
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    return place.fault(ended(child))


def full(place: Place, rng: random.Random) -> str:
    """Run a command where no file can have more than a random number of bytes."""
    largest = int(10 ** rng.uniform(0.0, 4.5))
    status = ended(started(argv_of(place.command, place.next()), place.folder, largest))
    return place.fault(status, done=status in (0, 1))


def both(place: Place, rng: random.Random) -> str:
    """Run both forms at once."""
    children = [started(argv_of(place.command, form), place.folder) for form in (0, 1)]
    return place.fault(max(map(ended, children)))


HOW: dict[str, Callable[[Place, random.Random], str]] = {
    "killed": killed,
    "full disk": full,
    "two at once": both,
}


def campaign(
    kills: int, others: int, seed: int, commands: Sequence[str] = tuple(COMMANDS)
) -> tuple[list[Lost], int]:
    """What was lost in so many kills, and so many runs of each other kind; and how many there were."""
    rng, lost, runs = random.Random(seed), [], 0
    loaded()
    with tempfile.TemporaryDirectory(prefix="focgen-lost-") as folder:
        places = {name: Place(name, Path(folder) / str(i)) for i, name in enumerate(commands)}
        for how, count in (("killed", kills), ("full disk", others), ("two at once", others)):
            for turn in range(count):
                name = commands[turn % len(commands)]
                if name in _REPEATED and how != "killed":
                    continue
                fault, runs = HOW[how](places[name], rng), runs + 1
                if fault:
                    lost.append(Lost(name, how, fault))
                    places[name] = Place(name, Path(folder) / str(commands.index(name)))
    return lost, runs


def main() -> int:
    """Print what was lost; 1 where anything was."""
    parser = argparse.ArgumentParser(prog="python -m tests.trust.lost", description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--others", type=int, default=50, help="of a full disk, and of two at once")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    lost, runs = campaign(args.kills, args.others, args.seed)
    for one in lost:
        print(f"{one.command}, {one.how}: {one.what}")
    print(f"{runs} runs of {len(COMMANDS)} commands: {len(lost)} results lost or torn")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
