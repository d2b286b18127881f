"""What is published: the page of an index, the archive of sources, the wheel, and the citation.

Red when something is published that does not install, or lacks a file.
"""

from __future__ import annotations

import email
import re
import runpy
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

import focgen
from tests.c_code import run

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
RELATIVE = re.compile(r"\]\((?!https://)[^)]*\)")
SHIPPED = {"_shipped/templates", "_shipped/c_runtime", "_shipped/examples"}
SOURCES = """.gitignore CHANGELOG.md CITATION.cff LICENSE Makefile PKG-INFO README.md SECURITY.md
    pyproject.toml
    c_runtime docs examples focgen requirements templates tests tools""".split()


@pytest.fixture(scope="module")
def index_page():
    return runpy.run_path(str(ROOT / "tools" / "index_page.py"))["index_page"]


def test_no_address_of_the_index_page_is_relative(index_page):
    assert len(RELATIVE.findall(README)) > 20
    plain = index_page(README)
    assert (
        not RELATIVE.findall(plain)
        and ".png" not in plain
        and "Six steps and their fractional models" in plain
    )
    page = index_page(README, "https://example.com/focgen/")
    assert not RELATIVE.findall(page)
    assert (
        "![Six steps and their fractional models](https://example.com/focgen/raw/HEAD/docs/figures/fits.png)"
        in page
    )
    assert "[docs/memory.md](https://example.com/focgen/blob/HEAD/docs/memory.md)" in page


def test_the_citation_names_the_paper_and_this_version():
    yaml = pytest.importorskip("yaml")
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert (
        cited["version"] == focgen.__version__ == project["version"]
        and cited["license"] == project["license"]
    )
    (paper,) = cited["references"]
    assert paper["title"].startswith("Fractional Order Modeling and Control of Hydrogel-based Soft Pneumatic")
    assert {"cff-version", "message", "title", "authors"} <= cited.keys() and {
        "type",
        "authors",
    } <= paper.keys()


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """The folder with both archives; the wheel is built from the sources' one."""
    pytest.importorskip("build", reason="build is not installed: pip install 'focgen[dev]'")
    out = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--outdir", out, ROOT)
    return out


@pytest.mark.long
def test_the_archives_hold_what_they_should(built):
    (sdist,), (wheel,) = built.glob("*.tar.gz"), built.glob("*.whl")
    with tarfile.open(sdist) as archive:
        names = [Path(*Path(name).parts[1:]).as_posix() for name in archive.getnames()]
    assert {name.split("/")[0] for name in names} == set(SOURCES)
    inside = zipfile.ZipFile(wheel).namelist()
    assert "focgen/py.typed" in inside
    tops = {name.split("/")[0] for name in inside}
    assert tops == {"focgen", f"focgen-{focgen.__version__}.dist-info"}
    assert all(any(name.startswith(f"focgen/{part}/") for name in inside) for part in SHIPPED)
    unwanted = re.compile(r"__pycache__|\.pyc$|\.so$|\.pio/|(^|/)build/|\.egg-info")
    assert not [name for name in (*names, *inside) if unwanted.search(name)]
    with zipfile.ZipFile(wheel) as archive:
        page = email.message_from_bytes(archive.read(f"focgen-{focgen.__version__}.dist-info/METADATA"))
    assert page["Requires-Python"] == ">=3.11" and page["License-Expression"] == "MIT"
    assert page["Description-Content-Type"].startswith("text/markdown")
    assert "From a CSV of step tests" in page.get_payload() and not RELATIVE.findall(page.get_payload())


@pytest.mark.long
def test_the_wheel_runs_the_demo_in_an_environment_of_its_own(built, tmp_path):
    """Libraries come from the environment of the tests, the package from the wheel."""
    home, (wheel,) = tmp_path / "home", built.glob("*.whl")
    venv.create(home, with_pip=False)
    python = home / "bin" / "python"
    (site,) = (home / "lib").glob("python*/site-packages")
    run(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", site, wheel)
    libraries = [path for path in sys.path if path.endswith("site-packages")]
    (site / "libraries.pth").write_text("\n".join(libraries))
    code = (
        "import focgen, sys; from focgen.cli.main import main; "
        "print(focgen.__file__, flush=True); sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [python, "-c", code, "demo", "--out", tmp_path / "demo"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={"PATH": "/usr/bin:/bin"},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(site)) and list((tmp_path / "demo").rglob("manifest.json"))
