"""Axes and masses with dry friction, made by an integrator of LuGre's bristles, which is no form of the
library.

Red when friction on an axis is missed or called another name, or a sound axis is called faulty, be it that
each of its logs begins where the last one left it.
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.fitting.predictability import _Regression, predictable_share
from focgen.diagnosis.problem.decimate import decimated
from focgen.diagnosis.problem.scales import clocks
from focgen.diagnosis.problem.segments import make
from focgen.errors import RigError
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig import kernels
from focgen.rig.files import read_rig, write_rig
from focgen.rig.replay import replay
from focgen.rig.rig import LinearActuator, Rig, Signals

H = 0.02
AXIS = Rig(
    "axis",
    H,
    Signals("t", "q", "u"),
    LinearActuator(TransferFunction([(1.0, 0.0)], [(0.45, 2.0), (0.9, 1.0)])),
)


def bristles(u, m=0.5, c=0.8, k=0.0, force=0.4, zero=0.1, sub=200):
    """m y'' + c y' + k y = u + zero − F, F = s0 z + s1 z', z' = v − s0 |v| z/force (Canudas de Wit and
    others, IEEE Trans. Autom. Control 40, 1995), by small steps, the input in straight lines."""
    y, v, z, dt, found = 0.0, 0.0, 0.0, H / sub, np.zeros(len(u))
    stiff, damp = 400.0, 2.0
    for n in range(1, len(u)):
        for i in range(sub):
            now = u[n - 1] + (u[n] - u[n - 1]) * i / sub + zero
            dz = v - stiff * abs(v) * z / force
            v += dt * (now - k * y - c * v - stiff * z - damp * dz) / m
            z += dt * dz
            y += dt * v
        found[n] = y
    return found


def moves(seed, n=1500):
    """Pushes to and fro about the friction, with rests; they hold the axis near its middle."""
    rng = np.random.default_rng(seed)
    t = H * np.arange(n)
    parts = zip((0.9, 0.5, 0.4), (0.9, 2.3, 5.1), rng.random(3) * 6.3)
    sines = sum(a * np.sin(w * t + p) for a, w, p in parts)
    return sines * (np.sin(0.35 * t) > -0.6) - 0.1


def axis_log(seed, **how):
    u = moves(seed)
    y = bristles(u, **how)
    noise = 0.002 * np.ptp(y) * np.random.default_rng(seed + 9).standard_normal(len(y))
    return Experiment(f"axis {seed}", H, {"command": u, "output": y + noise})


@pytest.mark.long
@pytest.mark.parametrize("zero", [0.0, 0.1])
def test_friction_of_an_axis_that_integrates_has_its_size(zero, tmp_path):
    found = diagnose(AXIS, [axis_log(1, zero=zero)], out=tmp_path, pictures=False, only=["friction"])
    first = found.causes[0].candidates[0]
    rig = read_rig(tmp_path / "augmented.toml")
    gain = rig.actuator.dynamics.num[0].coefficient / rig.actuator.dynamics.den[-1].coefficient
    force = sum(e.get("force", 0.0) + max(e.get("rise", 0.0), 0.0) for e in rig.effects)
    assert first.effect == "friction" and gain * force == pytest.approx(0.4 / 0.8, rel=0.15)
    assert gain * rig.actuator.bias == pytest.approx(zero / 0.8, abs=0.03)
    test = [axis_log(2, zero=zero)]
    before, after = (
        replay(tmp_path / f"{n}.toml", test).logs["axis 2"].rmse for n in ("refitted", "augmented")
    )
    assert after < 0.35 * before


@pytest.mark.long
def test_friction_of_an_axis_is_named_among_all_effects():
    found = diagnose(AXIS, [axis_log(1, zero=0.1)], pictures=False)
    assert found.verdict == "named" and found.causes[0].candidates[0].effect == "friction"


def test_an_axis_without_friction_has_none():
    u = moves(3)
    _, y, _ = lsim(([1.0], [0.5, 0.8, 0.0]), u + 0.1, H * np.arange(len(u)))
    y = y + 0.002 * np.ptp(y) * np.random.default_rng(0).standard_normal(len(y))
    found = diagnose(AXIS, [Experiment("free", H, {"command": u, "output": y})], pictures=False)
    assert found.verdict == "parameters"


def test_inputs_predict_the_path_that_a_missing_force_leaves():
    u, pace = moves(3), 2.0
    log = Experiment("path", H, {"command": u, "output": u})
    segment = replace(make([log], "command", "output", None, None), pace=pace)
    force = np.sign(np.gradient(np.convolve(u, np.ones(9) / 9.0, "same")))
    path = kernels.lag(force, segment.run.rest, H, pace, pace)
    left = path - np.mean(path) + 0.5 * np.std(path) * np.random.default_rng(1).standard_normal(len(u))
    kept, forgotten = (_Regression.of(replace(segment, pace=p), left, 0.05).whole for p in (pace, 0.0))
    assert kept > 0.3 and forgotten < 0.2
    assert predictable_share(segment, left, 0.05) > 0.6  # the level alone, of few coefficients, tells more


def test_what_a_command_does_between_samples_is_asked_of_the_file(tmp_path):
    write_rig(replace(AXIS, between=Between.SMOOTH), tmp_path / "rig.toml")
    assert read_rig(tmp_path / "rig.toml").between is Between.SMOOTH
    text = (tmp_path / "rig.toml").read_text(encoding="utf-8").replace("smooth", "wavy")
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    with pytest.raises(RigError, match="'wavy'.*'held'"):
        read_rig(tmp_path / "rig.toml")


def test_more_samples_than_the_response_needs_are_looked_at_in_fewer():
    n = 200_000
    u = np.sin(np.arange(n) / 15000.0)
    log = Experiment("fast", 1e-3, {"command": u, "output": np.cumsum(u)})
    rig, (few,) = decimated(AXIS, [log])
    every = n // len(few) | 1
    assert rig.between is Between.STRAIGHT and every >= 3
    assert clocks(AXIS, [log])["response"] / few.sample_time >= 100.0
    np.testing.assert_array_equal(few["output"], log["output"][::every])
    np.testing.assert_allclose(few["command"][5:-5], u[::every][5:-5], atol=1e-5)
    assert few.sample_time == pytest.approx(every * 1e-3) and "looked at" in few.notes[-1]
    slow = replace(log, sample_time=1.0)
    few_rows = {role: values[:400] for role, values in slow.signals.items()}
    same, (kept,) = decimated(replace(AXIS, sample_time=1.0), [replace(slow, signals=few_rows)])
    assert len(kept) == 400 and same.between is None


DATA = Path(
    os.environ.get("FOCGEN_DATA", Path(__file__).resolve().parents[2] / ".." / "shared" / "data" / "open")
)


@pytest.mark.long
@pytest.mark.parametrize(
    "name, effect, train, test", [("EMPS", "friction", 3.0, 7.0), ("Bouc–Wen", "hysteresis", 12.0, 10.0)]
)
def test_public_records(name, effect, train, test, tmp_path):
    from tests.records.__main__ import measured
    from tests.records.benchmarks import BENCHMARKS

    benchmark = next(b for b in BENCHMARKS if b.name == name)
    if not (DATA / benchmark.test).exists():
        pytest.skip(f"{DATA} has no {benchmark.test}")
    row = measured(benchmark, DATA, tmp_path)
    assert row[1].split("`")[1] == effect and (name == "EMPS" or row[1].startswith("named"))
    assert float(row[3].split()[0]) < train and float(row[4].split()[0]) < test


RACK = replace(
    AXIS,
    regulator=TransferFunction([(2.0, 0.0)], [(0.05, 1.0), (1.0, 0.0)]),
    sensor=TransferFunction([(1.0, 0.0)], [(0.06, 1.0), (1.0, 0.0)]),
)


def driven(place, seed, n=1200):
    """A log of an axis on a rack, from where it stood, by small steps."""
    rng, sub = np.random.default_rng(seed), 20
    u = np.repeat(rng.uniform(-0.5, 0.5, n // 60), 60) * (H * np.arange(n) > 1.0)
    p = v = 0.0
    y = read = place
    columns = {"command": u, "pressure": np.empty(n), "output": np.empty(n)}
    for i in range(n):
        columns["pressure"][i], columns["output"][i] = p, read
        for _ in range(sub):
            p += H / sub / 0.05 * (2.0 * u[i] - p)
            v += H / sub / 0.45 * (p - 0.9 * v)
            y += H / sub * v
            read += H / sub / 0.06 * (y - read)
    for role, size in (("pressure", 0.008), ("output", 0.01)):
        columns[role] = columns[role] + size * rng.standard_normal(n)
    return Experiment(f"log{seed}", H, columns, start=40.0 * seed)


def test_an_axis_begins_where_it_was_left():
    """The places alone are a drift of the sensor, or its noise, to a model that begins each log at 0."""
    found = diagnose(RACK, [driven(place, k) for k, place in enumerate((0.0, 1.5, 4.0, 6.5))], pictures=False)
    assert found.verdict in ("none", "parameters") and found.gap.refitted < 3.0 * found.gap.floor
    assert any("begins away from rest" in note for note in found.notes)


def test_replay_begins_where_an_axis_was_left():
    told = replay(RACK, [driven(2.0, 1)])
    assert told.logs["log1"].rmse < 0.05 and told.simulated["log1"]["output"][0] == pytest.approx(
        2.0, abs=0.02
    )
