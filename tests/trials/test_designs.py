"""Designs meant to be unidentifiable are: a rival explains their logs to less than the least noise.

Red when a design meant to be unidentifiable can be told.
"""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.trials.designs import DESIGNS
from focgen.trials.forms import Spans
from focgen.trials.machine import Machine, Session, Setting
from focgen.trials.plan import assignments
from focgen.trials.vocabulary import VOCABULARY

TS, H = 0.02, 0.01
RIG = Rig(
    "bench",
    TS,
    Signals("t", "y", command="u", pressure="p"),
    Actuator(1.2, 0.6, (0.2, 0.3)),
    TransferFunction([(0.1, 0.0)], [(0.05, 1.0), (1.0, 0.0)]),
    TransferFunction([(8.0, 0.0)], [(1.0, 1.0), (8.0, 0.0)]),
)
DRIVE = 0.2 * (0.2 + 0.3 * 0.2)
SPANS = Spans(2.0, 0.2, DRIVE, DRIVE, DRIVE, 1.013, 300.0)
BY_NAME = {design.name: design for design in DESIGNS}


def signals(settings, name, seed=1):
    session = Session(Machine(RIG, settings), H)
    levels = [e.levels for e in BY_NAME[name].draw(np.random.default_rng(seed), TS)]
    traces = [session.run(np.repeat(2.0 * x, round(TS / H)), 60.0 * i) for i, x in enumerate(levels)]
    return {s: np.concatenate([getattr(t, s) for t in traces]) for s in ("pressure", "curvature", "output")}


def closest(name, signal, truth, rival, low, high):
    """The rms distance, in spans, of the rival's best amplitude from the truth, and of none."""
    true, none = signals((truth,), name)[signal], signals((), name)[signal]

    def distance(log_a):
        return np.sqrt(np.mean((signals((rival(np.exp(log_a)),), name)[signal] - true) ** 2)) / np.ptp(none)

    grid = np.linspace(np.log(low), np.log(high), 9)
    start = grid[np.argmin([distance(g) for g in grid])]
    best = minimize_scalar(
        distance, bounds=(start - 0.6, start + 0.6), method="bounded", options={"xatol": 1e-4}
    )
    return best.fun, np.sqrt(np.mean((none - true) ** 2)) / np.ptp(none)


def test_a_small_lag_is_a_small_delay_to_one_slow_sine():
    left, gap = closest(
        "slow_sine",
        "pressure",
        Setting("tube_wave", (0.15,)),
        lambda a: Setting("line_ladder", (a / 6,)),
        0.02,
        0.6,
    )
    assert gap > 0.005 and left < 0.02 * gap + 1e-4


def test_an_obstacle_is_a_limit_of_the_reading_to_slow_ramps():
    pad = Setting("foam_pad", (DRIVE / 400.0, 0.55 * DRIVE))
    left, gap = closest(
        "no_curvature", "output", pad, lambda a: Setting("soft_rail", (a * DRIVE, 0.004 * DRIVE)), 0.4, 0.8
    )
    assert gap > 0.05 and left < 0.004  # the least noise is 0.4 %


def test_every_level_is_visited_once_and_rising():
    levels = [e.levels for e in BY_NAME["rising_steps"].draw(np.random.default_rng(1), TS)]
    assert all(np.all(np.diff(x) >= 0) and len(np.unique(x)) == 2 for x in levels)
    assert np.all(np.diff([x[-1] for x in levels]) > 0.05)


@pytest.mark.parametrize("design", DESIGNS, ids=lambda d: d.name)
def test_truths_are_among_the_tied_and_have_their_forms(design):
    for truth in design.truths:
        assert truth.effect in design.tied
        assert truth.form in [form.name for form in VOCABULARY[truth.effect][1]]


@pytest.mark.parametrize("signals_", "CBA")
def test_pairs_are_two_effects_within_and_across_stages(signals_):
    found = assignments(300, ("pair",), signals_, "full", np.random.default_rng(4))
    stages = [tuple(VOCABULARY[e][0] for e in a.effects) for a in found]
    assert all(len(set(a.effects)) == 2 for a in found)
    assert 0.25 < np.mean([a == b for a, b in stages]) < 0.55
    assert not any({"contact", "sensor_saturation"} == set(a.effects) for a in found)
