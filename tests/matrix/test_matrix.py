"""The matrix in short: settings that cost nothing, over a few forms; and that it sees a byte that differs.

Red when a locale, a hash seed, a thread or a kernel of OpenBLAS changes a byte of what is generated.
"""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path

import pytest

from tests.matrix import __main__ as matrix
from tests.matrix.settings import ENVIRONMENTS, PLAIN, VERSIONS, Setting, digests, installed

SHORT = ("all at once", "f32")  # the other form has poles, which take four times as long to find


@functools.cache
def made(setting_name: str, form: str) -> dict[str, str]:
    setting = {s.name: s for s in (PLAIN, *ENVIRONMENTS)}[setting_name]
    with tempfile.TemporaryDirectory() as folder:
        found = digests(setting, Path(folder) / "files", form)
    if isinstance(found, str):
        pytest.skip(found)
    return found


@pytest.mark.parametrize(
    "name, form",
    [SHORT, *(pytest.param(s.name, "exp_q31", marks=pytest.mark.long) for s in ENVIRONMENTS)],
)
def test_a_setting_of_the_environment_changes_no_byte(name, form):
    here = made(PLAIN.name, form)
    assert len(here) >= 8 and made(name, form) == here


def test_a_byte_that_differs_is_named(capsys, monkeypatch, tmp_path):
    here = {"a/x.c": "1", "a/y.h": "2"}
    monkeypatch.setattr(matrix, "digests", lambda setting, folder: {"a/x.c": "1", "a/y.h": "3"})
    assert matrix._differs(Setting("another"), here, tmp_path)
    assert not matrix._differs("python3.99 is not installed", here, tmp_path)
    assert capsys.readouterr().out.splitlines() == [
        "| another | a/y.h |",
        "| – | not tried: python3.99 is not installed |",
    ]


def test_a_python_that_is_not_there_is_no_failure(tmp_path):
    assert installed("3.99", ("numpy",), tmp_path) == "python3.99 is not installed"
    assert all(len(pairs) == 2 for pairs in VERSIONS.values())
