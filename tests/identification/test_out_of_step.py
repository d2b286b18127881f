"""A command that is ahead of its rows, or behind them, by a part of a sample: the rig keeps its numbers.

Red when T or alpha take up what columns are out of step by, or a held command is taken for straight lines.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.errors import FitError
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.identification.identify import identify
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

H, FINE, COUNT = 0.2, 10, 800  # s, parts of a sample, samples
TAU, T, GAIN = 0.263, 0.68, 0.66
NOISE = 0.004


def steps(rng, count=COUNT, held=18):
    """Steps to levels of 0.8 to 3 and back to 0, none of them in the first sample."""
    return np.repeat(np.ravel([(0.0, up) for up in rng.uniform(0.8, 3.0, count)]), held)[:count]


def moved(command, lead):
    """A command (n,) as it was sent, at FINE parts of a sample: ``lead`` samples ahead of its rows."""
    sent, parts = np.repeat(command, FINE), round(lead * FINE)
    if parts < 0:
        return np.r_[np.full(-parts, sent[0]), sent[:parts]]
    return np.r_[sent[parts:], np.full(parts, sent[-1])]


def lag(x, tau):
    kept = np.exp(-H / FINE / tau)
    return lfilter([0.0, 1.0 - kept], [1.0, -kept], x)


def logs_of(lead, alpha=1.0, first=0, pressure=False):
    """Two logs of a plant, behind a lag where the ``pressure`` is logged, from their ``first`` sample on."""
    rng, logs = np.random.default_rng(0), []
    plant = TransferFunction([(GAIN, 0.0)], [(T, alpha), (1.0, 0.0)])
    for number in range(2):
        command = steps(rng)
        driven = moved(command, lead)
        driven = lag(1.1 * driven, TAU) if pressure else driven
        output = Convolution(plant, H / FINE, "linear" if pressure else "zero").run(driven)[::FINE]
        signals = {"command": command, "output": output + rng.normal(0.0, NOISE, COUNT)}
        if pressure:
            signals["pressure"] = driven[::FINE] + rng.normal(0.0, NOISE, COUNT)
        kept = {role: values[first:] for role, values in signals.items()}
        logs.append(Experiment(f"e{number}", H, kept, start=900.0 * number))
    return logs


PLANT = Rig("finger", H, Signals("t", "y", "u"), Actuator(T, 1.0, (GAIN,)))


@pytest.mark.parametrize("lead", [0.1, 0.3, 0.8, 1.0, -0.3, 0.0])
@pytest.mark.parametrize("alpha", [1.0, 0.7])
def test_a_plant_keeps_its_numbers(lead, alpha):
    found = identify(PLANT, logs_of(lead, alpha), integer=False)
    assert found.rig.actuator.T == pytest.approx(T, rel=0.01)
    assert found.rig.actuator.alpha == pytest.approx(alpha, abs=0.005)
    assert found.rig.between == Between.HELD and not found.rig.delays.total
    (told,) = [n for n in found.notes if "its command" in n] or [""]
    expected = f"{abs(lead):.2g} samples) {'ahead of' if lead > 0 else 'behind'}" if lead else ""
    assert expected in told and bool(told) == bool(lead)


def test_a_plant_whose_logs_begin_in_motion_keeps_its_numbers():
    found = identify(PLANT, logs_of(0.8, 0.7, first=250), integer=False)
    assert found.rig.actuator.T == pytest.approx(T, rel=0.01)
    assert found.rig.actuator.alpha == pytest.approx(0.7, abs=0.01)


def test_a_log_that_begins_with_its_step_is_led_by_it_as_well():
    (one, other) = logs_of(0.6)
    begins = int(np.argmax(one["command"] > 0.0))
    cut = Experiment("cut", H, {role: v[begins:] for role, v in one.signals.items()})
    found = identify(PLANT, [cut, other], integer=False)
    assert found.rig.actuator.T == pytest.approx(T, rel=0.01)
    assert found.rig.actuator.alpha == pytest.approx(1.0, abs=0.01)


def test_a_dead_time_of_more_than_half_a_sample_is_none_of_the_columns():
    told = identify(PLANT, logs_of(-0.8), integer=False).notes
    assert not any("behind its command" in note for note in told)
    found = identify(PLANT, logs_of(-0.8), integer=False, delay=True)
    assert found.rig.delays.actuator == pytest.approx(0.8 * H, rel=0.02)
    assert found.rig.actuator.T == pytest.approx(T, rel=0.01)


def test_an_early_command_does_not_pass_for_a_dead_time():
    found = identify(PLANT, logs_of(0.3), integer=False, delay=True)
    assert found.rig.delays.actuator == pytest.approx(0.0, abs=0.01 * H)
    assert found.rig.actuator.T == pytest.approx(T, rel=0.01)


@pytest.mark.parametrize("lead", [0.1, 0.5, 1.0, 0.0])
def test_a_regulator_keeps_its_numbers(lead):
    found = identify(PLANT, logs_of(lead, pressure=True), stages=("regulator",), integer=False)
    fit = found.stages["regulator"]
    assert fit.parameters["T"][0] == pytest.approx(TAU, rel=0.01) and fit.delay == 0.0
    assert fit.parameters.get("lead", (0.0, 0.0))[0] == pytest.approx(lead * H, abs=0.01 * H)
    assert found.rig.between is None


def test_integer_models_are_led_as_well():
    led, rested = (identify(PLANT, logs_of(lead, 0.7)).gof for lead in (0.5, 0.0))
    for model in ("iom_3p2z", "rig"):  # as good as the plant
        assert led[model]["mean"] == pytest.approx(rested[model]["mean"], abs=0.002)


def test_a_command_that_never_rests_is_ahead_of_nothing():
    """Of a smooth command a part of a sample is a lag."""
    rng = np.random.default_rng(1)
    logs = []
    for number in range(2):
        command = 1.5 + np.convolve(rng.normal(size=COUNT + 30), np.ones(31) / 6.0, "valid")
        sent = np.interp(np.arange(COUNT * FINE) / FINE, np.arange(COUNT), command)
        made = GAIN * lag(sent, T)[::FINE]
        logs.append(Experiment(f"e{number}", H, {"command": command, "output": made}, start=900.0 * number))
    found = identify(PLANT, logs, integer=False)
    assert not any("ahead of its command" in note for note in found.notes)


@pytest.mark.parametrize("lead", [1.3, 1.8])
def test_a_command_may_be_more_than_a_sample_ahead(lead):
    found = identify(PLANT, logs_of(lead), integer=False)
    assert found.rig.actuator.T == pytest.approx(T, rel=0.01)
    assert any(f"({lead:g} samples) ahead" in note for note in found.notes)


def test_what_is_further_ahead_is_refused():
    """It was taken for one sample, with K known to 6 % and 10 % off."""
    with pytest.raises(FitError, match="look at its columns"):
        identify(PLANT, logs_of(2.6), integer=False)


@pytest.mark.parametrize("lead", [0.6, 0.0])
def test_a_log_whose_command_moves_in_the_second_row(lead):
    rng, up = np.random.default_rng(3), np.r_[0.0, np.full(COUNT - 1, 2.0)]
    pulse = np.where(np.arange(COUNT) == 1, 2.0, 0.0)
    for commands in ([up], [pulse, steps(rng)]):
        logs = []
        for number, command in enumerate(commands):
            made = GAIN * lag(moved(command, lead), T)[::FINE] + rng.normal(0.0, NOISE, COUNT)
            logs.append(Experiment(f"e{number}", H, {"command": command, "output": made}))
        found = identify(PLANT, logs, integer=False, gain_degree=0)
        assert found.rig.actuator.T == pytest.approx(T, rel=0.02)
        assert found.rig.actuator.gain[0] == pytest.approx(GAIN, rel=0.02)


def test_a_command_that_never_moves_is_ahead_of_nothing():
    rng = np.random.default_rng(4)
    made = GAIN * lag(np.full(300 * FINE, 2.0), T)[::FINE] + rng.normal(0.0, NOISE, 300)
    found = identify(
        PLANT, [Experiment("e", H, {"command": np.full(300, 2.0), "output": made})], integer=False
    )
    assert not any("its command" in note for note in found.notes) and found.rig.between is None


def test_the_tables_call_a_lead_a_lead():
    found = identify(PLANT, logs_of(0.5, pressure=True), stages=("regulator",), integer=False)
    fit = found.stages["regulator"]
    assert fit.shape == "1p+lead"
    for one in fit.fits:
        assert one.parameters.get("delay", (0.0,))[0] >= 0.0
        assert ("lead" in one.parameters) == one.shape.endswith("+lead")
