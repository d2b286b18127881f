"""The loop: mutate, run, keep what takes a new branch, write down what goes wrong; it goes on where it
stopped.

Every group of targets runs in a process of its own, bounded in memory; where an input ends that process,
or does not return, its parent knows which one it was.
"""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import random
import resource
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from focgen.errors import FocgenError
from tests.fuzz.guidance import Guidance
from tests.fuzz.mutate import LARGEST, mutated
from tests.fuzz.targets import Target, one_line
from tests.waiting import waited

MEMORY = 4 << 30
"""Bytes of address space of the process that is fuzzed."""
_SPLICED = 0.1
_SAVED = 20.0  # s between two savings of the counts


class Hang(BaseException):
    """An input has taken longer than any may."""


@dataclass(frozen=True)
class Group:
    """Targets that share a process; ``prepare`` it, ``seconds`` of processor that an input may take."""

    name: str
    targets: Sequence[Target]
    prepare: Callable[[Guidance], None]
    seconds: float


@dataclass
class Count:
    """How many inputs were run, how many of them were taken, and how many branches they have shown."""

    inputs: int = 0
    taken: int = 0
    branches: int = 0


class Slot:
    """The input at hand, where the parent of the process sees it."""

    def __init__(self) -> None:
        self._map = mmap.mmap(-1, LARGEST * 2 + 64)

    def put(self, target: str, data: bytes) -> None:
        """Say what comes next."""
        head = f"{target} {len(data)}\n".encode()
        self._map[: len(head) + len(data)] = head + data

    def get(self) -> tuple[str, bytes]:
        """What came last."""
        head, _, rest = self._map[:].partition(b"\n")
        name, _, size = head.decode().partition(" ")
        return name, rest[: int(size or 0)]


