"""The sizes that a diagnosis tells: those of the rig that made the logs, in the log's units.

Red when a size is not the rig's, its interval holds no doubt of the form, or its sign is not that of the log.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.model import Candidate, Estimate, Found
from focgen.diagnosis.turned import _signed
from focgen.diagnosis.verdict.on_the_bench import _read, _seen_in, seen_as
from focgen.diagnosis.verdict.sizes import _counted, spread
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Size
from focgen.rig.rig import Actuator, Rig, Signals
from focgen.rig.turned import Turn

H, COUNT = 0.05, 2400
LAG = TransferFunction([(0.5, 0.0)], [(0.2, 1.0), (1.0, 0.0)])


def rig(sensor=1.0):
    columns = Signals("t_s", "angle_deg", "u_V", "p_bar")
    reads = TransferFunction([(sensor, 0.0)], [(1.0, 0.0)])
    return Rig("finger", H, columns, Actuator(0.8, 1.0, (12.0 / sensor,)), regulator=LAG, sensor=reads)


def command():
    rng = np.random.default_rng(2)
    steps = np.repeat(np.ravel([(0.0, up) for up in rng.uniform(0.5, 4.0, 40)]), 30)[:COUNT]
    slow = 2.0 - 2.0 * np.cos(np.arange(COUNT) * H / 6.0)
    return np.where(np.arange(COUNT) < COUNT // 2, steps, slow)


def lagged(x, tau, gain=1.0):
    """A lag of ``x``, held between samples: by a step of its own closed form."""
    kept, y = np.exp(-H / tau), np.zeros(len(x))
    for k in range(1, len(x)):
        y[k] = kept * y[k - 1] + gain * (1.0 - kept) * x[k - 1]
    return y


def backlash(x, wide):
    y = np.zeros(len(x))
    for k in range(1, len(x)):
        y[k] = min(max(y[k - 1], x[k] - wide), x[k] + wide)
    return y


def logs(band=0.0, bend=0.0, down=1.0):
    """Of a finger whose valve has a play of half width ``band`` V, or whose angle bends by ``bend``."""
    rng, u = np.random.default_rng(3), command()
    pressure = lagged(backlash(u, band), 0.2, 0.5)
    fine = np.interp(np.arange(COUNT * 10) / 10.0, np.arange(COUNT), pressure)
    kept, angle = np.exp(-H / 10 / 0.8), np.zeros(COUNT * 10)
    for k in range(1, COUNT * 10):
        angle[k] = kept * angle[k - 1] + 12.0 * (1.0 - kept) * fine[k - 1]
    output = angle[::10] * (1.0 + bend * (angle[::10] / 24.0))
    signals = {
        "command": u,
        "pressure": pressure + rng.normal(0.0, 0.006, COUNT),
        "output": down * (output + rng.normal(0.0, 0.08, COUNT)),
    }
    return [Experiment("session", H, signals)]


def size(found, what):
    (cause,) = found.causes
    return cause.candidates[0].sizes[what]


def test_the_travel_that_a_valve_loses_is_told_in_volts():
    found = size(diagnose(rig(), logs(band=0.15), pictures=False), "command lost at each reversal")
    assert found.unit == "V" and found.ci95[0] < 0.30 < found.ci95[1]
    assert 0.04 < (found.ci95[1] - found.ci95[0]) / found.value < 0.2


@pytest.mark.parametrize("down, sensor", [(1.0, 1.0), (-1.0, 1.0), (1.0, 0.2)])
def test_a_bent_curve_is_told_as_the_log_has_it(down, sensor):
    """A bend of a quarter at the top lies a sixteenth of the top below the line between the ends."""
    rig_of = rig(sensor)
    given = replace(rig_of, actuator=replace(rig_of.actuator, gain=(down * rig_of.actuator.gain[0],)))
    found = size(diagnose(given, logs(bend=0.25, down=down), pictures=False), "bend of the static curve")
    top = 24.0
    assert found.unit == "deg" and down * found.value < 0.0
    assert abs(found.value) == pytest.approx(top / 16.0, rel=0.1)
    assert found.ci95[0] < found.value < found.ci95[1]


def test_numbers_of_either_sign_are_turned_and_others_are_not():
    known = {"bend of the static curve": Estimate(1.0, (0.9, 1.2), "deg")}
    wide = {"widest loop": Estimate(1.0, (0.9, 1.2), "deg")}
    causes = [
        Candidate("gain_nonlinearity", "actuator", 0.9, "cubic", {}, 0.0, known),
        Candidate("hysteresis", "actuator", 0.9, "play", {}, 0.0, wide),
    ]
    turn = Turn({"command": 1, "pressure": 1, "curvature": -1, "output": -1})
    bent, loop = _signed(Found("actuator", tuple(causes), 0.5, (0.4, 0.6)), turn, rig()).candidates
    assert bent.sizes == {"bend of the static curve": Estimate(-1.0, (-1.2, -0.9), "deg")}
    assert loop.sizes == wide


def test_what_leaves_an_actuator_is_told_as_the_output_shows_it_where_nothing_else_does():
    assert seen_as("curvature", rig()) == "output" and seen_as("pressure", rig()) == "pressure"
    logged = replace(rig(), signals=replace(rig().signals, curvature="k"))
    assert seen_as("curvature", logged) == "curvature"
    integrates = TransferFunction([(1.0, 0.0)], [(1.0, 1.0)])
    assert seen_as("curvature", replace(rig(), sensor=integrates)) == "curvature"


def fit_of(information, low, high):
    """A fit of two numbers behind one nuisance, of a hundred innovations of square 1."""
    candidate = SimpleNamespace(form=SimpleNamespace(parameters=("one", "two")))
    problem = SimpleNamespace(candidates=(candidate,), head=1, nominal_start=np.zeros(0))
    problem.bounds = lambda: (np.array(low, float), np.array(high, float))
    innovations = np.ones(103)
    return SimpleNamespace(
        problem=problem, vector=np.zeros(3), innovations=innovations, sse=100.0, information=information
    )


def test_what_is_not_known_is_not_known_beside_a_number_that_cannot_move():
    """A nuisance without room was one of no variance, and all that was less sure passed for known."""
    little = np.diag([1.0, 0.005, 4.0])
    for room in (0.0, 1.0):
        places, covariance = spread(fit_of(little, [0.0, -9.0, -9.0], [room, 9.0, 9.0]), [0])
        assert places == [1, 2]
        np.testing.assert_allclose(np.diag(covariance), [200.0, 0.25])


def test_a_nuisance_is_no_further_off_than_it_may_be():
    """A gauge that would be anything, and looks like the first number, may be off by one at most."""
    alike = np.array([[50.0, 50.0, 0.0], [50.0, 50.0, 0.0], [0.0, 0.0, 4.0]])
    _, covariance = spread(fit_of(alike, [-1.0, -9.0, -9.0], [1.0, 9.0, 9.0]), [0])
    assert covariance[0, 0] == pytest.approx(1.0 / 50.0 + 4.0 / 12.0, rel=1e-6)


def test_a_step_is_known_to_half_a_level_over_the_span():
    assert _counted([0.4, 0.5, 0.6], 10.0) == [0.4875, 0.5, 0.5125]
    assert _counted([0.499, 0.5, 0.501], 10.0) == [0.499, 0.5, 0.501]


def of_rows(step):
    return SimpleNamespace(problem=SimpleNamespace(segment=SimpleNamespace(fed=SimpleNamespace(run=step))))


def test_what_leaves_the_actuator_is_told_in_what_the_sensor_makes_of_it():
    assert _seen_in("out", "actuator", rig(0.2)) == (pytest.approx(0.2), "deg")
    assert _seen_in("out/s", "regulator", rig()) == (1.0, "bar/s")
    assert _seen_in("in", "actuator", rig()) == (1.0, "bar") and _seen_in("%", "sensor", rig()) == (1.0, "%")


@pytest.mark.parametrize("half, told", [(0.5, True), (2.5, False)])
def test_a_size_that_may_be_nothing_at_all_is_none(half, told):
    found = SimpleNamespace(
        read=lambda size: 2.0,
        half=lambda size, value: half,
        bench=SimpleNamespace(stage="regulator"),
        of=of_rows(SimpleNamespace(h=1.0)),
    )
    lag = _read(found, Size("further lag", "s"), rig())
    assert (lag is not None) == told
    if told:  # as noise leaves it, a twentieth of itself, and three tenths of a sample
        assert lag.ci95[1] - lag.value == pytest.approx(np.sqrt(0.5**2 + 0.1**2 + 0.3**2))
