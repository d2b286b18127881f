"""A time that depends on the level is no effect, as long as it is within the uncertainty of the time.

Red when what a nominal time leaves of such a rig is named, or when an effect is taken for such a time.
"""

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.hypotheses.level_pace import level_pace
from focgen.diagnosis.problem.segments import make
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals

H, T = 0.05, 0.8
U = [np.repeat(levels, 120) for levels in ([0, 1, 0, 0.6, 0, 0.3, 0], [0, 0.25, 0.5, 0.75, 1, 0.6, 0.2])]
U += [0.5 - 0.5 * np.cos(np.r_[0:60:H] * 0.9)]


def lag(u, grows, top=1.0, fine=10):
    """T (1 + grows y/top) dy/dt + y = u, u in lines between samples, by small Euler steps."""
    y, made = 0.0, []
    for a, b in zip(u, np.r_[u[1:], u[-1]]):
        made.append(y)
        for x in np.linspace(a, b, fine, endpoint=False):
            y += H / fine * (x - y) / (T * (1.0 + grows * y / top))
    return np.array(made)


def rig(kind):
    """A lag of gain 1, as a model of pressure and as a transfer function."""
    whole = LinearActuator(TransferFunction([(1.0, 0.0)], [(T, 1.0), (1.0, 0.0)]))
    actuator = {"K(p)": Actuator(T, 1.0, (1.0,)), "transfer": whole}[kind]
    return Rig("lag", H, Signals(time="t", pressure="u", output="y"), actuator)


def logs(change, noise=0.0):
    rng = np.random.default_rng(5)
    made = (change(u) for u in U)
    return [
        Experiment(f"{k}", H, {"pressure": u, "output": y + noise * rng.standard_normal(len(y))})
        for k, (u, y) in enumerate(zip(U, made))
    ]


@pytest.mark.parametrize("kind", ["K(p)", "transfer"])
def test_its_share_of_the_output_is_that_of_the_equation(kind):
    """To first order: a hundredth of an independent solution's change at a tenth of the uncertainty."""
    of = rig(kind)
    column = level_pace(of, make(logs(lambda u: lag(u, 0.0)), "pressure", "output"))
    small = 0.02
    top = max(float(np.max(lag(u, 0.0))) for u in U)
    change = np.concatenate([lag(u, small, top) - lag(u, 0.0, top) for u in U])
    expected = change / small * of.uncertainty.actuator.time / 3.0
    assert np.max(np.abs(column - expected)) < 0.06 * np.max(np.abs(expected))


def test_a_stage_that_holds_no_level_has_none():
    """A high-pass is at 0 in the end, whatever drives it."""
    passing = LinearActuator(TransferFunction([(T, 1.0)], [(T, 1.0), (1.0, 0.0)]))
    of = Rig("high-pass", H, Signals(time="t", pressure="u", output="y"), passing)
    assert level_pace(of, make(logs(lambda u: u - lag(u, 0.0)), "pressure", "output")) is None


def test_within_the_uncertainty_it_is_no_effect():
    """A tenth of the time beside noise of 0.2 %; taken for one number the rig is `unknown`."""
    found = diagnose(rig("transfer"), logs(lambda u: lag(u, 0.1), 2e-3), pictures=False)
    assert found.verdict in ("none", "parameters") and not found.causes
    assert any("slower at its highest level" in note for note in found.notes)


def test_a_loop_is_no_such_time():
    """A play of 0.04 keeps its name."""

    def play(u):
        y, made = 0.0, []
        for x in lag(u, 0.0):
            y = min(max(y, x - 0.02), x + 0.02)
            made.append(y)
        return np.array(made)

    found = diagnose(rig("transfer"), logs(play, 2e-3), pictures=False)
    assert found.causes and "hysteresis" in found.causes[0].candidates[0].effect
