"""FMUs: valid by FMPy, bound to the standard's own headers, and the reference's samples in every bit.

Red when an FMU is not valid, or one sample of it differs from the reference.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

import focgen
from focgen.cli.main import main
from focgen.control.controller import Tunable, Units
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.scenario import Params, Reset, Scenario, Tune, physical_trace, to_raw
from focgen.verification.folder import read_folder
from tests.build_tools import build_tool
from tests.c_code import STRICT, compiler, run, tool
from tests.controllers import seed_controller, simple

STEP = 0.01
UNITS = Units("1/mm", "V", "bar")
FILTER = simple(TransferFunction([(1.0, 0.5)], [(0.2, 0.7), (1.0, 0.0)]), name="filter")
CASES = {
    "f64, FMI 2": (seed_controller(40, units=UNITS), "f64", 2),
    "f32, FMI 3": (seed_controller(40, units=UNITS), "f32", 3),
    "q31, FMI 3": (seed_controller(40, units=UNITS), "q31", 3),
    "q15, FMI 2": (FILTER, "q15", 2),
}


@pytest.fixture(scope="module")
def fmpy():
    return pytest.importorskip("fmpy", reason="FMPy is not installed: pip install 'focgen[fmu]'")


def inputs(controller, samples: int) -> np.ndarray:
    """A table over time that leaves the ranges now and then; a row a sample."""
    rng = np.random.default_rng(7)
    reach = controller.ranges
    spans = {"ref": reach.reference, "meas": reach.measurement}
    spans |= {"sched": reach.schedule} if reach.schedule else {}
    found = np.zeros(samples + 1, dtype=[("time", float), *((name, float) for name in spans)])
    found["time"] = np.arange(samples + 1) * STEP
    for name, (low, high) in spans.items():
        found[name] = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), samples + 1)
    return found


def held(table: np.ndarray) -> np.ndarray:
    """The same time, every other column at what it is in one row: no interpolation changes that."""
    for name in table.dtype.names[1:]:
        table[name] = table[name][3]
    return table


def reference(plan, table, resets=(), tunes=()):
    """Outputs and flags of the bit-true reference for the samples of a table but the last row."""
    rows = {name: table[name][None, :-1] for name in table.dtype.names[1:]}
    scenario = Scenario(
        rows["ref"], rows["meas"], rows.get("sched"), resets=tuple(resets), tunes=tuple(tunes)
    )
    trace = physical_trace(plan, execute(plan, to_raw(plan, scenario)))
    return np.asarray(trace.u[0], dtype=float), trace.flags[0]


def made(tmp_path: Path, controller, arithmetic: str, fmi: int) -> Path:
    focgen.generate(controller, tmp_path, arithmetic, for_="fmu", fmi=fmi)
    return tmp_path / f"{controller.name}.fmu"


def simulated(fmpy, path: Path, table, **options):
    given = dict(stop_time=table["time"][-1], output_interval=STEP, input=table, output=["u", "flags"])
    return fmpy.simulate_fmu(str(path), validate=True, **{**given, **options})


@pytest.mark.parametrize(
    "case",
    [c if "f32" in c or "q15" in c else pytest.param(c, marks=pytest.mark.long) for c in CASES],
)
def test_it_is_valid_and_simulates_to_the_references_samples(fmpy, case, tmp_path):
    from fmpy.validation import validate_fmu

    controller, arithmetic, fmi = CASES[case]
    path, table = made(tmp_path, controller, arithmetic, fmi), inputs(controller, 150)
    assert validate_fmu(str(path)) == []
    found = simulated(fmpy, path, table)
    u, flags = reference(build_plan(controller, arithmetic), table)
    assert len(np.unique(u)) > 20 and found["u"][1:].tobytes() == u.tobytes()
    assert found["flags"][1:].tolist() == flags.tolist()
    description = fmpy.read_model_description(str(path))
    units = {v.name: v.unit for v in description.modelVariables if v.unit}
    assert units == (
        {"ref": "1/mm", "meas": "1/mm", "sched": "bar", "u": "V", "u0": "V"} if "spba" in path.name else {}
    )


@pytest.mark.parametrize("fmi", (2, 3))
def test_the_samples_do_not_depend_on_the_communication_step(fmpy, fmi, tmp_path):
    """Constant inputs; steps of a quarter and of three sample times, from a start that is not 0."""
    controller = seed_controller(40)
    path, table = made(tmp_path, controller, "q31", fmi), held(inputs(controller, 30))
    u, _ = reference(build_plan(controller, "q31"), table)
    start = dict(zip(table.dtype.names[1:], list(table[0])[1:]))
    for part in (0.25, 3.0):
        found = fmpy.simulate_fmu(
            str(path),
            start_time=5.0,
            stop_time=5.3,
            output_interval=part * STEP,
            start_values=start,
            output=["u"],
        )
        taken = np.ceil((found["time"][1:] - 5.0) / STEP - 1e-3).astype(int)
        assert taken[-1] == 30 and found["u"][1:].tolist() == u[taken - 1].tolist()


@pytest.mark.parametrize("fmi", (2, 3))
def test_it_starts_without_a_bump_and_returns_to_a_kept_state(fmpy, fmi, tmp_path):
    controller = seed_controller(40)
    path, table = made(tmp_path, controller, "f64", fmi), held(inputs(controller, 40))
    u, _ = reference(
        build_plan(controller, "f64"), table, [Reset(0, 0, table["ref"][0], table["meas"][0], 4.5)]
    )
    values = {"reset": True, "u0": 4.5}
    found = simulated(fmpy, path, table, start_values=values)
    assert found["u"][0] == 4.5 and found["u"][1:].tolist() == u.tolist()
    folder = fmpy.extract(str(path))
    unit = fmpy.instantiate_fmu(folder, fmpy.read_model_description(folder))
    half = simulated(
        fmpy, folder, table, start_values=values, fmu_instance=unit, stop_time=0.2, terminate=False
    )
    kept = unit.getFMUState() if fmi == 3 else unit.getFMUstate()
    assert half["u"].tolist() == found["u"][:21].tolist()
    for _ in range(2):
        rest = simulated(
            fmpy, folder, table, fmu_instance=unit, start_time=0.2, initialize=False, terminate=False
        )
        assert rest["u"][1:].tolist() == found["u"][21:].tolist()
        (unit.setFMUState if fmi == 3 else unit.setFMUstate)(kept)


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.long), 3])
def test_fmpy_makes_the_same_block_of_its_sources(fmpy, fmi, tmp_path, monkeypatch):
    """For a computer that the archive has no binary for: the description lists what is to be compiled."""
    from fmpy.build import build_platform_binary

    monkeypatch.setenv("PATH", str(Path(build_tool("cmake")).parent), prepend=os.pathsep)
    folder, table = tmp_path / "unpacked", inputs(FILTER, 30)
    path = made(tmp_path, FILTER, "q15", fmi)
    expected = simulated(fmpy, path, table)
    fmpy.extract(str(path), str(folder))
    shutil.rmtree(folder / "binaries")
    build_platform_binary(folder)
    assert list((folder / "binaries").rglob("filter.*"))
    assert simulated(fmpy, folder, table)["u"].tolist() == expected["u"].tolist()


@pytest.mark.parametrize(("arithmetic", "fmi"), [("q15", 2), ("f32", 3)])
def test_parameters_change_between_samples(fmpy, arithmetic, fmi, tmp_path):
    """Of a tunable controller, against the reference; what is outside the box changes nothing."""
    from fmpy.validation import validate_fmu

    controller = seed_controller(30, tunable=Tunable((0.5, 2.0), (0.0, 1.0), (5.0, 10.0)))
    focgen.generate(controller, tmp_path, arithmetic, for_="fmu", fmi=fmi, tunable=True)
    path, table = tmp_path / "spba.fmu", inputs(controller, 90)
    assert validate_fmu(str(path)) == []
    unit, number = instantiated(fmpy, path)
    put, get = (unit.setFloat64, unit.getFloat64) if fmi == 3 else (unit.setReal, unit.getReal)
    put([number["u_max"], number["gain_5"]], [6.0, 0.5])
    unit.exitInitializationMode()
    found = []
    for k in range(90):
        put([number[name] for name in table.dtype.names[1:]], list(table[k])[1:])
        if k == 30:
            put([number["gain_2"], number["u_min"]], [1.75, 0.5])
            with pytest.raises(Exception, match="rror"):
                put([number["gain_3"]], [2.5])
            assert get([number["gain_3"], number["gain_2"], number["u_max"]]) == [1.0, 1.75, 6.0]
        unit.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
        found += get([number["u"]])
    first = Params((*[1.0] * 4, 0.5, *[1.0] * 4), 0.0, 6.0)
    second = Params((1.0, 1.75, 1.0, 1.0, 0.5, *[1.0] * 4), 0.5, 6.0)
    plan = build_plan(controller, arithmetic, tunable=True)
    u, _ = reference(plan, table, tunes=[Tune(0, 0, first), Tune(0, 30, second)])
    other, _ = reference(plan, table, tunes=[Tune(0, 0, first)])
    assert found == u.tolist() and found != other.tolist()


def instantiated(fmpy, path):
    """The unit in its initialisation, and the numbers of its variables."""
    folder = fmpy.extract(str(path))
    description = fmpy.read_model_description(folder)
    unit = fmpy.instantiate_fmu(folder, description)
    if description.fmiVersion == "2.0":
        unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    return unit, {variable.name: variable.valueReference for variable in description.modelVariables}


def test_another_token_is_refused(fmpy, tmp_path):
    folder = fmpy.extract(str(made(tmp_path, FILTER, "q15", 3)))
    description = fmpy.read_model_description(folder)
    description.guid = description.instantiationToken = "{another}"
    with pytest.raises(Exception, match="instantiate"):
        fmpy.instantiate_fmu(folder, description)


@pytest.mark.parametrize(
    "fmi, arithmetic",
    [
        (2, "q15"),
        (3, "f32"),
        *(pytest.param(*one, marks=pytest.mark.long) for one in ((2, "f32"), (3, "q15"))),
    ],
)
def test_the_functions_are_those_of_the_standards_headers(fmpy, arithmetic, fmi, tmp_path):
    """Compiled with the standard's declarations in front of it, and without, warnings being errors."""
    made(tmp_path, FILTER if fmi == 2 else seed_controller(9, name="filter"), arithmetic, fmi)
    source = tmp_path / "fmu" / f"filter_fmi{fmi}.c"
    headers = Path(fmpy.__file__).parent / "c-code"
    flags = [*STRICT, "-Wno-unused-parameter", "-Wno-missing-prototypes", "-I", tmp_path, "-c", source]
    run(*compiler("gcc"), *flags, "-o", tmp_path / "own.o")
    theirs = ["-isystem", headers, "-include", f"fmi{fmi}Functions.h", "-Wno-strict-prototypes"]
    run(*compiler("gcc"), *theirs, *flags, "-o", tmp_path / "theirs.o")
    declared = (headers / f"fmi{fmi}FunctionTypes.h").read_text().partition("Types for Functions for FMI2")
    wanted = set(re.findall(r"\b(fmi\d\w+)TYPE\b", declared[0]))
    if fmi == 2:  # a block for co-simulation has no functions of model exchange
        wanted |= set(re.findall(r"\b(fmi\d\w+)TYPE\b", declared[2].partition("Co-Simulation")[2]))
    assert max(map(len, source.read_text().splitlines())) <= 110
    defined = set(run(tool("nm"), "--defined-only", "-j", tmp_path / "own.o").split())
    assert len(wanted) >= (34 if fmi == 2 else 70) and wanted - defined == set()


