"""Numbers on the command line, in every form that one may be written in.

Red when a negative number is taken for an option.
"""

from __future__ import annotations

import pytest

from focgen.cli.main import parser

NEGATIVE = ("-1e-3", "-1E+3", "-2.5e2", "-.5e-1", "-3.", "-7", "-0.25")


@pytest.mark.parametrize("word", NEGATIVE)
@pytest.mark.parametrize(
    "argv, name",
    [
        (["design", "RIG", "--out", "FILE", "--setpoints"], "setpoints"),
        (["simulate", "RIG", "FILE", "--setpoints", "1"], "setpoints"),
        (["identify", "LOG", "--rig", "RIG", "--out", "NEW", "--from"], "first"),
        (["generate", "FILE", "--out", "DIR", "--arithmetic", "q31", "--band", "1"], "band"),
    ],
)
def test_a_negative_number_is_no_option(argv, name, word):
    found = getattr(parser(argv[0]).parse_args([*argv, word]), name)
    assert (found[-1] if isinstance(found, list) else found) == float(word)
