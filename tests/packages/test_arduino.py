"""The Arduino library: the linter's published rules, the sketch on this computer, and Arduino's own builder.

The linter itself is a program that no package index brings, so its rules are restated here, by the numbers
that it publishes them under; the rules that need the internet (dead addresses, names that are taken) are not.

Red when the library breaks a rule of Arduino's, or its builder refuses it.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from urllib.parse import urlparse

import numpy as np
import pytest

import focgen
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.scenario import Scenario
from focgen.verification.folder import read_folder
from tests.c_code import EXACT, compiler, run, tool
from tests.controllers import seed_controller, simple

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CATEGORIES = """Display, Communication, Signal Input/Output, Sensors, Device Control, Timing, Data Storage,
    Data Processing, Other""".replace("\n    ", " ").split(", ")
FIELDS = set(
    "name version author maintainer sentence paragraph category url architectures includes depends".split()
)
SEMVER = r"(0|[1-9]\d*)\.(0|[1-9]\d*)\.(0|[1-9]\d*)"
ALMOST = {  # spellings that the linter takes for a slip
    "library.properties": r"(?i)librar(y|ie)s?[.\-_]?propert(y|ie)s?",
    "extras": r"(?i)extra",
    "examples": r"(?i)e((x)|(xs)|(s))((am)|(ma))p((le)|(el))s?",
}


@pytest.fixture
def library(tmp_path) -> Path:
    focgen.generate(seed_controller(40), tmp_path / "spba", "q15", for_="arduino", selftest=True)
    return tmp_path / "spba"


def properties(library: Path) -> dict[str, str]:
    lines = (library / "library.properties").read_text().splitlines()
    return dict(line.split("=", 1) for line in lines if line and not line.startswith("#"))


def faults(library: Path) -> list[str]:
    """The numbers of the linter's rules that a folder breaks."""
    given, inside = properties(library), [p.relative_to(library).as_posix() for p in library.rglob("*")]
    top, headers = {name.split("/")[0] for name in inside}, {p.name for p in (library / "src").rglob("*.h")}
    name, sketches = given.get("name", ""), [p for p in inside if p.endswith((".ino", ".pde"))]
    rules = {
        "LS001 a header in src": bool(headers),
        "LS002, LS003 the folder's name": re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.\-]{0,62}", library.name),
        "LS004 no submodule": ".gitmodules" not in top,
        "LS005 no links": not any((library / path).is_symlink() for path in inside),
        "LS006 not in development": ".development" not in top,
        "LS007 no programs": not any(path.endswith(".exe") for path in inside),
        "LS008 a header of its name": f"{name}.h" in headers,
        "LS009 src in lower case": [one for one in top if one.lower() == "src"] == ["src"],
        "LS010 src without utility": "utility" not in top,
        "LS011, LS012, LP002, LP003, LD005 names": all(
            one == right or not re.fullmatch(slip, one) for one in top for right, slip in ALMOST.items()
        ),
        "LP001, LP004 one library.properties": [p for p in inside if "library.prop" in p]
        == ["library.properties"],
        "LP006 no field but the known ones": set(given) <= FIELDS,
        "LP007, LP008, LP009, LP011 name": re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 _.\-]{0,62}", name),
        "LP010 a short name": len(name) <= 32,
        "LP012, LP014 Arduino's names": "arduino" not in name.lower(),
        "LP015, LP016 no spaces, no library": not re.search(r"(?i)\s|library", name),
        "LP019, LP020, LP021 version": re.fullmatch(SEMVER, given.get("version", "")),
        "LP023, LP024 author": given.get("author"),
        "LP025 to LP030, LP057 maintainer": re.match(r"(?i)(?!.*arduino).+", given.get("maintainer", "")),
        "LP031, LP032 sentence": given.get("sentence"),
        "LP034 paragraph": "paragraph" in given,
        "LP036 paragraph adds to the sentence": not given["paragraph"].startswith(given["sentence"]),
        "LP037, LP038, LP039 category": given.get("category") in CATEGORIES,
        "LP040, LP041, LP056 url": urlparse(given.get("url", "")).scheme in ("http", "https"),
        "LP043 to LP046 architectures": given.get("architectures") == "*",
        "LP051, LP052 includes": set(given.get("includes", "").split(",")) <= headers,
        "a readme": any(one.lower().startswith("readme") for one in top),
        "a licence": any(one.lower().startswith("licen") for one in top),
        "LD003 sketches in examples": all(path.startswith(("examples/", "extras/")) for path in sketches),
        "SS001 sketches named as their folder": all(Path(p).stem == Path(p).parent.name for p in sketches),
    }
    return [rule for rule, holds in rules.items() if not holds]