def test_texts_of_a_user_are_those_of_the_description(fmpy, tmp_path):
    title, unit = 'a <"&> \u00b5\tb', 'V"<&>'
    controller = seed_controller(9, name=title, units=Units("1/mm", unit, "bar"))
    focgen.generate(controller, tmp_path, "q15", name="odd", for_="fmu")
    description = fmpy.read_model_description(str(tmp_path / "odd.fmu"), validate=True)
    assert description.modelName == 'a <"&> \u00b5 b'
    assert {v.unit for v in description.modelVariables if v.name == "u"} == {unit}


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    "units",
    [
        pytest.param(("V", "V ", "bar"), marks=pytest.mark.long),
        ("1/mm", " ", "bar"),
        pytest.param(("a\x01", "a\x02", "a?"), marks=pytest.mark.long),
    ],
)
def test_units_that_look_alike_are_one(fmpy, tmp_path, fmi, units):
    """Two of one name are no valid description."""
    from fmpy.validation import validate_fmu

    focgen.generate(seed_controller(9, units=Units(*units)), tmp_path, "q31", name="fin", for_="fmu", fmi=fmi)
    assert validate_fmu(str(tmp_path / "fin.fmu")) == []
    found = fmpy.read_model_description(str(tmp_path / "fin.fmu")).unitDefinitions
    names = [unit.name for unit in found]
    assert len(names) == len(set(names)) and all(names)


