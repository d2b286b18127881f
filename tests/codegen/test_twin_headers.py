"""The header of 32-bit sums is printed from that of 16-bit ones.

Red when one of the two was edited by hand.
"""

import runpy

from tests.pages import ROOT


def test_the_header_of_32_bits_is_the_twin_of_that_of_16():
    tool = runpy.run_path(str(ROOT / "tools" / "twin_headers.py"))
    assert tool["twin"](tool["SOURCE"].read_text()) == tool["TWIN"].read_text()
    assert tool["twin"]("s0 += d * x[0]; int16_t q15") == "s0 += (int64_t)d * x[0]; int32_t q31"
