"""Faults that a verifier has to find, sown into the text of "all" and, with modes, "all_modes", in q15."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from focgen.plan.plan import Plan
from tests.proofs import esbmc
from tests.proofs.verdict import Verdict

Check = Callable[[Plan, Path], Iterable[Verdict]]


@dataclass(frozen=True)
class Fault:
    """``pattern`` in ``file`` of the folder of ``controller`` becomes ``by``; Eva has to object, and so has
    ESBMC in the check ``esbmc``.
    """

    file: str
    pattern: str
    by: str
    esbmc: Check
    controller: str = "all"


def _modes(file: str, pattern: str, by: str) -> Fault:
    return Fault(file, pattern, by, esbmc.means, "all_modes")


FAULTS = {
    "off-by-one tap": Fault(
        "foc_rt.h",
        r"for \(; count > 0u; count--\)",
        "for (count++; count > 0u; count--)",
        lambda *of: [esbmc.reads(*of)],
    ),
    "ring wraps with >": Fault(
        "foc_rt.h", r"now \+ 1u < size", "now < size", lambda _, folder: [esbmc.ring(folder)]
    ),
    "product too large": Fault(
        "foc_rt.h", r"\(int32_t\)(\*weights|weights\[\d\]) \*", r"4 * (int32_t)\1 *", esbmc.overflow
    ),
    "mode's shift off by one": _modes(
        "all_modes.c", r"(means, \d+, (?:past|change), 1)4(?=, 15\))", r"\g<1>5"
    ),
    "drive's shift off by one": _modes(
        "foc_memory.h", r"\(now - means\[i\], to_drive\)", "(now - means[i], (uint8_t)(to_drive - 1))"
    ),
    "mode's product too large": _modes(
        "foc_memory.h", r"\(int32_t\)modes\[i\]\.rate \*", "4 * (int32_t)modes[i].rate *"
    ),
    "off-by-one mode": _modes("foc_memory.h", r"i < count; i\+\+", "i <= count; i++"),
}


def sow(folder: Path, name: str) -> None:
    """Change the text, and make sure that it has changed."""
    fault = FAULTS[name]
    path = folder / fault.file
    text, places = re.subn(fault.pattern, fault.by, path.read_text())
    if not places:
        raise AssertionError(f"{name}: nothing to change")
    path.write_text(text)
