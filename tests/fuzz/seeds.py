"""What mutations begin with: small sound inputs of every kind, made here."""

from __future__ import annotations

import gzip
import io
import json
import tomllib
from functools import cache
from pathlib import Path

import numpy as np

from focgen.resources import shipped

_RIG = """name = "small"
sample_time = 0.01
[signals]
time = "t"
command = "u"
pressure = { column = "p", unit = "kPa" }
output = "y"
run = "run"
between = "held"
[units]
command = "V"
pressure = "bar"
output = "1/mm"
[regulator]
num = [[152.48, 0.0]]
den = [[1.0, 2.0], [53.39, 1.0], [1528.0, 0.0]]
delay = 0.02
[actuator]
T = 1.32
alpha = 0.6
gain = [0.0015, 0.345]
offset = 0.001
[sensor]
num = [[10.0, 0.0]]
den = [[1.0, 1.0], [10.0, 0.0]]
[uncertainty]
actuator = { gain = 0.2, time = 0.2, alpha = 0.1 }
[ranges]
command = [0.0, 10.0]
output = [0.0, 0.02]
[[effects]]
name = "hysteresis"
stage = "actuator"
form = "play"
width = 0.01
[identified_from]
options = { delay = true }
files = [{ file = "log.csv", sha256 = "00" }]
"""
_LEAD = """name = "lead"
sample_time = 0.01
length = 20
memory = "exponential"
tolerance = 1e-3
horizon = 1000
arithmetic = "q31"
integrator = true
slew_limit = 5.0
setpoint_filter = 0.2
[transfer]
num = [[1.3, 0.6], [1.0, 0.0]]
den = [[1.0, 0.0]]
[gain]
breakpoints = [0.0, 0.1, 0.25]
gains = [48.0, 42.0, 35.0]
[ranges]
reference = [0.0, 0.02]
measurement = [0.0, 0.02]
output = [0.0, 10.0]
schedule = [0.0, 0.25]
[tunable]
gain = [0.5, 2.0]
output_low = [0.0, 1.0]
[units]
measurement = "1/mm"
output = "V"
schedule = "bar"
[designed_from]
file = "rig.toml"
sha256 = "0"
"""


def rig() -> list[bytes]:
    """Rigs: every key, the example's, a linear plant."""
    linear = '[signals]\ntime = "t"\ncommand = "u"\noutput = "y"\n[actuator]\nnum = [[1.0, 0.0]]\n'
    linear += "den = [[1.0, 1.5], [0.3, 0.5], [1.0, 0.0]]\nbias = 0.5\n"
    example = (shipped("examples") / "rig.toml").read_bytes()
    return [_RIG.encode(), example, f'name = "linear"\nsample_time = 0.05\n{linear}'.encode()]


def controller() -> list[bytes]:
    """Controllers: every key, the example's, a filter with one gain."""
    plain = _LEAD.replace("exponential", "short").replace("tolerance = 1e-3\nhorizon = 1000\n", "")
    head, _, tail = plain.partition("[gain]")
    one = head.replace("length = 20", "length = 9\ngain = 2.5") + "[ranges]" + tail.partition("[ranges]")[2]
    one = one.replace("schedule = [0.0, 0.25]\n", "").partition("[tunable]")[0]
    band = _LEAD.replace("horizon = 1000\n", 'operator = "continuous"\nband = [0.1, 10.0]\n')
    return [_LEAD.encode(), plain.encode(), one.encode(), band.encode()]


def _rows(count: int) -> np.ndarray:
    """Columns t, u, p, y (count, 4) of a step test."""
    time = 0.01 * np.arange(count)
    u = np.where(time > 0.05, 2.0, 0.0)
    lag = np.where(time > 0.05, 1.0 - np.exp(-(time - 0.05) / 0.05), 0.0)
    return np.column_stack([time, u, 10.0 * lag, 0.01 * lag**2])


def text(count: int = 40) -> list[bytes]:
    """Logs in text, in several dialects."""
    rows = _rows(count)
    plain = "t,u,p,y\n" + "".join(",".join(f"{x:.6g}" for x in row) + "\n" for row in rows)
    comma = plain.replace(",", ";").replace(".", ",")
    units = "run\tt\tu\tp\ty\n-\ts\tV\tkPa\t1/mm\n" + "".join(
        "a\t" + "\t".join(f"{x:.5f}" for x in row) + "\n" for row in rows
    )
    stamps = "# instrument\nt,u (V),p [kPa],y,run\n" + "".join(
        f"2026-01-31T12:00:{row[0]:06.3f},{row[1]:g},{row[2]:g},{row[3]:g},{i // 20}\n"
        for i, row in enumerate(rows)
    )
    blanks = "t u p y\n" + "".join("  ".join(f"{x:.4e}" for x in row) + "\n" for row in rows)
    quoted = '"t","u","p","y"\n' + "".join(",".join(f'"{x:.4f}"' for x in row) + "\n" for row in rows)
    holes = plain.replace("\n0.1,2,", "\n0.1,,").replace("\n0.2,", "\n0.25,")
    found = [plain, comma, units, stamps, blanks, quoted, holes]
    return [*(one.encode() for one in found), ("\ufeff" + plain).encode("utf-16"), units.encode("cp1252")]


