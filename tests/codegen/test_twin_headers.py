"""What is the same but for a type in the runtime comes from one source.

Red when one of a pair was edited by hand, or one frame of the assembly without the other.
"""

import re
import runpy

from tests.pages import ROOT

TOOL = runpy.run_path(str(ROOT / "tools" / "twin_headers.py"))
FRAMED = ("foc_m3_q15.h", "foc_m4_q15.h")


def test_headers_are_as_their_sources_print_them():
    texts = TOOL["headers"]()
    assert TOOL["printed"](texts) == texts


def test_types_change_where_they_mean_the_width_of_a_word():
    assert TOOL["twin"]("s0 += d * x[0]; int16_t q15") == "s0 += (int64_t)d * x[0]; int32_t q31"
    assert TOOL["twin"]("float f32 = 0.0f;", TOOL["DOUBLE"]) == "double f64 = 0.0;"


def test_a_function_edited_by_hand_is_printed_anew():
    texts = TOOL["headers"]()
    edited = {**texts, "foc_tune.h": texts["foc_tune.h"].replace("if (x < points[0])", "if (x <= points[0])")}
    assert edited != texts and TOOL["printed"](edited) == texts


def test_the_assembly_of_both_cores_begins_and_ends_alike():
    """Runs are read and block sums are rounded by the same instructions, written out in either header."""
    first, second = (instructions(TOOL["headers"]()[name]) for name in FRAMED)
    for since, until in ((None, "ldmia r0, {r4-r7}"), ("ldr r3, [sp, #4]", None)):
        one, other = (between(lines, since, until) for lines in (first, second))
        assert one == other and len(one) >= 20


def between(lines, since, until):
    """From one line of assembly to another; None: from the begin, to the end."""
    return lines[since and lines.index(since) : until and lines.index(until)]


def instructions(text):
    """The lines of assembly in a header."""
    return re.findall(r'^\s+"(.*?)\\n"', text, re.MULTILINE)
