"""What the public functions are given that is not of the kind they name: one line, whatever it is.

Red when it ends in words of Python's, or is taken for something that nobody meant.
"""

from __future__ import annotations

import decimal
import inspect
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.arguments import _WANTED, checked
from focgen.control.controller import Controller
from focgen.control.files import read_controller, write_controller
from focgen.errors import FitError, FocgenError, InputError
from focgen.rig.files import write_rig
from focgen.rig.rig import Rig
from focgen.testing import assert_equivalent

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
WORDS = "cost design demo diagnose generate identify init load read_logs replay report simulate study verify"
FUNCTIONS = WORDS.split()


class Odd:
    def __repr__(self) -> str:
        raise RuntimeError("no words")


ODD = [1j, Odd(), b"x", b"", np.ones((2, 2)), np.array([]), decimal.Decimal("NaN"), [[1], [2, 3]], {}, int]
NO_PATH = ["a\0b", "A" * 100_000]


def arguments(kinds: str) -> list[tuple[str, str]]:
    """Every argument of the public functions that is of one of some kinds."""
    found = []
    for name in FUNCTIONS:
        for one, parameter in inspect.signature(getattr(focgen, name)).parameters.items():
            if str(parameter.annotation).removesuffix(" | None") in kinds.split("; "):
                found.append((name, one))
    return found


def call(called: str, **given):
    """With what else is required, which is never looked at: the kinds are looked at first."""
    function = getattr(focgen, called)
    needed = inspect.signature(function).parameters.values()
    needed = {p.name: "x" for p in needed if p.default is p.empty and p.name not in given}
    return function(**{**needed, **given})


@pytest.mark.parametrize(("name", "one"), arguments("; ".join(_WANTED)))
def test_a_value_of_another_kind_is_one_line_that_names_it(tmp_path, monkeypatch, name, one):
    monkeypatch.chdir(tmp_path)
    for odd in ODD:
        if isinstance(odd, np.ndarray) and odd.size == 0 and "Sequence" in kind(name, one):
            continue  # it may be none: that is the function's to judge
        with pytest.raises(InputError) as told:
            call(name, **{one: odd})
        assert told.value.where == f"{name}: {one}" and "\n" not in str(told.value)
        assert len(str(told.value)) < 300
    assert not list(tmp_path.iterdir())


def kind(name: str, one: str) -> str:
    return str(inspect.signature(getattr(focgen, name)).parameters[one].annotation)


def test_the_kinds_are_found():
    """Else the others could not fail."""
    assert len(arguments("str | Path")) >= 12 and len(arguments("float; int; bool")) > 25


@pytest.mark.parametrize(("name", "one"), arguments("str | Path"))
@pytest.mark.parametrize("path", NO_PATH, ids=["null", "long"])
def test_what_the_system_takes_for_no_path_is_refused(name, one, path):
    with pytest.raises(InputError, match="give a path"):
        call(name, **{one: path})


@pytest.mark.parametrize(("name", "one"), arguments("int"))
def test_half_a_count_is_none(name, one):
    for given in (1.5, True, "3"):
        with pytest.raises(InputError, match="give a whole number"):
            call(name, **{one: given})


@checked
def taken(path: str | Path = "", number: float | None = None, count: int = 0, many: Sequence[float] = ()):
    return path, number, count, many


def test_all_that_is_of_a_kind_is_taken_as_it_is(tmp_path):
    given = tmp_path, np.float32(2.5), np.int64(3), np.array([1.0, math.nan])
    assert all(one is two for one, two in zip(taken(*given), given))
    assert taken("x", 3, 4, (1, 2)) == ("x", 3, 4, (1, 2)) and taken(number=None)[1] is None


def test_no_logs_are_said_to_be_none():
    with pytest.raises(InputError, match="none is given"):
        focgen.init([])
    with pytest.raises(InputError, match="nothing to show"):
        focgen.report([], "page.html")


@pytest.mark.parametrize("end", ["\n", "\r\n", "\u2028", "\x85", "\v"])
def test_an_error_is_one_line_whatever_it_speaks_of(end):
    error = FitError(f"a{end}b", f"is {end} c", f"d{end}")
    assert str(error).splitlines() == ["a b: is c; d "]


def test_a_name_of_several_lines_in_a_rig_is_told_on_one():
    rig = focgen.read_rig(EXAMPLES / "rig.toml")
    with pytest.raises(FocgenError) as told:
        focgen.read_logs(rig, {"a\nb": [1.0, 2.0], "c": [1.0, 2.0]})
    assert "\n" not in str(told.value)


@checked
def owned(rig: Rig, controller: str | Path | Controller = "", several: list[Rig] | None = None):
    return rig, controller, several


def test_objects_of_our_own_are_told_from_others(tmp_path):
    rig, controller = focgen.read_rig(EXAMPLES / "rig.toml"), read_controller(EXAMPLES / "controller.toml")
    assert owned(rig, controller, [1]) == (rig, controller, [1]) and owned(rig, tmp_path)[1] == tmp_path
    for odd in [*ODD, controller, Rig]:
        with pytest.raises(InputError, match="owned: rig: .*; give a Rig"):
            owned(odd)
    for odd in [*ODD, *NO_PATH, rig, Controller]:
        with pytest.raises(InputError, match="owned: controller: .*; give a path or a Controller"):
            owned(rig, odd)


@pytest.mark.parametrize("write", [write_rig, write_controller])
def test_only_its_own_kind_is_written(tmp_path, write):
    other = {write_rig: read_controller(EXAMPLES / "controller.toml"), write_controller: None}[write]
    with pytest.raises(InputError, match="give a (Rig|Controller)"):
        write(other, tmp_path / "x.toml")
    assert not list(tmp_path.iterdir())


def test_a_reference_that_no_system_takes_for_a_path_is_refused():
    with pytest.raises(InputError, match="give a path or a Controller or a LoadedController"):
        assert_equivalent("/" + "a" * 5000, print)