def test_the_linters_rules_hold(library):
    assert faults(library) == [] and list(library.rglob("*.ino"))
    (library / "example").mkdir()
    (library / "library.properties").write_text("name=my Arduino thing\nsentence=a\nparagraph=ab\n")
    assert len(faults(library)) > 10


def test_what_the_editor_colours(library):
    lines = [line.split("\t") for line in (library / "keywords.txt").read_text().splitlines()]
    kinds = {line[0]: line[1] for line in lines if len(line) == 2}
    assert kinds["spba_state"] == "KEYWORD1" and kinds["spba_step"] == "KEYWORD2"
    assert kinds["SPBA_U_MAX"] == "LITERAL1" and "spba_selftest" not in lines


def test_a_name_of_arduinos_is_refused(tmp_path):
    with pytest.raises(focgen.FocgenError, match="--name"):
        focgen.generate(seed_controller(9), tmp_path / "out", name="my_Arduino", for_="arduino")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("step", [1e-7, 4000.1, 5000.0, 1e9])
def test_a_sample_time_that_a_board_cannot_count_is_refused(tmp_path, step):
    """5000 s were 705 s in 32 bits of microseconds."""
    made = simple(TransferFunction([(1.0, 0.0)]), sample_time=step)
    with pytest.raises(focgen.FocgenError, match="by the board's count of microseconds"):
        focgen.generate(made, tmp_path / "out", "q15", for_="arduino")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("step", "period"),
    [
        (4000.0, "SIMPLE_PERIOD_US"),
        (20.0000004, "20000000UL"),
        (20.0000006, "20000001UL"),
        (1e-6, "SIMPLE_P"),
    ],
)
def test_the_period_is_the_sample_time(tmp_path, step, period):
    made = simple(TransferFunction([(1.0, 0.0)]), sample_time=step)
    focgen.generate(made, tmp_path / "simple", "q15", for_="arduino")
    sketch = (tmp_path / "simple" / "examples" / "simple" / "simple.ino").read_text()
    assert f"PERIOD_US = {period}" in sketch


def test_verify_and_load_take_the_folder(library):
    read = read_folder(library)
    assert read.differences == () and read.notes == ()
    assert focgen.verify(library, 50).holds and focgen.load(library).step(0.01, 0.0, 0.1) > 0.0
    (library / "src" / "spba.c").write_text('#include "../mine.c"\n')
    (library / "examples" / "spba" / "spba.ino").write_text("// mine\n")
    read = read_folder(library)
    assert len(read.differences) == 1 and read.differences[0].startswith("src/spba.c: ")
    assert read.notes == ("examples/spba/spba.ino: has been edited",)


BOARD = """
#include <stdint.h>
#define A0 14
#define OUTPUT 1
void pinMode(int pin, int mode);
int analogRead(int pin);
void analogWrite(int pin, int value);
uint32_t micros(void);
"""
HARNESS = """
#include <stdio.h>
#include "board.h"
#include "sketch.ino"
static uint32_t now = 4294000000u;  /* the clock runs over soon */
static int reads;
void pinMode(int pin, int mode) { if (pin != 9 || mode != OUTPUT) printf("wrong pin\\n"); }
int analogRead(int pin) { return pin == A0 ? (reads++ * 37) % 1024 : -1; }
void analogWrite(int pin, int value) { printf("%d %d\\n", pin == 9 ? value : -1, (int)(now / 1000u % 10u)); }
uint32_t micros(void) { return now; }
int main(void) { setup(); for (int k = 0; k < 1500; k++) { loop(); now += 1000; } return 0; }
"""


