"""The face is typed: what a checker reads is what runs, and a strict one finds nothing to say.

Red when a public function gets or gives what its types do not say.
"""

import ast
import importlib
import inspect
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest

import focgen

ROOT = Path(__file__).resolve().parents[2]


def _seen_by_a_checker(package):
    """Names that are imported where TYPE_CHECKING is true, by the module that they come from."""
    tree = ast.parse(Path(package.__file__).read_text(encoding="utf-8"))
    blocks = [node for node in tree.body if isinstance(node, ast.If) and isinstance(node.test, ast.Name)]
    (block,) = [node for node in blocks if node.test.id == "TYPE_CHECKING"]
    return {name.name: part.module for part in block.body for name in part.names}


@pytest.mark.parametrize("name", ["focgen", "focgen.fractional", "focgen.testing"])
def test_what_a_checker_sees_is_what_runs(name):
    package = importlib.import_module(name)
    seen = _seen_by_a_checker(package)
    for public, home in seen.items():
        found = getattr(package, public)
        if public != "report":  # a room that is called
            assert found is getattr(importlib.import_module(home), public), public
    direct = {public for public in package.__all__ if public in vars(package) and public not in seen}
    assert set(package.__all__) == set(seen) | direct and package.__dir__() == package.__all__


def test_every_command_is_a_function_of_its_name():
    from focgen.cli.main import commands

    assert all(callable(getattr(focgen, command)) and command in focgen.__all__ for command in commands())
    assert (Path(focgen.__file__).parent / "py.typed").is_file()


@pytest.mark.parametrize("name", ["focgen", "focgen.fractional", "focgen.testing"])
def test_whatever_is_public_says_what_it_does(name):
    """Functions and classes, and every public function and property of these."""
    package = importlib.import_module(name)
    for public in set(package.__all__) - {"__version__"}:
        found = getattr(package, public)
        assert inspect.getdoc(found), public
        for member, one in vars(found).items() if inspect.isclass(found) else ():
            if not member.startswith("_") and (inspect.isfunction(one) or isinstance(one, property)):
                assert one.__doc__, f"{public}.{member}"


def test_a_bare_import_loads_nothing_large():
    script = (
        "import sys, focgen; print(sorted({'numpy', 'scipy', 'jinja2', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_files_that_are_checked_exist():
    """A file that has moved would otherwise be left out without a word."""
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]
    assert config["strict"] and all((ROOT / file).exists() for file in config["files"])
    assert "focgen" in config["files"] and "exclude" not in config


@pytest.mark.long
@pytest.mark.skipif(find_spec("mypy") is None, reason="mypy is not installed (extra dev)")
def test_a_strict_checker_is_content():
    """With what users call, and with a program of theirs."""
    done = subprocess.run([sys.executable, "-m", "mypy"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
