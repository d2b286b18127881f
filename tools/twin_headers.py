"""Prints ``c_runtime/foc_ahead_q31.h`` from ``foc_ahead_q15.h``: the same sums in words of twice the width.

Edit the header of 16-bit words only, then run ``make headers``. Users get both as files, so that C stays
readable without a preprocessor's help.
"""

from __future__ import annotations

import re
from pathlib import Path

RUNTIME = Path(__file__).resolve().parent.parent / "c_runtime"
SOURCE, TWIN = RUNTIME / "foc_ahead_q15.h", RUNTIME / "foc_ahead_q31.h"

# In this order: what is 32 bits wide already moves on before 16 bits become 32.
WIDER = (
    (r"\bint32_t\b(?! [ad] = )", "int64_t"),  # weights in registers are of 32 bits in both
    (r"\bint16_t\b", "int32_t"),
    (r"\bfoc_shift32\b", "foc_shift64"),
    (r"\b16-bit\b", "32-bit"),
    (r"Q15", "Q31"),
    (r"q15", "q31"),
    (r"(s\d \+= )(?=[abcd] \*)", r"\1(int64_t)"),  # a product of two words needs the width of both
)


def twin(text: str) -> str:
    """The header of 32-bit words, from ``text``, that of 16-bit words."""
    for pattern, wider in WIDER:
        text = re.sub(pattern, wider, text)
    return text


if __name__ == "__main__":
    TWIN.write_text(twin(SOURCE.read_text(encoding="utf-8")), encoding="utf-8")