def test_the_same_input_gives_the_same_bytes(tmp_path):
    one = made(tmp_path / "a", FILTER, "q31", 3).read_bytes()
    assert one == made(tmp_path / "b", FILTER, "q31", 3).read_bytes()
    with zipfile.ZipFile(tmp_path / "a" / "filter.fmu") as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def changed(path: Path, name: str, content) -> None:
    """Write the archive anew with another content of one file (bytes, or what makes them of the former), or
    without it.
    """
    with zipfile.ZipFile(path) as archive:
        inside = {entry: archive.read(entry) for entry in archive.namelist()}
    inside[name] = content(inside[name]) if callable(content) else content
    with zipfile.ZipFile(path, "w") as archive:
        for entry, data in inside.items():
            if data is not None:
                archive.writestr(entry, data)


def hidden(path: Path, name: str, content: bytes) -> None:
    """Write the archive anew as it is packed, with one more member before all others."""
    with zipfile.ZipFile(path) as archive:
        inside = [(entry.filename, archive.read(entry)) for entry in archive.infolist()]
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        warnings.simplefilter("ignore")  # of names that are there already
        for entry, data in [(name, content), *inside]:
            archive.writestr(entry, data)


DAMAGED = {
    "files of the same name": lambda path: hidden(path, "modelDescription.xml", b"<mine/>"),
    "do not belong to it": lambda path: hidden(path, "binaries/../../mine.so", b"mine"),
    "bytes that are no part": lambda path: path.write_bytes(path.read_bytes() + b"mine"),
    "that are no part of its files": lambda path: path.write_bytes(b"#!/bin/sh\n" + path.read_bytes()),
    "sources/filter.c is not what": lambda path: changed(path, "sources/filter.c", b"/* mine */"),
    "sources/filter.h is not what": lambda path: changed(path, "sources/filter.h", bytes.swapcase),
    "lacks modelDescription.xml": lambda path: changed(path, "modelDescription.xml", None),
    "files that do not belong": lambda path: changed(path, "sources/mine.c", b""),
    "is no zip": lambda path: path.write_bytes(b"PK mine"),
    "zip that can be read": lambda path: path.write_bytes(
        bytes(b ^ (i == 200) for i, b in enumerate(path.read_bytes()))
    ),
}


