"""Faults that a verifier has to find, sown into the text of "all" in q15."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from focgen.plan.model import Plan
from tests.proofs import esbmc
from tests.proofs.verdict import Verdict


@dataclass(frozen=True)
class Fault:
    """``pattern`` in ``file`` becomes ``by``; ``esbmc`` is the check that has to object (None: Eva only)."""

    file: str
    pattern: str
    by: str
    esbmc: Callable[[Plan, Path], Verdict] | None


FAULTS = {
    "off-by-one tap": Fault("foc_rt.h", r"for \(; i < taps; i\+\+\)", "for (; i <= taps; i++)", esbmc.reads),
    "ring wraps with >": Fault("foc_rt.h", r"now \+ 1u < size", "now < size", lambda _, f: esbmc.ring(f)),
    "product too large": Fault("foc_rt.h", r"\(int32_t\)weights\[i\] \*", "4 * (int32_t)weights[i] *", None),
}


def sow(folder: Path, name: str) -> None:
    """Change the text, and make sure that it has changed."""
    fault = FAULTS[name]
    path = folder / fault.file
    text, places = re.subn(fault.pattern, fault.by, path.read_text())
    if not places:
        raise AssertionError(f"{name}: nothing to change")
    path.write_text(text)