@pytest.mark.parametrize("arithmetic", ("q15", pytest.param("q31", marks=pytest.mark.long), "f32"))
def test_the_sketch_drives_the_pin_as_the_reference_would(arithmetic, tmp_path):
    """Compiled as C++ with a board of ours: a loop every millisecond takes a sample every tenth time."""
    controller, folder = seed_controller(40), tmp_path / "spba"
    focgen.generate(controller, folder, arithmetic, for_="arduino")
    (tmp_path / "board.h").write_text(BOARD)
    (tmp_path / "main.cpp").write_text(HARNESS)
    shutil.copy(folder / "examples/spba/spba.ino", tmp_path / "sketch.ino")
    cxx = compiler("g++", source="int main() { return 0; }")
    run(*compiler("gcc"), *EXACT, "-c", folder / "src/spba.c", "-o", tmp_path / "spba.o")
    flags = ["-Wall", "-Werror", "-I", folder / "src", "-I", tmp_path]
    run(*cxx, *flags, tmp_path / "main.cpp", tmp_path / "spba.o", "-o", tmp_path / "sketch")
    found = [int(line.split()[0]) for line in run(tmp_path / "sketch").splitlines()]
    assert found == expected(build_plan(controller, arithmetic), len(found)) and len(found) == 149
    assert len(set(found)) > 20


def expected(plan, samples: int) -> list[int]:
    """The duty cycles that the reference's outputs are, from what the board reads."""
    part = np.array([k * 37 % 1024 for k in range(samples)])
    spans = plan.measurement, plan.reference, plan.schedule.signal
    if plan.floating:
        reach, one = plan.controller.ranges, np.float32
        low, high = map(one, reach.measurement)
        meas = low + (high - low) * part.astype(one) / one(1023)
        ref, sched = one(sum(reach.reference) / 2), one(sum(reach.schedule) / 2)
    else:
        parts = part, 512, 512
        meas, ref, sched = (s.low + (s.high - s.low) * p // 1023 for s, p in zip(spans, parts))
    rows = [np.broadcast_to(np.asarray(value), (1, samples)).copy() for value in (ref, meas, sched)]
    u, low, high = execute(plan, Scenario(*rows)).u[0], plan.output.low, plan.output.high
    if plan.floating:
        span = np.float32(high) - np.float32(low)
        return [int(np.float32(255) * ((v - np.float32(low)) / span)) for v in u]
    return [255 * (int(v) - low) // (high - low) for v in u]


@pytest.mark.parametrize(
    "sketch", (Path("examples/spba/spba.ino"), EXAMPLES / "arduino" / "arduino.ino"), ids=lambda p: p.stem
)
def test_arduinos_builder_makes_a_program_for_an_uno(sketch, tmp_path):
    """With the library found through its properties, the sketch's prototypes made, and warnings asked for."""
    builder, hardware = tool("arduino-builder"), Path("/usr/share/arduino/hardware")
    tool("avr-gcc")
    if not hardware.is_dir():
        pytest.skip("the core of the AVR boards (arduino-core-avr) is not on this machine")
    folder = tmp_path / "libraries" / "spba"
    focgen.generate(EXAMPLES / "controller.toml", folder, "q15", "exponential", for_="arduino")
    (tmp_path / "build").mkdir()
    own = Path("/usr/share/arduino-builder")
    said = run(
        *(builder, "-compile", "-verbose", "-warnings", "all", "-fqbn", "arduino:avr:uno"),
        *("-hardware", hardware, "-hardware", own, "-tools", own, "-libraries", tmp_path / "libraries"),
        *("-build-path", tmp_path / "build", "-prefs", "runtime.tools.avr-gcc.path=/usr"),
        *("-prefs", "compiler.cpp.extra_flags=-DDECIMAL_DIG=__DECIMAL_DIG__"),  # GCC 5 with a newer core
        sketch if sketch.is_file() else folder / sketch,
    )
    assert "Using library spba" in said and "Sketch uses" in said
    assert (tmp_path / "build" / f"{sketch.name}.hex").stat().st_size > 1000
