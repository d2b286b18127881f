"""Generated text against files that were read and found good; made through the command line, then compiled.

After a change that is meant: ``pytest tests/codegen/test_golden.py --update-golden``; read the difference.

Red when a byte of generated text changes, or what was found good no longer compiles.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from focgen.cli.main import main
from focgen.output import write_files
from tests.c_code import STRICT, compiler, run, tool

FORMS = ("f64", "f32", "q31", "q15", "exp_f32", "exp_q31")
EXPONENTIAL = ["--memory", "exponential", "--tolerance", "1e-3", "--horizon", "100000"]
ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "golden"
CONTROLLER = GOLDEN / "finger.toml"


def options(form: str) -> list[str]:
    """The arithmetic, with an exponential memory where the form says so."""
    memory = EXPONENTIAL if form.startswith("exp") else []
    return ["--arithmetic", arithmetic(form), "--name", f"finger_{arithmetic(form)}", *memory]


def arithmetic(form: str) -> str:
    """Of a form of FORMS."""
    return form.removeprefix("exp_")


def generated(form: str, out: Path) -> dict[str, bytes]:
    argv = ["generate", str(CONTROLLER), "--out", str(out), *options(form)]
    assert main(argv) == 0
    return {str(p.relative_to(out)): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}


def without_digests(files: dict[str, bytes]) -> bytes:
    """The manifest's text with its digests, which are those of the folder's own ``files``, left out: a change
    of the runtime is none of the generator."""
    text = files["manifest.json"].decode()
    whole = json.loads(text)
    digests = {
        name: hashlib.sha256(one).hexdigest() for name, one in files.items() if name != "manifest.json"
    }
    assert digests and digests.items() <= whole.pop("files").items()
    text = json.dumps(whole, indent=2, ensure_ascii=False) + "\n"
    for name, digest in whole["inputs"].items():
        assert digest == hashlib.sha256(files[name]).hexdigest(), name
        text = text.replace(digest, f"sha256 of {name}")
    return text.encode()


@pytest.mark.parametrize("form", FORMS)
def test_the_text_is_the_golden_one(form, tmp_path, request):
    found, folder = generated(form, tmp_path / "out"), GOLDEN / f"finger_{form}"
    found["manifest.json"] = without_digests(found)
    memory = [("foc_memory.h", "c_runtime/foc_memory.h")] * form.startswith("exp")
    for copied, source in (
        ("foc_rt.h", "c_runtime/foc_rt.h"),
        ("foc_save.h", "c_runtime/foc_save.h"),
        ("controller.toml", "tests/golden/finger.toml"),
        *memory,
    ):
        assert found.pop(copied) == (GOLDEN.parents[1] / source).read_bytes()
    if request.config.getoption("--update-golden"):
        write_files(folder, found)
    golden = {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    assert found.keys() == golden.keys()
    for name, content in golden.items():
        assert found[name].decode() == content.decode(), name


def test_the_text_for_a_core_is_the_golden_one(tmp_path, request):
    """A sum that looks ahead: its tables, its runs, its calls."""
    options = ["--arithmetic", "q15", "--name", "finger_m4", "--length", "64", "--target", "cortex-m4"]
    assert main(["generate", str(CONTROLLER), "--out", str(tmp_path), *options]) == 0
    folder, names = GOLDEN / "finger_m4", ("finger_m4.c", "finger_m4.h", "README.md")
    found = {name: (tmp_path / name).read_bytes() for name in names}
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    found["kernels.json"] = json.dumps(manifest["kernels"], indent=2).encode()
    if request.config.getoption("--update-golden"):
        write_files(folder, found)
    golden = {p.name: p.read_bytes().decode() for p in folder.iterdir()}
    assert golden == {name: text.decode() for name, text in found.items()}
    for name in ("foc_ahead_q15.h", "foc_tiles.h", "foc_m4_q15.h"):
        assert (tmp_path / name).read_bytes() == (GOLDEN.parents[1] / "c_runtime" / name).read_bytes()
        lines = (tmp_path / name).read_text(encoding="ascii").splitlines()
        assert max(map(len, lines)) <= 112 and all(line == line.rstrip() for line in lines)
    assert max(map(len, found["finger_m4.c"].decode().splitlines())) <= 110


@pytest.mark.parametrize(
    "form, name",
    [
        pytest.param(form, name, marks=() if turn % 2 == i and form != "exp_f32" else pytest.mark.long)
        for turn, form in enumerate(FORMS)
        for i, name in enumerate(("gcc", "clang"))
    ],
)
def test_it_compiles_without_a_warning(name, form, tmp_path):
    command = compiler(name)
    generated(form, tmp_path)
    source = tmp_path / f"finger_{arithmetic(form)}.c"
    for level in ("-O0", "-O2"):
        run(*command, *STRICT, level, "-c", source, "-o", tmp_path / "x.o")
    example = tmp_path / "example" / "main.c"
    run(*command, *STRICT, "-I", tmp_path, example, source, "-o", tmp_path / "example.exe")
    assert len(run(tmp_path / "example.exe").splitlines()) == 10


def test_the_header_serves_cpp(tmp_path):
    """Alone, and ahead of every other header."""
    generated("q31", tmp_path)
    (tmp_path / "use.cpp").write_text(
        '#include "finger_q31.h"\nfinger_q31_state s;\nvoid f() { finger_q31_init(&s); }\n'
    )
    run(
        *compiler("g++"),
        "-std=c++11",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-c",
        tmp_path / "use.cpp",
        "-o",
        tmp_path / "x.o",
    )
    assert "finger_q31_init" in run(tool("nm"), tmp_path / "x.o").split()


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    """Where a form is that a process with another seed for its hashes has made, from another place: together
    with the others of its memory."""

    @functools.cache
    def made(exponential: bool) -> Path:
        folder = tmp_path_factory.mktemp("elsewhere")
        make_there(folder, [form for form in FORMS if form.startswith("exp") == exponential])
        return folder / "three"

    return lambda form: made(form.startswith("exp")) / form


def make_there(folder: Path, forms: list[str]) -> None:
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    environment = {**os.environ, "PYTHONHASHSEED": "12345", "TZ": "Asia/Tokyo", "PYTHONPATH": path}
    command = [sys.executable, "-m", "tests.every_form", "three", *forms]
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)


@pytest.mark.parametrize(
    "form", [pytest.param(f, marks=pytest.mark.long if f.startswith("exp") else ()) for f in FORMS]
)
def test_the_same_input_gives_the_same_bytes(form, elsewhere, tmp_path):
    """Twice here, and once there."""
    first, second = generated(form, tmp_path / "one"), generated(form, tmp_path / "two" / "deep")
    assert first == second
    assert {name: (elsewhere(form) / name).read_bytes() for name in first} == first


def test_nothing_in_the_text_tells_when_or_where(tmp_path):
    for name, content in generated("q15", tmp_path).items():
        assert str(tmp_path).encode() not in content and str(GOLDEN).encode() not in content, name
        assert b"202" not in content.replace(b"Copyright (c) 2026", b"") or name.endswith(
            (".c", ".json", ".md")
        ), name


@pytest.mark.parametrize("form", FORMS)
def test_c_is_plain_ascii_in_lines_of_bearable_length(form, tmp_path):
    for name, content in generated(form, tmp_path).items():
        if name.endswith((".c", ".h")):
            lines = content.decode("ascii").splitlines()
            assert max(map(len, lines)) <= 110, max(lines, key=len)
            assert all(line == line.rstrip() for line in lines), name
            assert "\n\n\n" not in content.decode() and "\t" not in content.decode()
