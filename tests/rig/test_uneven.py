"""A stage whose pace depends on its level, on time or on its speed, against small steps of its equation.

Red when a stage that gets slower or faster answers another output than its equation does.
"""

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import linear, uneven
from focgen.rig.dynamics import Pace
from focgen.rig.effects import Run

H, SAMPLES, T, GAIN = 0.02, 1500, 0.8, 2.0
RUN = Run.of([SAMPLES], [0.0], H)
LAG = TransferFunction([(GAIN, 0.0)], [(T, 1.0), (1.0, 0.0)])
U = np.repeat(np.random.default_rng(3).uniform(0.0, 1.0, SAMPLES // 100), 100)


def where(by, level, gap, i, top, fastest):
    """How far up its range what the pace depends on is."""
    found = {"level": level / top, "time": i / (SAMPLES - 1), "speed": abs(gap) / fastest}[by]
    return min(found, 1.0)


def in_small_steps(by, rate, even, curve=0.0, fine=100):
    """T exp(rate w + curve w²) y' + y = u by Euler steps of a hundredth of a sample, u held."""
    top, fastest = np.max(even), np.max(np.abs(U - even))
    y, made = 0.0, []
    for i, u in enumerate(U):
        made.append(y)
        for _ in range(fine):
            w = where(by, y, u - y, i, top, fastest)
            y += H / fine * (u - y) / (T * np.exp(rate * w + curve * w * w))
    return np.array(made)


@pytest.mark.parametrize("by", ["level", pytest.param("time", marks=pytest.mark.long), "speed"])
@pytest.mark.parametrize(
    "rate, curve",
    [
        pytest.param(0.6, 0.0, marks=pytest.mark.long),
        pytest.param(-0.6, 0.0, marks=pytest.mark.long),
        (0.2, 1.0),
    ],
)
def test_a_lag_answers_as_its_equation_does(by, rate, curve):
    even = linear.run(LAG, U, RUN.rest, H, RUN.duration, Between.HELD) / GAIN
    made = uneven.run(LAG, U, RUN, Pace(by, rate, curve), Between.HELD) / GAIN
    true = in_small_steps(by, rate, even, curve)
    change = np.max(np.abs(true - even))
    assert change > 0.05
    assert np.max(np.abs(made - true)) < 0.08 * change  # what a pace is within a sample is not followed


@pytest.mark.parametrize(
    "rate, curve",
    [
        pytest.param(2.5, 0.0, marks=pytest.mark.long),
        (2.5, 2.5),
        pytest.param(1.5, -1.5, marks=pytest.mark.long),
    ],
)
def test_a_level_of_either_sign_is_met(rate, curve):
    """The last is twenty times as fast at the lowest level as at none."""
    u, h, fine = np.repeat([0.0, 1.0, -1.0, 0.5, -0.7], 150), 0.05, 200
    lag, run = TransferFunction([(1.0, 0.0)], [(1.0, 1.0), (1.0, 0.0)]), Run.of([750], [0.0], 0.05)
    even = linear.run(lag, u, run.rest, h, run.duration, Between.HELD)
    y, true = 0.0, []
    for x in u:
        true.append(y)
        for _ in range(fine):
            w = np.clip(y / np.max(np.abs(even)), -1.0, 1.0)
            y += h / fine * (x - y) / np.exp((rate + curve * w) * w)
    made = uneven.run(lag, u, run, Pace("level", rate, curve), Between.HELD)
    assert np.max(np.abs(made)) < 1.01 and np.sqrt(np.mean((made - true) ** 2)) < 0.05


@pytest.mark.parametrize("between", [Between.HELD, Between.STRAIGHT])
def test_an_even_pace_is_none(between):
    made = uneven.run(LAG, U, RUN, Pace("level", 0.0), between)
    even = linear.run(LAG, U, RUN.rest, H, RUN.duration, between)
    np.testing.assert_allclose(made, even, rtol=0.0, atol=1e-12)


def test_a_fractional_stage_meets_its_equation():
    """T exp(rate y/top) D^α y + y = u, D^α by Grünwald and Letnikov's weights, whose error falls with h."""
    alpha, rate = 0.7, 0.8
    stage = TransferFunction([(1.0, 0.0)], [(T, alpha), (1.0, 0.0)])
    u = np.sin(np.arange(SAMPLES) * H * 0.7) ** 2
    top = np.max(linear.run(stage, u, RUN.rest, H, RUN.duration))
    weights = np.cumprod(np.r_[1.0, 1.0 - (alpha + 1.0) / np.arange(1, SAMPLES)])

    def left(pace, slowness):
        y = uneven.run(stage, u, RUN, pace, Between.STRAIGHT)
        derivative = np.convolve(weights, y)[:SAMPLES] / H**alpha
        return np.max(np.abs(T * slowness(y) * derivative + y - u)[100:])

    error = left(Pace("level", 0.0), lambda y: 1.0)  # of the weights alone
    assert left(Pace("level", rate), lambda y: np.exp(rate * y / top)) < 3.0 * error
    assert left(Pace("level", rate), lambda y: 1.0) > 20.0 * error


@pytest.mark.parametrize(
    "num, den", [([(1.0, 0.0)], [(1.0, 1.0)]), ([(1.0, 1.0)], [(1.0, 1.0), (1.0, 0.0)]), ([(1.0, 0.0)],) * 2]
)
def test_what_holds_no_level_has_no_pace(num, den):
    assert not linear.holds_level(TransferFunction(num, den))
