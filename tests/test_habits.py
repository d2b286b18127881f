"""What keeps the house easy to read: short functions and files, few branches, docstrings that say what fails.

Red with a function of 70 lines, one of a complexity above ten, a file of more than 400 lines, a
public name without a docstring, a public function that raises an error of ours and does not say so, or a
bench or a campaign, which no test runs whole, that asks for a name that is gone.
"""

import ast
import functools
import importlib
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from statistics import median, quantiles

import pytest

import focgen
from focgen import errors

PACKAGE = Path(focgen.__file__).parent
ROOT = PACKAGE.parent
FILES = sorted(PACKAGE.rglob("*.py"))
ERRORS = {
    name
    for name, one in vars(errors).items()
    if isinstance(one, type) and issubclass(one, errors.FocgenError)
}
LONGEST = 65  # lines of a function, its docstring with it; `identify` tells seventeen arguments
FORKS = (ast.If, ast.For, ast.While, ast.ExceptHandler, ast.match_case)


@functools.cache
def _trees():
    """Read by who needs them: every process of the suite collects this file, one runs it."""
    return {file: ast.parse(file.read_text(encoding="utf-8")) for file in FILES}


def _functions():
    for file, tree in _trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                yield f"{file.relative_to(ROOT)}:{node.lineno} {node.name}", node


def _own(function):
    """What a function consists of, without the functions in it."""
    waiting = list(function.body)
    while waiting:
        node = waiting.pop()
        yield node
        if not isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Lambda):
            waiting.extend(ast.iter_child_nodes(node))


def _complexity(function):
    """McCabe's number of paths, of statements."""
    return 1 + sum(isinstance(node, FORKS) for node in _own(function))


def test_functions_are_short():
    lines = {place: node.end_lineno - node.lineno + 1 for place, node in _functions()}
    assert median(lines.values()) <= 8
    assert quantiles(lines.values(), n=10)[-1] <= 20
    assert {place: n for place, n in lines.items() if n > LONGEST} == {}


def test_functions_fork_seldom():
    paths = {place: _complexity(node) for place, node in _functions()}
    assert {place: n for place, n in paths.items() if n > 10} == {}
    assert quantiles(paths.values(), n=10)[-1] <= 5


def test_files_have_at_most_400_lines():
    counts = {str(file.relative_to(ROOT)): len(file.read_text("utf-8").splitlines()) for file in FILES}
    assert {file: n for file, n in counts.items() if n > 400} == {}


def _overload(function):
    return any(ast.unparse(one) == "overload" for one in function.decorator_list)


def _public(tree):
    """Functions and methods without an underscore, of classes without one, and what their class says."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and not _overload(node):
            yield node, ""
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            for method in node.body:
                if (
                    isinstance(method, ast.FunctionDef)
                    and not method.name.startswith("_")
                    and not _overload(method)
                ):
                    yield method, ast.get_docstring(node) or ""


def _raised(function):
    """The errors of ours that a function raises by itself."""
    for node in _own(function):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            name = ast.unparse(node.exc.func).split(".")[0]
            if name in ERRORS:
                yield name


def test_public_functions_name_the_errors_that_they_raise():
    silent = [
        f"{file.relative_to(ROOT)}:{function.lineno} {function.name}: {error}"
        for file, tree in _trees().items()
        for function, above in _public(tree)
        for error in _raised(function)
        if error not in f"{ast.get_docstring(function)} {above}"
        or "aise" not in f"{ast.get_docstring(function)} {above}"
    ]
    assert silent == []


def test_public_names_say_what_they_are():
    """But for what every command has, `add_arguments` and `run`."""
    silent = [
        f"{file.relative_to(ROOT)}:{node.lineno} {node.name}"
        for file, tree in _trees().items()
        for node in (*(n for n in tree.body if isinstance(n, ast.ClassDef)), *(f for f, _ in _public(tree)))
        if not node.name.startswith("_")
        and not ast.get_docstring(node)
        and not (file.parent.name == "cli" and node.name in ("add_arguments", "run"))
    ]
    assert silent == []


@pytest.mark.skipif(find_spec("ruff") is None, reason="ruff is not installed (extra dev)")
def test_the_rules_of_style_hold():
    for rule in (["check"], ["format", "--check"]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *rule, "focgen", "tests", "tools"],
            cwd=ROOT,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stdout


def test_what_no_test_runs_whole_finds_all_it_imports():
    tools = [f for f in (ROOT / "tests").rglob("*.py") if not f.name.startswith(("test_", "__", "conftest"))]
    names = [".".join(f.relative_to(ROOT).with_suffix("").parts) for f in tools if "golden" not in f.parts]
    assert len(names) > 50
    for name in names:
        importlib.import_module(name)
