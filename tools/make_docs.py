"""The documentation as a site that needs no server: ``python tools/make_docs.py build/site``.

The pages of ``docs/`` are gathered with those that stand elsewhere in the project: the README, the examples'
page, the changelog. Two are made here, so that they cannot be out of date: the commands, as ``--help`` prints
them, and the public functions, from their docstrings. Sphinx makes the site; a warning of Sphinx is a fault.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from contextlib import redirect_stdout, suppress
from importlib import import_module
from io import StringIO
from pathlib import Path
from types import ModuleType
from unittest import mock

import focgen
from focgen.cli.main import commands
from focgen.cli.main import main as run

ROOT = Path(__file__).resolve().parents[1]
ELSEWHERE = {
    "README.md": "index.md",
    "examples/README.md": "examples.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
NAV = {
    "Start": ("own-log", "tutorial-board", "tutorial-diagnosis", "tutorial-memory", "examples"),
    "How to": ("recording-logs", "logs", "rig-file", "controller-file", "packages", "testing", "report"),
    "Understand": (
        "identification",
        "closed-loop",
        "memory",
        "diagnosis",
        "blind-trials",
        "other-rigs",
        "effects",
        "proofs",
        "kernels",
        "records",
    ),
    "Look up": ("commands", "python", "reference", "c-interface", "targets", "glossary"),
    "Why": tuple(f"design/{page.stem}" for page in sorted((ROOT / "docs" / "design").glob("*.md"))),
    "About": ("limits", "trust", "attacks", "comparison", "architecture", "contributing", "changelog"),
}
CONF = f"""
project = "focgen"
version = release = {focgen.__version__!r}
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_copybutton"]
myst_heading_anchors = 4
myst_links_external_new_tab = True
html_theme = "furo"
html_title = "focgen"
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {{
    "light_css_variables": {{"color-brand-primary": "#00695c", "color-brand-content": "#00695c"}},
    "dark_css_variables": {{"color-brand-primary": "#4db6ac", "color-brand-content": "#4db6ac"}},
}}
html_last_updated_fmt = None
autodoc_typehints = "none"
copybutton_exclude = ".linenos, .gp, .go"
"""


def main(out: str) -> int:
    """Build the site into the folder ``out``; the exit status of Sphinx."""
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(scratch)
        gather(source)
        sphinx = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", str(source), out]
        status = subprocess.run(sphinx, cwd=ROOT).returncode
    shutil.rmtree(Path(out) / ".doctrees", ignore_errors=True)
    return status


def gather(source: Path) -> None:
    """Every page of the site into ``source``, links between them as the site has them."""
    shutil.copytree(ROOT / "docs" / "figures", source / "figures")
    docs = ROOT / "docs"
    pages = {page: page.relative_to(docs).as_posix() for page in docs.rglob("*.md")}
    pages |= {ROOT / path: name for path, name in ELSEWHERE.items()}
    for page, name in pages.items():
        text = page.read_text(encoding="utf-8")
        (source / name).parent.mkdir(exist_ok=True)
        (source / name).write_text(linked(text, page, pages), encoding="utf-8")
    (source / "commands.md").write_text(commands_page(), encoding="utf-8")
    (source / "reference.md").write_text(reference_page(), encoding="utf-8")
    (source / "index.md").write_text(
        (source / "index.md").read_text(encoding="utf-8") + contents(), encoding="utf-8"
    )
    (source / "conf.py").write_text(CONF, encoding="utf-8")


def linked(text: str, page: Path, pages: dict[Path, str]) -> str:
    """Links of a page to others as the site names them; what is no page of it is only named."""

    def there(name: str) -> str:
        return Path(os.path.relpath(name, Path(pages[page]).parent)).as_posix()

    def as_here(link: re.Match) -> str:
        shown, target, anchor = link.group(1), link.group(2), link.group(3) or ""
        file = (page.parent / target).resolve()
        if "://" in target or not file.exists():
            return link.group(0)
        if file in pages:
            return f"[{shown}]({there(pages[file])}{anchor})"
        if file.is_relative_to(ROOT / "docs"):
            return f"[{shown}]({there(file.relative_to(ROOT / 'docs').as_posix())})"
        if (file / "README.md") in pages:
            return f"[{shown}]({there(pages[file / 'README.md'])})"
        return f"{shown} (`{file.relative_to(ROOT).as_posix()}`)"

    return re.sub(r"\[([^\]]*)\]\(([^)#\s]+)(#[^)]*)?\)", as_here, text)


def contents() -> str:
    """The site's order of pages, for the bar at its side."""
    trees = []
    for part, pages in NAV.items():
        listed = "\n".join(pages)
        trees.append(f"```{{toctree}}\n:hidden:\n:maxdepth: 1\n:caption: {part}\n\n{listed}\n```\n")
    return "\n" + "\n".join(trees)


def commands_page() -> str:
    """Every command with its ``--help``, as Markdown."""
    parts = ["# Commands\n\nWhat `focgen COMMAND --help` prints.\n"]
    parts += [f"## focgen {name}\n\n```text\n{_help(name)}\n```\n" for name in commands()]
    return "\n".join(parts)


def _help(command: str) -> str:
    """What the command prints for ``--help``, at a hundred columns whatever the terminal has."""
    with (
        mock.patch.dict(os.environ, {"COLUMNS": "100"}),
        redirect_stdout(StringIO()) as said,
        suppress(SystemExit),
    ):
        run([command, "--help"])
    return said.getvalue().strip()


def reference_page() -> str:
    """Every public function and class, from its docstring."""
    parts = ["# Python, every function\n\nWhat `import focgen` gives, from the docstrings.\n"]
    parts += [_documented(name) for name in sorted(focgen.__all__) if not name.startswith("_")]
    return "\n".join(parts)


def _documented(name: str) -> str:
    thing = getattr(focgen, name)
    if isinstance(thing, ModuleType):  # `focgen.report(...)` and `focgen.report.page` are both meant
        thing = getattr(import_module("focgen.report.paths"), name)
    kind = "class" if isinstance(thing, type) else "function"
    return f"## {name}\n\n```{{eval-rst}}\n.. auto{kind}:: {thing.__module__}.{thing.__qualname__}\n```\n"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
