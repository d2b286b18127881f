"""The numbers that decide stand in one place, and the documentation says what they are.

Red when a number that decides stands elsewhere than in `Numbers`, or the page says another one.
"""

import ast
from pathlib import Path

from focgen.diagnosis.numbers import NUMBERS, told
from tests.diagnosis import settings

ROOM = Path(__file__).parents[2] / "focgen" / "diagnosis"
PAGE = Path(__file__).parents[2] / "docs" / "diagnosis.md"
PLAIN = {0.0, 0.5, 1.0, 2.0}


def table():
    """The rows of the page's table of numbers, as :func:`told` says them."""
    rows = ["| number | value | meaning | unit | from | half | double |", "|---|---|---|---|---|---|---|"]
    for name, value, account in told():
        rows.append(f"| `{name}` | {value:g} | " + " | ".join(account.values()) + " |")
    return "\n".join(rows)


def test_the_page_prints_the_numbers_that_decide():
    assert table() in PAGE.read_text(encoding="utf-8")


def test_few_numbers_decide_and_each_says_what_it_is():
    assert len(told()) <= 29
    assert all(account["meaning"] and account["unit"] and account["source"] for _, _, account in told())
    assert NUMBERS.held + NUMBERS.elsewhere <= 1.0  # else no set could hold as much


def _constants(path):
    """Names of a module that stand for numbers other than plain ones."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and any(_tuned(n) for n in ast.walk(node.value)):
            for target in node.targets:
                yield from (n.id for n in ast.walk(target) if isinstance(n, ast.Name))


def _tuned(node):
    return isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value not in PLAIN


def _compared(path):
    """Floats that something is compared with in place, other than plain ones and guards of rounding."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Compare):
            for n in ast.walk(node):
                if _tuned(n) and 1e-5 < abs(n.value) < 1e5:
                    yield n.value


def test_no_other_number_decides():
    """What is no setting of a fit, a search or an experiment, and no prior of a nuisance, is in `Numbers`."""
    found = {
        f"{path.relative_to(ROOM)}": names
        for path in sorted(ROOM.rglob("*.py"))
        if path.name != "numbers.py" and (names := sorted(_constants(path)))
    }
    assert found == settings.CONSTANTS
    places = {str(path.relative_to(ROOM)): list(_compared(path)) for path in ROOM.rglob("*.py")}
    assert {k: v for k, v in places.items() if v} == settings.COMPARED