class Campaign:
    """A group's fuzzing in this process. ``folder`` keeps corpus, findings and counts from run to run;
    None: nothing is kept."""

    def __init__(
        self,
        group: Group,
        folder: Path | None,
        seed: int,
        corpora: dict[str, list[bytes]],
        slot: Slot | None = None,
    ):
        self.group, self.folder, self.slot = group, folder, slot or Slot()
        self.guidance, self.rng = Guidance(), random.Random(seed)
        self.counts = {t.name: Count() for t in group.targets}
        self.corpora = {
            t.name: [*t.seeds(), *corpora.get(t.name, []), *self._kept("corpus", t.name)]
            for t in group.targets
        }
        self.found: list[tuple[str, bytes, str]] = []
        self._scratch = tempfile.TemporaryDirectory(prefix="focgen-fuzz-", dir=_fast())

    def run(self, seconds: float, inputs: float = float("inf")) -> None:
        """Go on for so long, or so many inputs: first what is known, then mutations."""
        until, saved, done = time.monotonic() + seconds, time.monotonic(), 0
        self.guidance.begin()
        signal.signal(signal.SIGPROF, _hang)
        try:
            for target in self.group.targets:
                for data in self.corpora[target.name]:
                    self._one(target, data)
            while time.monotonic() < until and done < inputs:
                target = self.rng.choices(self.group.targets, [t.share for t in self.group.targets])[0]
                self._mutation(target)
                done += 1
                if time.monotonic() > saved + _SAVED:
                    saved = time.monotonic()
                    self.save()
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            self.guidance.end()
            self._scratch.cleanup()
            self.save()

    def _mutation(self, target: Target) -> None:
        corpus = self.corpora[target.name]
        recent = self.rng.random() < 0.3
        base = (
            corpus[-1 - int(self.rng.expovariate(0.1)) % len(corpus)] if recent else self.rng.choice(corpus)
        )
        data = mutated(base, self.rng.choice(corpus), target.words, target.form, self.rng)
        if self._one(target, data):
            corpus.append(data)
            self._keep("corpus", target.name, data)

    def _one(self, target: Target, data: bytes) -> bool:
        """Run one input; whether it has shown a new branch."""
        count, place = self.counts[target.name], Path(self._scratch.name) / target.name
        place.mkdir(exist_ok=True)
        self.slot.put(target.name, data)
        with self.guidance.watched():
            try:
                signal.setitimer(signal.ITIMER_PROF, self.group.seconds)
                target.run(data, place)
                signal.setitimer(signal.ITIMER_PROF, 0)
                count.taken += 1
            except FocgenError as error:
                signal.setitimer(signal.ITIMER_PROF, 0)
                self._told(target, data, error)
            except (Exception, Hang) as fault:  # noqa: BLE001 - whatever it is, it is written down
                signal.setitimer(signal.ITIMER_PROF, 0)
                self.find(target.name, data, "".join(traceback.format_exception(fault)))
        count.inputs += 1
        count.branches += len(self.guidance.new)
        return bool(self.guidance.new)

    def _told(self, target: Target, data: bytes, error: FocgenError) -> None:
        try:
            one_line(error)
        except Exception as fault:  # noqa: BLE001 - as above
            self.find(target.name, data, "".join(traceback.format_exception(fault)))

    def find(self, name: str, data: bytes, trace: str) -> None:
        """Write down what went wrong; once for each place."""
        place = [line for line in trace.splitlines() if line.lstrip().startswith("File ")][-3:]
        kind = hashlib.sha256(
            "\n".join([name, *place, trace.strip().splitlines()[-1][:60]]).encode()
        ).hexdigest()[:12]
        self.found.append((name, data, trace))
        if self.folder is not None:
            seen = self.folder / "found" / f"{name}-{kind}"
            if not seen.with_suffix(".bin").exists():
                seen.parent.mkdir(parents=True, exist_ok=True)
                seen.with_suffix(".bin").write_bytes(data)
                seen.with_suffix(".txt").write_text(trace, "utf-8", "backslashreplace")

    def _kept(self, kind: str, name: str) -> list[bytes]:
        if self.folder is None or not (self.folder / kind / name).is_dir():
            return []
        return [path.read_bytes() for path in sorted((self.folder / kind / name).iterdir())]

    def _keep(self, kind: str, name: str, data: bytes) -> None:
        if self.folder is not None:
            place = self.folder / kind / name
            place.mkdir(parents=True, exist_ok=True)
            (place / hashlib.sha256(data).hexdigest()[:20]).write_bytes(data)

    def save(self) -> None:
        """Add the counts since the last time to those of the folder."""
        if self.folder is None:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / "counts.json"
        whole = json.loads(path.read_text()) if path.exists() else {}
        for name, count in self.counts.items():
            before = whole.setdefault(name, {"inputs": 0, "taken": 0, "branches": 0})
            before["inputs"] += count.inputs
            before["taken"] += count.taken
            before["branches"] = max(before["branches"], len(self.guidance.known))
            self.counts[name] = Count()
        path.with_suffix(".part").write_text(json.dumps(whole, indent=1))
        path.with_suffix(".part").replace(path)


def supervised(
    group: Group, folder: Path, seconds: float, corpora: dict[str, list[bytes]], say=print
) -> None:
    """Fuzz a group in processes of its own, one after the other where an input ends one."""
    until, slot = time.monotonic() + seconds, Slot()
    while (left := until - time.monotonic()) > 1.0:
        child = os.fork()
        if child == 0:
            _child(group, folder, left, corpora, slot)
        status = waited(child, left + 20.0 * group.seconds)
        if status == 0:
            return
        name, data = slot.get()
        what = "the process did not end" if status is None else f"the process ended with {status}"
        Campaign(group, folder, 0, {}).find(name, data, f"{what}\n")
        say(f"{group.name}: {what} by an input of {name}")


def _child(group: Group, folder: Path, seconds: float, corpora, slot: Slot) -> None:
    status = 1
    try:
        os.setpgid(0, 0)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        warnings.simplefilter("error", RuntimeWarning)  # numbers that are none, on their way
        campaign = Campaign(group, folder, random.SystemRandom().randrange(1 << 30), corpora, slot)
        group.prepare(campaign.guidance)
        campaign.run(seconds)
        status = 0
    except BaseException:  # noqa: BLE001 - the fuzzer's own fault
        traceback.print_exc()
    finally:
        os._exit(status)


def _hang(number, frame) -> None:
    raise Hang


def _fast() -> str | None:
    return "/dev/shm" if Path("/dev/shm").is_dir() and shutil.disk_usage("/dev/shm").free > MEMORY else None
