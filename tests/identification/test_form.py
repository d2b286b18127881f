"""What the form of a model lacks is written into the rig, and is no effect that is sure.

Red when an equation of another form has none of it in its rig's file, or a right one has some, when a rig as
it was is sure of an effect, or when what was there as it was identified has no name.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.belief.standing import nominal_off
from focgen.diagnosis.diagnose import diagnose
from focgen.identification.identify import identify
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.files import read_rig, write_rig
from focgen.rig.rig import Actuator, Rig, Signals

H, SECONDS = 0.05, 60.0
NOISE = 0.004
SIGNALS = Signals("t", "y", pressure="p")
RIG = Rig("finger", H, SIGNALS, Actuator(0.6, 0.9, (1.5,)), between=Between.HELD)
ONE = ((1.0, 0.5),)
TWO = ((0.8, 0.4), (0.2, 3.0))
"""Shares and times of relaxations, s: no K(p)/(T s^α + 1) has two."""


def relaxed(held, relaxations):
    """What parallel relaxations make of an input (n,) that is held from each sample to the next: exact."""
    kept = [(share, np.exp(-H / tau)) for share, tau in relaxations]
    return sum(share * lfilter([0.0, 1.0 - a], [1.0, -a], held) for share, a in kept)


def session(relaxations, seed, count=4, late=0):
    """Staircases, and what the rig is without noise; ``late``: samples of a dead time."""
    rng, logs, clean = np.random.default_rng(seed), [], []
    for i in range(count):
        levels = np.r_[0.0, rng.uniform(0.3, 3.0, 7)]
        held = np.repeat(levels, round(SECONDS / len(levels) / H))
        y = 2.0 * np.r_[np.zeros(late), relaxed(held, relaxations)][: len(held)]
        clean.append(y)
        logs.append(Experiment(f"e{i}", H, {"pressure": held, "output": y + rng.normal(0.0, NOISE, len(y))}))
    return logs, clean


@pytest.mark.parametrize("seed", range(3))
def test_what_a_form_lacks_is_measured(seed):
    logs, clean = session(TWO, seed)
    found = identify(RIG, logs, integer=False)
    off = [y - found.joint.simulated[f"e{i}"] for i, y in enumerate(clean)]
    lacks = np.concatenate([o - o.mean() for o in off])
    spread = np.std(np.concatenate([log["output"] for log in logs]))
    assert found.rig.uncertainty.actuator.form == pytest.approx(np.std(lacks) / spread, rel=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_a_right_form_lacks_nothing(seed):
    assert identify(RIG, session(ONE, seed)[0], integer=False).rig.uncertainty.actuator.form == 0.0


def test_a_closed_loop_tells_nothing_of_the_form():
    """Its command has the noise in it, which lags of it foretell."""
    rng, y, u, total = np.random.default_rng(3), np.zeros(1200), np.zeros(1200), 0.0
    asked, x = np.repeat(rng.uniform(0.0, 3.0, 8), 150), 0.0
    noise = lfilter([0.02], [1.0, -0.9], rng.normal(size=1200))
    for k in range(1200):
        y[k] = x + noise[k]
        total += 0.05 * (asked[k] - y[k])
        u[k] = 2.0 * (asked[k] - y[k]) + total
        x += (1.0 - np.exp(-H / 0.5)) * (2.0 * u[k] - x)
    rig = replace(RIG, signals=Signals("t", "y", command="u"))
    found = identify(rig, Experiment("e", H, {"command": u, "output": y}), integer=False)
    assert found.joint.closed_loop and found.rig.uncertainty.actuator.form == 0.0


def test_it_is_in_the_rig_s_file(tmp_path):
    rig = identify(RIG, session(TWO, 5)[0], integer=False).rig
    write_rig(rig, tmp_path / "rig.toml")
    assert "form = " in (tmp_path / "rig.toml").read_text(encoding="utf-8")
    assert read_rig(tmp_path / "rig.toml").uncertainty == rig.uncertainty


@pytest.mark.parametrize("seed", range(2))
def test_a_rig_as_it_was_has_no_effect_that_is_sure(seed):
    """Without the form, a sensor that relaxes was named at 0.95."""
    rig = identify(RIG, session(TWO, seed)[0], integer=False).rig
    found = diagnose(rig, session(TWO, seed + 10)[0], pictures=False)
    assert all(cause.candidates[0].confidence <= 0.5 for cause in found.causes)
    assert any("its form lacks about as much" in note for note in found.notes)


@pytest.mark.parametrize("seed", range(2))
def test_what_was_there_as_it_was_identified_has_its_name(seed):
    logs, _ = session(ONE, seed, late=3)
    rig = identify(RIG, logs, integer=False).rig
    assert rig.uncertainty.actuator.form > 0.0
    found = diagnose(rig, logs, pictures=False)
    assert [cause.candidates[0].effect for cause in found.causes] == ["transport_delay"]


def test_what_is_as_large_as_the_form_lacks_is_even_at_most():
    assert nominal_off(2.0, False, form=2.0) == nominal_off(1.0, False, form=2.0) == 0.0
    assert nominal_off(4.0, False, form=2.0) == pytest.approx(4.0 * np.log(0.5))
    assert nominal_off(2.0, True, form=2.0) == nominal_off(2.0, True)  # no linear equation bends
    assert nominal_off(0.01, False, form=2.0) == nominal_off(0.01, False) > 0.0
