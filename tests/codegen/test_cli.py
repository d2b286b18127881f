"""``focgen generate``: what it refuses, in one line and without a trace; what an installed wheel does.

Red when an option that cannot be used is taken, or the wheel lacks a template.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

import focgen
from focgen.cli.main import main
from focgen.codegen.generate import generate
from focgen.codegen.literals import constant, literal, power_of_two, rows
from focgen.codegen.names import check_name
from focgen.codegen.texts import comment
from focgen.errors import FocgenError, InputError
from tests.c_code import STRICT, compiler, run
from tests.controllers import seed_controller

ROOT = Path(__file__).parents[2]
FINGER = ROOT / "tests" / "golden" / "finger.toml"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--length", "0"], "at least 1 sample"),
        (["--length", "-3"], "at least 1 sample"),
        (["--length", "many"], "invalid int value"),
        (["--length", "65535"], "at most 65534"),
        (["--arithmetic", "q7"], "invalid choice"),
        (["--memory", "exponential", "--length", "40"], "--tolerance and --horizon"),
        (["--memory", "exponential", "--tolerance", "1e-9"], "1e-08 to 0.1"),
        (["--memory", "exponential", "--tolerance", "nan"], "1e-08 to 0.1"),
        (["--memory", "exponential", "--horizon", "99"], "100 to 100000000"),
        (["--memory", "exponential", "--horizon", "1e5"], "invalid int value"),
        (["--memory", "eternal"], "invalid choice"),
        (["--target", "z80"], "cortex-m4"),
        (["--for", "zephyr"], "docs/packages.md"),
        (["--for", "cmake", "--for", "fmu"], "into a folder of its own"),
        (["--fmi", "2"], "add that"),
        (["--for", "cmake", "--fmi", "3"], "--for fmu"),
        (["--for", "fmu", "--fmi", "1"], "invalid choice"),
        (["--for", "matlab"], "choose one of plain, cmake"),
        (["--tolerance", "1e-3"], "--length"),
        (["--horizon", "100"], "--length"),
        (["--name", "while"], "is a keyword"),
        (["--name", "_x"], "underscore"),
        (["--name", "my-rig"], "--name my_rig"),
        (["--name", "7up"], "--name c7up"),
        (["--name", "stdint"], "hide the header stdint.h"),
        (["--name", "FOC_RT"], "the runtime begin with foc_"),
        (["--name", ""], "--name"),
        (["--name", "größe"], "is no C identifier"),
    ],
)
def test_unusable_options_are_one_line(options, says, tmp_path, capsys):
    assert main(["generate", str(FINGER), "--out", str(tmp_path / "out"), *options]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1 and captured.err.startswith("focgen: error: ")
    assert says in captured.err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("line", "instead", "says"),
    [
        ("sample_time = 0.01", "sample_time = nan", "sample_time"),
        ("sample_time = 0.01", "sample_time = -1.0", "above 0"),
        ("length = 40", "length = 0", "length"),
        ('name = "finger"', 'name = "my finger"', "--name my_finger"),
        ("num = [[0.4, 0.6], [1.0, 0.0], [0.5, -0.4]]", "num = []", "num"),
        ("num = [[0.4, 0.6], [1.0, 0.0], [0.5, -0.4]]", "num = [[1.0, -3.0]]", "integrates more than once"),
        ("den = [[0.05, 0.9], [1.0, 0.0]]", "den = [[-0.05, 0.9], [1.0, 0.0]]", "stable"),
        ("output = [0.0, 10.0]", "output = [10.0, 0.0]", "low < high"),
        ("output = [0.0, 10.0]", "output = [1e50, 2e50]", "finger"),
        ("reference = [0.0, 0.02]", "reference = [1e9, 1.0000001e9]", "counts"),
        ("gains = [500.0, 420.0, 350.0]", "gains = [500.0, 420.0]", "2 values for 3"),
        ("integrator = true", "integrater = true", "integrater"),
        ("integrator = true", 'integrator = true\nmemory = "eternal"', "memory"),
        ("integrator = true", 'integrator = true\nmemory = "exponential"\ntolerance = 1e-12', "tolerance"),
        ("integrator = true", 'integrator = true\nmemory = "exponential"\nhorizon = 5', "horizon"),
        ("[gain]", "[gain", "TOML"),
    ],
)
def test_unusable_controllers_are_one_line(line, instead, says, tmp_path, capsys):
    text = FINGER.read_text()
    assert line in text
    (tmp_path / "c.toml").write_text(text.replace(line, instead))
    assert (
        main(["generate", str(tmp_path / "c.toml"), "--out", str(tmp_path / "out"), "--arithmetic", "q15"])
        == 2
    )
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1 and says in captured.err and not (tmp_path / "out").exists()


@pytest.mark.parametrize("out", ["file", "file/below"])
def test_a_place_that_cannot_be_written(out, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert main(["generate", str(FINGER), "--out", str(tmp_path / out)]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["file"] and (tmp_path / "file").read_text() == "mine"


def test_a_missing_controller(tmp_path, capsys):
    assert main(["generate", str(tmp_path / "none.toml"), "--out", str(tmp_path / "out")]) == 2
    assert "none.toml: cannot be read" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_failure_keeps_what_was_there(tmp_path):
    generate(FINGER, tmp_path, "q15")
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    with pytest.raises(FocgenError):
        generate(FINGER, tmp_path, "q15", length=10**6)
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before


def test_json_is_the_manifest(tmp_path, capsys):
    assert main(["generate", str(FINGER), "--out", str(tmp_path), "--arithmetic", "q31", "--json"]) == 0
    said, manifest = json.loads(capsys.readouterr().out), json.loads((tmp_path / "manifest.json").read_text())
    assert said == manifest
    assert manifest["arithmetic"] == "q31" and manifest["length"] == 40 and manifest["memory"] == "short"
    assert manifest["REF_LSB"] < 0.02 / 2**30 and manifest["U_LSB"] < 10.0 / 2**30
    assert {"operator", "output_per_sample"} <= manifest["error_bound"]["quantisation"].keys()
    assert (
        all(proof["worst"] <= proof["limit"] for proof in manifest["proofs"]) and len(manifest["proofs"]) > 20
    )
    header = (tmp_path / "finger.h").read_text()
    for key in ("REF_LSB", "SCHED_LSB", "U_LSB"):
        value = next(
            line.split()[2] for line in header.splitlines() if line.startswith(f"#define FINGER_{key}")
        )
        assert float(value.rstrip("f")) == manifest[key]


def test_the_function_of_the_package(tmp_path):
    made = focgen.generate(seed_controller(20), tmp_path, "f32", name="paper")
    assert set(made.files) == {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert focgen.read_controller(tmp_path / "controller.toml") == seed_controller(20)


def test_names_that_are_fine():
    for name in ("spba", "Finger_2", "x", "int32", "interrupt"):
        assert check_name(name, "here") == name
    for name in ("typeof", "constexpr", "_Bool", "restrict", "class", "Math", "a b", "a\n", "a*/"):
        with pytest.raises(InputError):
            check_name(name, "here")


# --------------------------------------------------------------------------------------------------- literals


def test_literals_read_back_as_they_were():
    """Through a C compiler's own reading for the awkward ones; through Python's for many."""
    import numpy as np

    rng = np.random.default_rng(0)
    for value in [
        0.0,
        -0.0,
        5e-324,
        1.7976931348623157e308,
        1e22,
        0.1,
        *(rng.normal(size=2000) * 10.0 ** rng.uniform(-300, 300, 2000)),
    ]:
        assert float(literal(float(value), "double")) == value
    singles = np.array(
        [1e-45, 3.4028235e38, 16777216.0, *(rng.normal(size=2000) * 10.0 ** rng.uniform(-38, 38, 2000))],
        np.float32,
    )
    for value in singles:
        text = literal(float(value), "float")
        assert text.endswith("f") and np.float32(text[:-1]) == value and ("." in text or "e" in text)
    assert literal(-(1 << 63), "int64_t") == "(-9223372036854775807 - 1)"
    assert literal(-(1 << 31), "int32_t") == "-2147483648" and constant(-5, "int16_t") == "(-5)"
    for exponent in range(-126, 120):
        assert float(power_of_two(2.0**exponent)[:-1]) == 2.0**exponent
    with pytest.raises(ValueError):
        literal(float("inf"), "double")


def test_extreme_integers_compile(tmp_path):
    values = {"int64_t": -(1 << 63), "int32_t": -(1 << 31), "int16_t": -(1 << 15)}
    text = "".join(f"extern const {t} x{t};\nconst {t} x{t} = {literal(v, t)};\n" for t, v in values.items())
    (tmp_path / "x.c").write_text(f"#include <stdint.h>\n{text}")
    for name in ("gcc", "clang"):
        run(*compiler(name), *STRICT, "-c", tmp_path / "x.c", "-o", tmp_path / "x.o")


@pytest.mark.parametrize(
    "unit", ["1/mm", "µm/°C", "*/ int x; /*", "a\nb", "\\", "what??/", "Ω²", "\x00\x07", "日"]
)
def test_a_comment_stays_a_comment(unit):
    text = comment(unit)
    assert (
        text.isascii()
        and text.isprintable()
        and not any(bad in text for bad in ("*/", "/*", "\n", "\\", "??"))
    )


def test_hostile_names_and_units_compile(tmp_path):
    from dataclasses import replace

    from focgen.control.controller import Units

    units = Units("*/ #error", "V\n#error\\", "µbar??/")
    generate(replace(seed_controller(9), units=units), tmp_path, "q15", name="x")
    run(*compiler("gcc"), *STRICT, "-c", tmp_path / "x.c", "-o", tmp_path / "x.o")


def test_tables_are_rows_of_eight():
    assert [len(row.split()) for row in rows(range(19), "int32_t")] == [8, 8, 3]
    assert [len(row.split()) for row in rows([0.1] * 9, "double")] == [4, 4, 1]


# ------------------------------------------------------------------------------------------------------ wheel


@pytest.mark.long
def test_an_installed_wheel_generates_the_same_bytes(tmp_path):
    """Built from the checkout, installed into an environment of its own, run from an empty folder."""
    wheels, home, empty = (tmp_path / name for name in ("wheels", "home", "empty"))
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", ROOT, "-w", wheels)
    venv.create(home, with_pip=False)
    (wheel,) = wheels.glob("focgen-*.whl")
    inside = set(zipfile.ZipFile(wheel).namelist())
    for folder in ("templates", "c_runtime", "examples"):
        files = [p.relative_to(ROOT).as_posix() for p in (ROOT / folder).rglob("*") if p.is_file()]
        assert files and {f"focgen/_shipped/{name}" for name in files} <= inside
    c = {p.relative_to(ROOT).as_posix() for p in (ROOT / "focgen").rglob("*.[ch]")}
    assert "focgen/rig/kernels.c" in c and len(c) > 5 and c <= inside
    run(
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--target",
        home / "focgen-only",
        wheel,
    )
    empty.mkdir()
    # the libraries of the environment that tests, the package of the wheel
    libraries = [p for p in sys.path if "site-packages" in p]
    bare = {**os.environ, "PYTHONPATH": os.pathsep.join([str(home / "focgen-only"), *libraries])}
    code = (
        "import focgen, sys; from focgen.cli.main import main; "
        "assert focgen.__file__.startswith(sys.argv[1]), focgen.__file__; sys.exit(main(sys.argv[2:]))"
    )
    argv = ["generate", str(FINGER), "--out", "fw", "--arithmetic", "q15"]
    done = subprocess.run(
        [sys.executable, "-S", "-c", code, str(home), *argv],
        cwd=empty,
        env=bare,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    generate(FINGER, tmp_path / "here", "q15")
    expected = {
        p.relative_to(tmp_path / "here"): p.read_bytes()
        for p in (tmp_path / "here").rglob("*")
        if p.is_file()
    }
    assert {
        p.relative_to(empty / "fw"): p.read_bytes() for p in (empty / "fw").rglob("*") if p.is_file()
    } == expected


def test_a_length_is_blamed_on_where_it_stands(tmp_path, capsys):
    made = tmp_path / "long.toml"
    made.write_text(re.sub(r"(?m)^length = \d+", "length = 70000", FINGER.read_text()))
    assert main(["generate", str(made), "--out", str(tmp_path / "out")]) == 2
    assert "long.toml [length]: is 70000" in capsys.readouterr().err
    assert main(["generate", str(made), "--out", str(tmp_path / "out"), "--length", "70000"]) == 2
    assert "--length: is 70000" in capsys.readouterr().err
