"""The demo from end to end: what it promises to leave behind is there, holds, and is shown.

Red when the demo lacks a file, shows less than it promises, or its C is not verified.
"""

import json
import re

import pytest

from focgen.cli.main import main


@pytest.mark.long
def test_the_demo_holds_and_shows_what_it_made(tmp_path, capsys):
    assert main(["demo", "--out", str(tmp_path / "demo"), "--json"]) == 0
    payload = json.loads(capsys.readouterr().out)
    gof = payload["identify"]["gof"]
    assert payload["holds"] and gof["fom"] > gof["iom_2p1z"] > gof["iom_1p"]
    assert set(payload["verify"]) == {"f64", "f32", "q31", "q15"}
    assert all(found["host"]["mismatches"] == 0 for found in payload["verify"].values())
    page = (tmp_path / "demo" / "report.html").read_text(encoding="utf-8")
    for link in set(re.findall(r'(?:src|href)="([^"#:]+)"', page)):
        assert (tmp_path / "demo" / link).is_file(), link
    for promised in ("K_o(p) = ", "% of K_o/K", "the gain is held at", "instead of 0", "The seal says"):
        assert promised in page
