"""The CMake package: configured, built, installed, found again and linked from C and C++, by CMake itself.

Red when CMake cannot configure, install, find or link the package.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.cli.main import main
from focgen.codegen.manifest import sha256
from focgen.verification.folder import read_folder
from tests.build_tools import build_tool
from tests.c_code import compiler, run
from tests.controllers import seed_controller

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def built(source: Path, build: Path, *options: str) -> Path:
    """Configure and build, by Ninja."""
    ninja = f"-DCMAKE_MAKE_PROGRAM={build_tool('ninja')}"
    run(
        build_tool("cmake"),
        "-G",
        "Ninja",
        ninja,
        "-S",
        source,
        "-B",
        build,
        "-DCMAKE_BUILD_TYPE=Release",
        *options,
    )
    run(build_tool("cmake"), "--build", build)
    return build


def test_the_example_finds_the_installed_package_from_c_and_cpp(tmp_path):
    compiler("gcc"), compiler("g++", source="int main() { return 0; }")
    folder, installed = tmp_path / "spba", tmp_path / "installed"
    focgen.generate(EXAMPLES / "controller.toml", folder, for_="cmake", selftest=True)
    build = built(folder, tmp_path / "build")
    assert run(build / "focgen_spba_example").count("\n") == 10
    run(build_tool("cmake"), "--install", build, "--prefix", installed)
    shutil.rmtree(folder)
    own = built(
        EXAMPLES / "cmake", tmp_path / "own", f"-DCMAKE_PREFIX_PATH={installed}", "-DCMAKE_C_FLAGS=-Werror"
    )
    focgen.generate(EXAMPLES / "controller.toml", folder)
    expected = focgen.load(folder).run(*np.full((3, 5), np.float32([[0.01], [0.0], [0.1]])))
    for program in ("finger_c", "finger_cpp"):
        assert [float(line) for line in run(own / program).split()] == pytest.approx(expected, rel=1e-6)
    assert "SPBA_SELFTEST" in (installed / "include" / "spba_selftest.h").read_text().upper()


def test_a_project_takes_two_folders_in(tmp_path):
    """One of them by a name that CMake keeps for a target of its own."""
    for name in ("test", "finger"):
        focgen.generate(seed_controller(9), tmp_path / name, "f32", name=name, for_="cmake")
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.15)\nproject(two C)\n"
        "add_subdirectory(test)\nadd_subdirectory(finger)\n"
        "add_executable(two main.c)\ntarget_link_libraries(two test::test finger::finger)\n"
    )
    (tmp_path / "main.c").write_text(
        '#include "finger.h"\n#include "test.h"\n'
        "int main(void) { static finger_state f; static test_state t; finger_init(&f); test_init(&t);\n"
        "return finger_step(&f, 0.01f, 0.0f, 0.1f) != test_step(&t, 0.01f, 0.0f, 0.1f); }\n"
    )
    build = built(tmp_path, tmp_path / "build")
    run(build / "two")
    commands = (build / "build.ninja").read_text()
    assert commands.count("FLAGS = -O3 -DNDEBUG -ffp-contract=off") == 2 and "example" not in commands


def test_build_files_are_the_users_to_change(tmp_path):
    folder = tmp_path / "spba"
    made = focgen.generate(seed_controller(9), folder, "q15", for_="cmake")
    assert made.manifest["package"]["for"] == "cmake"
    assert read_folder(folder).differences == () and read_folder(folder).notes == ()
    for name, note in (("CMakeLists.txt", "has been edited"), ("LICENSE", "is missing")):
        (folder / name).write_text("mine") if "edited" in note else (folder / name).unlink()
        assert read_folder(folder).differences == () and f"{name}: {note}" in read_folder(folder).notes
    assert focgen.verify(folder, 50).holds


EDITED = {
    "[package] zephyr: is not offered": {"for": "zephyr"},
    "[package] belongs to --for fmu": {"for": "cmake", "fmi": 3},
    "[package] is 4": {"for": "fmu", "fmi": 4},
    "lacks 'package'": ["cmake"],
}
INCOMPLETE = {
    "lacks fmu/spba_fmi2.c": {"for": "fmu", "fmi": 2},
    "lacks src/spba.h": {"for": "arduino"},
}


def test_manifests_of_packages_that_there_are_not(tmp_path, capsys):
    focgen.generate(seed_controller(9), tmp_path, "q15", for_="cmake")
    path = tmp_path / "manifest.json"
    sound = json.loads(path.read_text())
    for says, entry in EDITED.items():
        path.write_text(json.dumps({**sound, "package": entry}))
        assert main(["verify", str(tmp_path)]) == 1
        said = capsys.readouterr().out
        assert f"manifest.json: is not as it was written: {says}" in said, said
    for says, entry in INCOMPLETE.items():
        path.write_text(json.dumps({**sound, "package": entry}))
        assert main(["verify", str(tmp_path)]) == 2
        line = capsys.readouterr().err
        assert says in line and line.count("\n") == 1, line
    path.write_text(json.dumps({**sound, "files": {**sound["files"], "CMakeLists.txt": "0"}}))
    assert any("files.CMakeLists.txt" in line for line in read_folder(tmp_path).differences)


def test_a_manifest_leads_to_no_file_outside_and_to_none_of_the_users(tmp_path):
    folder = tmp_path / "spba"
    focgen.generate(seed_controller(9), folder, "q15", for_="cmake")
    kept = {
        tmp_path / "mine.txt": "../mine.txt",
        folder / "mine.c": "mine.c",
        folder / "spba.fmu": "spba.fmu",
    }
    for path in kept:
        path.write_text("mine")
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"] |= dict.fromkeys(kept.values(), sha256("mine"))
    (folder / "manifest.json").write_text(json.dumps(manifest))
    focgen.generate(seed_controller(9), folder, "q15")
    assert all(path.read_text() == "mine" for path in kept) and not (folder / "CMakeLists.txt").exists()


def test_another_package_takes_the_place_of_the_one_before(tmp_path):
    """What is still as it was written goes; what the user changed stays."""
    folder = tmp_path / "spba"
    for package in ("cmake", "fmu", "cmake", "plain"):
        made = focgen.generate(seed_controller(9), folder, "q15", for_=package)
        assert {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} == set(made.files)
        read = read_folder(folder)
        assert read.differences == () and all("binary" in note for note in read.notes)
    focgen.generate(seed_controller(9), folder, "q15", for_="cmake")
    (folder / "CMakeLists.txt").write_text("mine")
    focgen.generate(seed_controller(9), folder, "q15")
    assert (folder / "CMakeLists.txt").read_text() == "mine" and not (folder / "LICENSE").exists()
