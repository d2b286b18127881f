"""``verify``: generated C against the Python reference, sample for sample, and its errors against bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from focgen.arguments import checked
from focgen.codegen.kernels import TARGETS as CORES
from focgen.errors import FocgenError, InputError
from focgen.shown import Shown
from focgen.targets.selection import selected
from focgen.verification.beyond import arithmetic_of, edited_beyond
from focgen.verification.compare import TargetResult, compare, observed, self_tested
from focgen.verification.folder import GeneratedFolder, read_folder, sources
from focgen.verification.host import Library
from focgen.verification.on_target import on_avr, on_core

__all__ = ["TARGETS", "TargetResult", "Verification", "compare", "verify"]

TARGETS = ("host", *CORES)
_SAMPLES = 10_000  # on the host
MOST_SAMPLES = 10_000_000
"""Of mixed inputs in one run, which take some 4 GB."""
_LEFT_BEYOND = "the folder has been edited, so nothing of it was compiled (run focgen generate again)"
_LEFT = "the folder has been edited, so nothing of it was compiled (--edited does)"


@dataclass(frozen=True, repr=False)
class Verification(Shown):
    """``targets`` by name; ``differences`` between the folder and what its controller.toml gives; ``notes``
    on files that nothing is compiled from. ``agrees``: what ran does; ``holds``: it does, and nothing was
    edited.

    ``files`` is the SHA-256 of what was compared, by name.
    """

    name: str
    arithmetic: str
    targets: dict[str, TargetResult]
    differences: tuple[str, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def agrees(self) -> bool:
        """Whether everything that ran agrees and stays within its bounds, and something ran."""
        ran = [t for t in self.targets.values() if t.skipped is None]
        return bool(ran) and all(t.sound for t in ran)

    @property
    def holds(self) -> bool:
        """Whether everything agrees, and it is what was generated."""
        return self.agrees and not self.differences


@checked
def verify(
    folder: str | Path,
    samples: int | None = None,
    seed: int = 0,
    target: str | Sequence[str] = "host",
    edited: bool = False,
) -> Verification:
    """Compile the C of a generated folder and compare it with the bit-true reference.

    First the folder is rendered anew from what it holds. Where C, headers, manifest or controller.toml have
    other bytes, they are ``differences``, and nothing is compiled unless ``edited`` asks for it.
    ``samples`` of mixed inputs, from ``seed``, besides the worst case of every node; by default 10,000 on
    this computer, and in an emulator as many as take seconds. ``target``: a name of ``TARGETS``, several, or
    "all".
    The C runs in a process of its own; where it crashes or does not return, that is a mismatch. That is no
    sandbox: an edited folder is code, and runs with the caller's rights.

    Raises InputError for a folder that is none or was made by another version of focgen, or, with ``edited``,
    was edited into what no plan can be made of. BuildError where the C does not compile.
    """
    if samples is not None and (not isinstance(samples, int) or samples < 1):
        raise InputError("--samples", f"is {samples!r}", "give at least 1")
    if samples is not None and samples > MOST_SAMPLES:
        what = f"is {samples:.3g}, of which {MOST_SAMPLES:.0e} fit in a run"
        raise InputError("--samples", what, "verify several times, each with a --seed of its own")
    if seed < 0:
        raise InputError("--seed", f"is {seed}", "give 0 or more")
    names = selected(target, TARGETS)
    try:
        read = read_folder(folder)
    except FocgenError as fault:
        named = None if edited else edited_beyond(Path(folder), fault)
        if named is None:
            raise
        results = dict.fromkeys(names, TargetResult(skipped=_LEFT_BEYOND))
        return Verification(Path(folder).resolve().name, arithmetic_of(Path(folder)), results, (named,))
    if read.differences and not edited:
        results = dict.fromkeys(names, TargetResult(skipped=_LEFT))
    else:
        with sources(read) as place:
            results = {name: _on(name, replace(read, path=place), samples, seed) for name in names}
    told = read.differences, read.notes, read.digests
    return Verification(read.plan.name, read.plan.arithmetic, results, *told)


def _on(name: str, read: GeneratedFolder, samples: int | None, seed: int) -> TargetResult:
    if name == "avr":
        return on_avr(read, samples, seed)
    if name != "host":
        return on_core(name, read, samples, seed)
    library = Library([read.plan], [read.path], selftest=read.selftest)
    result = observed(read.plan, library, samples or _SAMPLES, seed, read)
    return self_tested(result, read.plan, library) if read.selftest else result