def lvm() -> list[bytes]:
    """LabVIEW's measurement files: one segment with X values, two without."""
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
    )
    head += "X_Columns\t{}\nTime_Pref\tRelative\n***End_of_Header***\t\n\n"
    segment = (
        "Channels\t2\t\t\nSamples\t12\t12\t\nY_Unit_Label\tV\tmm\t\nX0\t0.0\t0.0\t\nDelta_X\t0.01\t0.01\t\n"
    )
    segment += "***End_of_Header***\t\t\t\nX_Value\tu\ty\tComment\n"
    with_x = "".join(f"{0.01 * i:.3f}\t{i % 3}\t{0.1 * i:.2f}\n" for i in range(12))
    without = "".join(f"\t{i % 3}\t{0.1 * i:.2f}\n" for i in range(12))
    two = head.format("No") + (segment + without + "\n") * 2
    return [(head.format("One") + segment + with_x).encode(), two.encode()]


@cache
def mat() -> tuple[bytes, ...]:
    """MAT files of version 5, packed and not, and of 7.3 where h5py is."""
    from scipy.io import savemat

    t, u, p, y = _rows(20).T
    log = {"u": u, "p": p.astype(np.float32), "n": np.arange(20, dtype=np.int16), "s": "text"}
    found = []
    for packed in (False, True):
        for content in (
            {"t": t, "log": log},
            {"t": t, "m": np.column_stack([u, p, y]), "cells": np.array([log], object)},
        ):
            file = io.BytesIO()
            savemat(file, content, do_compression=packed)
            found.append(file.getvalue())
    file = io.BytesIO()
    savemat(file, {"t": t, "u": u, "y": y}, format="4")
    return (*found, file.getvalue(), *_hdf5(t, u, y))


def _hdf5(t, u, y) -> tuple[bytes, ...]:
    try:
        import h5py
    except ImportError:
        return ()
    file = io.BytesIO()
    with h5py.File(file, "w", userblock_size=512) as made:
        for name, values in (("t", t), ("u", u), ("y", y)):
            made[name] = values[None, :]
        made.create_group("log")["p"] = np.arange(20.0)[None, :]
    raw = bytearray(file.getvalue())
    raw[:128] = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    return (bytes(raw),)


@cache
def parquet() -> tuple[bytes, ...]:
    """Tables of numbers, texts, gaps and times, packed in several ways."""
    import pyarrow
    from pyarrow import parquet as writer

    t, u, p, y = _rows(20).T
    plain = {"t": t, "u": u, "p": p.astype(np.float32), "y": y, "n": np.arange(20)}
    mixed = {
        "t": t,
        "name": ["a", None] * 10,
        "flag": [True, None] * 10,
        "when": np.arange(20).astype("M8[ms]"),
    }
    found = []
    for content, packed in ((plain, "none"), (plain, "snappy"), (mixed, "zstd"), (mixed, "gzip")):
        file = io.BytesIO()
        writer.write_table(pyarrow.table(content), file, compression=packed)
        found.append(file.getvalue())
    return tuple(found)


