"""The PlatformIO library: its manifest by PlatformIO's own rules, and a program by PlatformIO's own build.

What PlatformIO would load from its registry is put in place from Python packages: SCons, a platform for this
computer, and the list of licences.

Red when PlatformIO refuses the library or its program.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.verification.folder import read_folder
from tests.c_code import compiler
from tests.controllers import seed_controller

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PLATFORM = {
    "name": "host",
    "title": "Host",
    "description": "this computer",
    "version": "1.0.0",
    "packages": {},
}
BUILDER = """
from SCons.Script import Default, DefaultEnvironment
env = DefaultEnvironment()
env.Replace(CC="gcc", CXX="g++", AR="gcc-ar", RANLIB="gcc-ranlib", PROGSUFFIX="")
Default(env.BuildProgram())
"""


@pytest.fixture
def pack(monkeypatch):
    """PlatformIO's packer, which validates the manifest; the licences are those that `packaging` knows."""
    pytest.importorskip("platformio", reason="PlatformIO is not installed: pip install 'focgen[dev]'")
    from packaging.licenses._spdx import LICENSES
    from platformio.package.manifest.schema import ManifestSchema
    from platformio.package.pack import PackagePacker

    known = {"licenses": [{"licenseId": entry["id"]} for entry in LICENSES.values()]}
    monkeypatch.setattr(ManifestSchema, "load_spdx_licenses", staticmethod(lambda: known))
    return lambda folder, out: PackagePacker(str(folder)).pack(str(out))


def test_it_packs(pack, tmp_path):
    folder = tmp_path / "spba"
    made = focgen.generate(seed_controller(9), folder, "q15", for_="platformio", selftest=True)
    with tarfile.open(pack(folder, tmp_path / "spba.tar.gz")) as archive:
        assert set(made.files) <= {entry.removeprefix("./") for entry in archive.getnames()}
        described = json.load(archive.extractfile("library.json"))
    assert described["headers"] == ["spba.h", "spba_selftest.h"]
    assert read_folder(folder).notes == () and focgen.verify(folder, 50).holds
    described["license"] = "mine"
    (folder / "library.json").write_text(json.dumps(described))
    with pytest.raises(Exception, match="license"):
        pack(folder, tmp_path / "again.tar.gz")


def test_the_arduino_library_packs_as_well(pack, tmp_path):
    """PlatformIO reads library.properties, too."""
    focgen.generate(seed_controller(9), tmp_path / "spba", "q15", for_="arduino")
    assert Path(pack(tmp_path / "spba", tmp_path / "spba.tar.gz")).is_file()


@pytest.fixture
def core(tmp_path) -> dict[str, str]:
    """The environment of a PlatformIO that has its build tool and a platform for this computer."""
    scons = pytest.importorskip("SCons", reason="SCons is not installed: pip install 'focgen[dev]'")
    from platformio.dependencies import get_core_dependencies

    wanted = get_core_dependencies()["tool-scons"].strip("~^=")
    folder = tmp_path / "core" / "packages" / "tool-scons"
    folder.mkdir(parents=True)
    (folder / "SCons").symlink_to(Path(scons.__file__).parent)
    (folder / "scons.py").write_text("from SCons.Script import main\nmain()\n")
    entry = {"type": "tool", "name": "tool-scons", "version": wanted}
    spec = {"owner": "platformio", "id": None, "name": "tool-scons", "requirements": None, "uri": None}
    (folder / "package.json").write_text(json.dumps(entry))
    (folder / ".piopm").write_text(json.dumps({**entry, "spec": spec}))
    platform = tmp_path / "host"
    (platform / "builder").mkdir(parents=True)
    (platform / "platform.json").write_text(json.dumps(PLATFORM))
    (platform / "platform.py").write_text(
        "from platformio.public import PlatformBase\n\n\nclass HostPlatform(PlatformBase):\n    pass\n"
    )
    (platform / "builder" / "main.py").write_text(BUILDER)
    settings = {
        "ENABLE_TELEMETRY": "no",
        "CHECK_PLATFORMIO_INTERVAL": "9999",
        "CHECK_PRUNE_SYSTEM_THRESHOLD": "0",
    }
    return {
        **os.environ,
        "PLATFORMIO_CORE_DIR": str(tmp_path / "core"),
        **{f"PLATFORMIO_SETTING_{key}": value for key, value in settings.items()},
    }


def test_the_example_is_built_by_platformio(tmp_path, request):
    pytest.importorskip("platformio", reason="PlatformIO is not installed: pip install 'focgen[dev]'")
    compiler("gcc")
    environment, project = request.getfixturevalue("core"), tmp_path / "project"
    focgen.generate(EXAMPLES / "controller.toml", project / "lib" / "spba", for_="platformio")
    (project / "src").mkdir()
    given = (EXAMPLES / "platformio" / "platformio.ini").read_text()
    assert given.count("platform = native") == 1
    (project / "platformio.ini").write_text(given.replace("native", f"symlink://{tmp_path / 'host'}"))
    (project / "src" / "main.c").write_text((EXAMPLES / "platformio" / "src" / "main.c").read_text())
    command = [sys.executable, "-m", "platformio", "run", "-v", "-d", str(project)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "spba @ 0.1.0" in done.stdout and "-c -ffp-contract=off" in done.stdout
    said = subprocess.run([project / ".pio/build/host/program"], capture_output=True, text=True, check=True)
    expected = focgen.load(project / "lib" / "spba").run(*np.full((3, 5), np.float32([[0.01], [0.0], [0.1]])))
    assert [float(line) for line in said.stdout.split()] == pytest.approx(expected, rel=1e-6)