def test_verify_tells_where_the_archive_was_edited(tmp_path, capsys):
    path = made(tmp_path, FILTER, "q15", 2)
    assert main(["verify", str(tmp_path), "--samples", "50"]) == 0
    assert "its binary was not compared" in capsys.readouterr().out
    sound = path.read_bytes()
    for says, damage in DAMAGED.items():
        path.write_bytes(sound)
        damage(path)
        assert any(says in line for line in read_folder(tmp_path).differences), says
    assert main(["verify", str(tmp_path)]) == 1
    path.unlink()
    assert read_folder(tmp_path).notes == ("filter.fmu: is missing",)


def test_verify_names_edited_c_of_the_interface(tmp_path):
    made(tmp_path, FILTER, "q15", 3)
    source = tmp_path / "fmu" / "filter_fmi3.c"
    source.write_text(source.read_text().replace("1e-6", "1e-5"))
    assert any("fmu/filter_fmi3.c: is not what" in line for line in read_folder(tmp_path).differences)


def test_the_example_runs_its_loop(fmpy, tmp_path):
    examples = Path(__file__).resolve().parents[2] / "examples"
    focgen.generate(examples / "controller.toml", tmp_path, for_="fmu")
    lines = run(sys.executable, examples / "fmu" / "loop.py", tmp_path / "spba.fmu").splitlines()
    reached = [float(line.split()[4]) for line in lines]
    assert len(reached) == 5 and reached == sorted(reached) and 0.0095 < reached[-1] < 0.01


def test_without_a_compiler_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(focgen.FocgenError, match="no-such-compiler"):
        made(tmp_path / "out", FILTER, "q15", 3)
    assert not (tmp_path / "out").exists()