@cache
def tdms() -> tuple[bytes, ...]:
    """LabVIEW's TDMS: channels with a column of time, waveforms, two groups, strings and times."""
    from nptdms import ChannelObject, RootObject, TdmsWriter

    t, u, _, y = _rows(20).T
    wave = {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": "V"}
    sets = [
        [
            ChannelObject("g", "t", t),
            ChannelObject("g", "u", u),
            ChannelObject("g", "y", y.astype(np.float32)),
        ],
        [ChannelObject(g, c, x, wave) for g in ("a", "b") for c, x in (("u", u), ("y", y))],
        [
            ChannelObject("g", "n", np.arange(20, dtype=np.int16)),
            ChannelObject("g", "w", np.arange(20).astype("M8[us]")),
            ChannelObject("g", "s", ["x"] * 20),
        ],
    ]
    found = []
    for objects in sets:
        file = io.BytesIO()
        with TdmsWriter(file) as writer:
            writer.write_segment([RootObject({"a": 1}), *objects])
            writer.write_segment(objects)
        found.append(file.getvalue())
    return tuple(found)


def packed() -> list[bytes]:
    """Logs in text, packed."""
    return [gzip.compress(one, mtime=0) for one in text(20)[:3]]


@cache
def firmware() -> dict[str, bytes]:
    """A small generated folder, with whatever adds a key to its manifest."""
    from focgen.codegen.generate import folder_files
    from focgen.codegen.kernels import Kernels
    from focgen.codegen.packages.package import check_package
    from focgen.control.files import read_controller
    from focgen.plan.build import build_plan

    raw = controller()[1]
    plan = build_plan(read_controller(tomllib.loads(raw.decode())), "q15", 20, "lead", tunable=True)
    files = folder_files(plan, raw, True, Kernels("cortex-m4"), False, check_package("arduino"))
    return {name: one if isinstance(one, bytes) else one.encode() for name, one in files.items()}


def manifest() -> list[bytes]:
    """The manifest of that folder."""
    return [firmware()["manifest.json"]]


def trial() -> list[bytes]:
    """What a trial's files say, one after the other in an object."""
    truth = {"effect": "creep", "stage": "actuator", "visible": True, "severity": "clear", "form": "log"}
    label = {
        "kind": "single",
        "suite": "short",
        "truth": [truth],
        "floor": 0.1,
        "unseen": {"0001.csv": "0" * 64},
        "design": {"tied": ["creep"], "resolves": ["hold"]},
    }
    diagnosis = {
        "verdict": "named",
        "where": {"stage": "actuator"},
        "shrink": 0.6,
        "shrink_interval": [0.5, 0.7],
        "causes": [{"stage": "actuator", "candidates": [{"effect": "creep", "confidence": 0.9}]}],
        "gap": {"as_given": 2.0, "refitted": 1.5, "explained": 1.0, "floor": 0.5},
        "next_experiment": {"what": "hold", "why": "creep"},
    }
    whole = {
        "trial.json": {
            "suite": "short",
            "signals": "C",
            "seed": 7,
            "commitments": {"0001": "0" * 64},
            "kinds": ["none"],
        },
        "label.json": {"salt": "00", "label": label},
        "outcome.json": {"status": "done", "seconds": 1.0, "fault": None},
        "diagnosis.json": diagnosis,
        "achieved.json": {"achieved": 0.5, "sha256": "0" * 64},
    }
    return [json.dumps(whole).encode()]


@cache
def diagnosis() -> dict[str, bytes]:
    """A folder that a diagnosis has written."""
    from focgen.diagnosis.drawn import FILE, drawn_text
    from focgen.jsontext import to_json
    from tests import report_samples

    return {
        "diagnosis.json": to_json(report_samples.diagnosis()).encode(),
        FILE: drawn_text(report_samples.signals(40)).encode(),
        "refitted.toml": (shipped("examples") / "rig.toml").read_bytes(),
    }


def verified() -> list[bytes]:
    """What ``verify --json`` prints."""
    error = {"operator": 1e-6, "output": 1e-6}
    ran = {"samples": 10, "mismatches": 0, "max_error": error, "error_bound": error, "skipped": None}
    whole = {
        "name": "lead",
        "arithmetic": "q15",
        "targets": {"host": ran, "avr": {"skipped": "no compiler"}},
        "differences": ["lead.c: is not"],
        "notes": ["README.md: has been edited"],
        "files": {"manifest.json": "0" * 64},
        "holds": False,
    }
    return [json.dumps(whole).encode()]


def costs() -> list[bytes]:
    """What a folder remembers of its costs."""
    part = {"made_from": "0", "targets": {}, "previous": {}}
    return [json.dumps({"zig": part, "gcc": part}).encode()]


@cache
def study() -> bytes:
    """Both files of a study in one object, by their names without the suffix."""
    row = {"memory": "short", "arithmetic": "q15", "sample_time": 0.01, "length": 5, "tolerance": None}
    told = {
        "controller": "lead",
        "rig": None,
        "band": {"low": 0.1, "high": 10.0, "why": "chosen"},
        "setpoints": [0.01],
        "samples": 100,
        "rows": [{**row, "horizon": None, "error": 0.1, "errors": {"step": 0.1}, "multiplies": 6}],
        "ideal": [],
        "plant": None,
        "pareto": {"multiplies": [0]},
        "recommendation": "short",
        "notes": ["short"],
        "operators": [],
    }
    drawn = {
        "omega": [1.0, 2.0],
        "phase_deg": [0.1, 0.2],
        "magnitude_db": [0.0, 0.1],
        "time": [],
        "output": [],
    }
    curves = {
        "controller": tomllib.loads(_LEAD),
        "rows": [drawn | {"reference": None}],
        "ideal": [],
        "plant": None,
    }
    return json.dumps({"study": told, "curves": curves}).encode()


def path_of(folder: Path, name: str, data: bytes) -> Path:
    """A file with these bytes."""
    place = folder / name
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_bytes(data)
    return place
