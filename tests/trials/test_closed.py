"""Closed loops: without a fault the controller is the file's; with one it departs as the fault says.

Red when a sound controller departs, or a faulty one does not.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import binom

from focgen.fractional.transfer import TransferFunction
from focgen.rig.files import read_rig
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.closed import (
    CONTROLLER_EFFECTS,
    Fault,
    Loop,
    draw_controller,
    draw_fault,
    draw_unknown,
    gl_weights,
    logged,
)
from focgen.trials.forms import Spans
from focgen.trials.machine import Machine, Session
from focgen.trials.make import make
from focgen.trials.recording import Recorder

H, TS = 0.001, 0.02
RIG = Rig(
    "bench",
    TS,
    Signals("t", "y", command="u", pressure="p", curvature="z", reference="ref"),
    Actuator(0.8, 0.7, (0.2, 0.3)),
    TransferFunction([(0.1, 0.0)], [(0.05, 1.0), (1.0, 0.0)]),
    TransferFunction([(12.0, 0.0)], [(1.0, 1.0), (12.0, 0.0)]),
)
DRIVE = 0.2 * (0.2 + 0.3 * 0.2)
SPANS = Spans(2.0, 0.2, DRIVE, DRIVE, DRIVE, 1.013, 300.0)
NOISE = {"pressure": 5e-4, "curvature": 1e-4, "output": 1e-4}
RECORDER = Recorder(NOISE, dict.fromkeys(NOISE, 1e-09), 0.0, 0.0, True, False)
REFERENCE = np.repeat(np.repeat([0.0, 0.5, 0.8, 0.2], 750) * DRIVE, 20)


def loop_of(fault, seed=1, recorder=RECORDER):
    rng = np.random.default_rng(seed)
    session = Session(Machine(RIG), H)
    loop = Loop(session, draw_controller(RIG, SPANS, np.random.default_rng(9)), fault, SPANS)
    run = loop.run(REFERENCE, 20, 0.0, recorder, rng)
    return loop, logged(*run, REFERENCE, recorder, rng)


def departure(loop, log):
    """The logged command less what the ideal controller gives for the logged signals."""
    return log["command"] - loop.ideal_output(log["reference"] - log["output"], log["pressure"])


def test_gl_weights_are_binomial_coefficients():
    transfer = TransferFunction([(0.8, 0.7), (1.0, 0.0)])
    j = np.arange(60)
    exact = 0.8 * TS**-0.7 * (-1.0) ** j * binom(0.7, j) + (j == 0)
    assert np.allclose(gl_weights(transfer, 59, TS), exact, rtol=1e-10)


def test_faultless_loop_runs_the_controller_of_the_file_and_tracks():
    loop, log = loop_of(Fault())
    assert np.abs(departure(loop, log)).max() < 1e-12
    assert np.allclose(np.diff(log["time"]), TS)
    settled = log["output"][2200:2249]  # 14 s after the step to 0.8
    assert np.mean(settled) == pytest.approx(0.8 * DRIVE, rel=0.02)


def test_ideal_controller_by_the_plain_sum():
    loop, log = loop_of(Fault())
    error, c = log["reference"] - log["output"], loop.controller
    weights = gl_weights(c.transfer, 400, TS)
    past = np.concatenate([np.full(400, error[0]), error])
    rate = np.array([weights @ past[k : k + 401][::-1] for k in range(400)]) * c.gain(log["pressure"][:400])
    u = 0.0
    short = Loop(loop.session, replace(c, length=400), Fault(), SPANS)
    found = short.ideal_output(error[:400], log["pressure"][:400])
    for k in range(1, 400):
        u = float(np.clip(u + 0.5 * TS * (rate[k] + rate[k - 1]), *c.ranges.output))
        assert found[k] == pytest.approx(u, abs=1e-10)


@pytest.mark.parametrize("effect", ["short_memory", "fixed_point"])
@pytest.mark.parametrize("severity", ["low", "mid", "high"])
def test_computing_faults_depart_from_the_ideal(effect, severity):
    loop, log = loop_of(draw_fault(effect, severity, 1.5, np.random.default_rng(2)))
    assert np.sqrt(np.mean(departure(loop, log) ** 2)) > 1e-3 * SPANS.command


def test_fixed_point_gives_whole_counts():
    fault = draw_fault("fixed_point", "mid", 1.5, np.random.default_rng(2))
    _, log = loop_of(fault)
    counts = log["command"] / (1.3 * SPANS.command * 2.0**-fault.bits)
    assert np.allclose(counts, np.round(counts), atol=1e-6) and np.ptp(counts) > 100


@pytest.mark.parametrize(
    "seed", [1, pytest.param(2, marks=pytest.mark.long), 3, pytest.param(4, marks=pytest.mark.long)]
)
def test_saturation_stops_at_its_limit(seed):
    free = loop_of(Fault())[1]["command"].max()
    fault = draw_fault("output_saturation", "high", free, np.random.default_rng(seed))
    _, log = loop_of(fault)
    assert log["command"].max() == pytest.approx(0.7 * free) and free > 0.7 * free + 0.1


@pytest.mark.parametrize(
    "seed", [1, pytest.param(2, marks=pytest.mark.long), 3, pytest.param(4, marks=pytest.mark.long)]
)
def test_jitter_and_losses_show_in_the_time_stamps(seed):
    rng = np.random.default_rng(seed)
    jitter = draw_fault("sample_jitter", "high", 1.5, rng)
    steps = np.diff(loop_of(jitter, seed)[1]["time"])
    assert 0.08 * TS < np.std(steps) < 0.6 * TS and np.mean(steps) == pytest.approx(TS, rel=2e-3)
    assert np.all(steps > 0)
    lost = draw_fault("missed_samples", "high", 1.5, rng)
    stamps = loop_of(lost, seed)[1]["time"]
    steps = np.diff(stamps) / TS
    assert np.allclose(steps, np.round(steps), atol=1e-6)
    share = 1 - len(stamps) / 3000
    assert 0.02 < share < 0.12
    if lost.form == "bursts":
        assert np.max(steps) >= 4


def test_every_controller_effect_has_a_fault():
    for effect in CONTROLLER_EFFECTS:
        faults = [draw_fault(effect, "mid", 1.0, np.random.default_rng(seed)) for seed in range(12)]
        assert all(f.effect == effect and f != Fault(effect, f.form) for f in faults)


@pytest.mark.parametrize("seed", range(6))
def test_a_controller_of_somebody_else_keeps_the_loop_stable_and_follows(seed):
    """Whatever was drawn: at rest it has no error, and nothing rings for long."""
    rng = np.random.default_rng(seed)
    session = Session(Machine(RIG), H)
    loop = Loop(session, draw_unknown(RIG, SPANS, rng), Fault(), SPANS)
    quiet = Recorder(dict.fromkeys(NOISE, 0.0), dict.fromkeys(NOISE, 1e-09), 0.0, 0.0, True, False)
    trace, *_ = loop.run(REFERENCE, 20, 0.0, quiet, rng)
    ends = np.arange(1, 5) * 15000 - 1
    assert trace.output[ends] == pytest.approx(REFERENCE[ends], abs=0.12 * DRIVE)
    assert np.ptp(trace.output[-3000:]) < 0.1 * DRIVE and trace.output.max() < 1.5 * REFERENCE.max()


def test_cases_with_an_unknown_controller_say_nothing_of_it(tmp_path):
    make(tmp_path / "t", cases=2, seed=5, signals="A", suite="loops", kinds=("none", "parameters"))
    for case in sorted((tmp_path / "t" / "cases").iterdir()):
        assert not (case / "controller.toml").exists() and "theirs" not in (case / "rig.toml").read_text()
        rig = read_rig(case / "rig.toml")
        assert rig.signals.reference == "ref" and rig.signals.pressure is None
        label = json.loads((tmp_path / "t" / "sealed" / case.name / "label.json").read_text())["label"]
        assert label["suite"] == "loops" and label["truth"] == []
