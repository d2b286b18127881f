"""An input that is held between samples, in actuators of real order: against the exact response, and against
the same input in lines on a grid of a twentieth.

Red when a held input counts as a line from sample to sample: the response is then half a sample off, which at
low orders is several per cent of its reach right behind a jump.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import linear
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, Delays, LinearActuator, Rig, Signals

H, HOLD, FINER = 0.1, 25, 20
LEVELS = np.array([0.0, 2.0, 0.5, 3.0, 1.0, 0.0, 2.5, 1.5])
X = np.repeat(LEVELS, HOLD)
SIGNALS = Signals("t", "y", "u")
GAIN = (1.2, 0.3)
CHAIN = TransferFunction([(1.5, 0.0)], [(0.3, 1.4), (0.5, 0.7), (1.0, 0.0)])


def run_of(count, h, balanced=False):
    rest = np.zeros(count, np.uint8)
    rest[0] = BALANCED if balanced else 1
    return Run(h, rest, h * np.arange(count), h * count)


def answer(rig, x, h, between, placed=(), balanced=False):
    return Chain(rig, placed).run(x, "regulator", "sensor", run_of(len(x), h, balanced), between)


@pytest.mark.parametrize("delay", [0.0, 0.23])
@pytest.mark.parametrize("alpha", [0.4, 0.7, 1.0, 1.3])
def test_an_actuator_answers_a_staircase_exactly(alpha, delay):
    rig = Rig("coil", H, SIGNALS, Actuator(0.8, alpha, GAIN), delays=Delays(actuator=delay))
    drive = (GAIN[0] + GAIN[1] * X) * X
    transfer = TransferFunction([(1.0, 0.0)], [(0.8, alpha), (1.0, 0.0)])
    exact = Convolution(transfer, H, "zero", delay).run(drive)
    found = answer(rig, X, H, Between.HELD)
    lines = answer(rig, X, H, Between.STRAIGHT)
    assert np.max(np.abs(found - exact)) < 1e-4 * np.ptp(exact)
    assert np.max(np.abs(lines - exact)) > 0.02 * np.ptp(exact)


@pytest.mark.parametrize("delay", [0.0, 0.23])
def test_orders_of_several_terms_answer_a_staircase_exactly(delay):
    exact = Convolution(CHAIN, H, "zero", delay).run(X)
    run = run_of(len(X), H)
    found = linear.run(CHAIN, X, run.rest, H, run.duration, Between.HELD, delay)
    assert np.max(np.abs(found - exact)) < 1e-4 * np.ptp(exact)


def test_what_was_held_for_ever_stays():
    rig = Rig("coil", H, SIGNALS, Actuator(0.8, 0.6, GAIN))
    found = answer(rig, np.full(60, 2.0), H, Between.HELD, balanced=True)
    np.testing.assert_allclose(found, (GAIN[0] + GAIN[1] * 2.0) * 2.0, rtol=1e-9)


EFFECTS = [
    ("unloading_asymmetry", "speed", (0.5,)),
    ("contact", "spring", (2.0, 1.5)),
    ("dead_zone", "preloaded", (0.4,)),
    ("friction", "coulomb", (0.3,)),
    ("friction", "breakaway", (0.3, 0.6)),
    ("gain_nonlinearity", "bent_spring", (0.4, 0.2, 3.0)),
    ("gain_nonlinearity", "force_factor", (-0.3, 0.1, 3.0)),
    ("softening", "worn", (0.4, 2.0)),
    ("gain_drift", "spring_settling", (0.3, 5.0)),
    ("resonance", "mass", (1.5,)),
]


@pytest.mark.parametrize("effect, form, values", EFFECTS)
def test_what_changes_the_equation_goes_on_in_lines(effect, form, values):
    """What an effect takes from the input follows the response, which does not jump: on a grid of a twentieth
    the whole comes out alike."""
    rig = Rig("coil", H, SIGNALS, Actuator(0.8, 0.7, GAIN))
    placed = (Placed(effect, form_of(effect, form), "actuator", values),)
    fine = answer(
        replace(rig, sample_time=H / FINER), np.repeat(X, FINER), H / FINER, Between.STRAIGHT, placed
    )
    found, lines = (answer(rig, X, H, way, placed) for way in (Between.HELD, Between.STRAIGHT))
    even = answer(rig, X, H, Between.HELD)
    reach = np.ptp(fine)
    assert np.std(found - even) > 0.01 * reach  # it does something
    assert np.std(found - fine[::FINER]) < 0.25 * np.std(lines - fine[::FINER])


def test_a_linear_actuator_of_real_order_is_held_too():
    rig = Rig("coil", H, SIGNALS, LinearActuator(TransferFunction([(2.0, 0.0)], [(0.8, 0.6), (1.0, 0.0)])))
    exact = Convolution(TransferFunction([(2.0, 0.0)], [(0.8, 0.6), (1.0, 0.0)]), H, "zero").run(X)
    assert np.max(np.abs(answer(rig, X, H, Between.HELD) - exact)) < 1e-4 * np.ptp(exact)


@pytest.mark.parametrize("alpha", [0.5, 0.7])
@pytest.mark.parametrize("form, values", [("coulomb", (0.3,)), ("breakaway", (0.3, 0.6))])
def test_friction_gives_way_to_a_held_input_where_a_finer_grid_does(form, values, alpha):
    """What stands still bears a jump at once: a body that a line would move over a sample stays, or goes."""
    rig = Rig("coil", H, SIGNALS, Actuator(0.8, alpha, (1.2, 0.0)))
    placed, fine = (Placed("friction", form_of("friction", form), "actuator", values),), H / 50
    for jump in np.arange(0.1, 1.2, 0.1):
        x = np.repeat([0.0, 2.0, 2.0 - jump], [5, 120, 40])
        true = answer(replace(rig, sample_time=fine), np.repeat(x, 50), fine, Between.STRAIGHT, placed)[::50]
        found = answer(rig, x, H, Between.HELD, placed)
        assert abs((found[-1] - found[124]) - (true[-1] - true[124])) < 0.02


def test_two_paces_of_several_terms_count_a_held_input_as_centred():
    """A pace next to the even one moves the response by next to nothing."""
    lags = TransferFunction([(1.5, 0.0)], [(0.024, 3.0), (0.35, 2.0), (1.2, 1.0), (1.0, 0.0)])
    rig = Rig("coil", H, SIGNALS, LinearActuator(lags))
    placed = (Placed("unloading_asymmetry", form_of("unloading_asymmetry", "speed"), "actuator", (0.9999,)),)
    even, near = (answer(rig, X, H, Between.HELD, each) for each in ((), placed))
    lines = answer(rig, X, H, Between.STRAIGHT)
    assert np.std(near - even) < 0.5 * np.std(lines - even)
