"""What is left louder where the rig moves than where it rests: something that no effect is acts there.

Red when a damper that warms is the rig's own numbers, when a camera that loses fast motion is a valve for
sure, or when noise of any colour, or an effect that is there, counts as such.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.verdict import restless as restless_of
from focgen.diagnosis.verdict.restless import louder
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, T, GAIN = 0.04, 0.4, 3.0
LAG = TransferFunction([(GAIN, 0.0)], [(T, 1.0), (1.0, 0.0)])
RIG = Rig("arm", H, Signals("t", "y", "u"), LinearActuator(LAG))


def commands():
    """Three experiments (n,) of levels held for two to five seconds, the last as the first."""
    rng = np.random.default_rng(5)
    held = [np.repeat(rng.uniform(0.2, 2.0, 10), rng.integers(100, 190, 10)) for _ in range(2)]
    return [np.r_[np.zeros(50), x] for x in (*held, held[0])]


def session(seed, pace=lambda clock: 1.0, seen=lambda y: y, colour=0.0):
    """The logs of a lag whose time constant is so many times T by the session's clock, and what is ``seen``
    of its output; noise of 0.4 % of it, each sample keeping ``colour`` of the last."""
    rng, logs, start = np.random.default_rng(seed), [], 0.0
    for number, u in enumerate(commands()):
        y, made = 0.0, np.empty(len(u))
        for i, x in enumerate(u):
            made[i] = y
            y += (GAIN * x - y) * -np.expm1(-H / (T * pace(start + i * H)))
        noise = 0.024 * rng.normal(size=len(u))
        for i in range(1, len(u)):
            noise[i] = colour * noise[i - 1] + np.sqrt(1.0 - colour**2) * noise[i]
        logs.append(Experiment(f"log{number}", H, {"command": u, "output": seen(made) + noise}, start=start))
        start += len(u) * H + 30.0
    return logs


def blurred(y):
    """What a camera reads that keeps the last place while the motion is fast."""
    kept = y.copy()
    for i in range(1, len(y)):
        if abs(y[i] - y[i - 1]) > 0.1:
            kept[i] = kept[i - 1]
    return kept


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_a_damper_that_warms_is_not_the_rigs_own_numbers(seed):
    found = diagnose(RIG, session(seed, pace=lambda clock: np.exp(0.35 - clock / 250.0)), pictures=False)
    assert found.verdict == "unknown"


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_a_camera_that_loses_fast_motion_is_nothing_for_sure(seed):
    found = diagnose(RIG, session(seed, seen=blurred), pictures=False)
    sure = [c.confidence for cause in found.causes for c in cause.candidates]
    assert found.verdict == "unknown" or max(sure) <= 0.67
    assert found.verdict == "unknown" or any("where it rests" in note for note in found.notes)


@pytest.mark.parametrize("colour", [0.0, pytest.param(0.7, marks=pytest.mark.long)])
def test_noise_is_as_loud_at_rest(colour):
    assert diagnose(RIG, session(3, colour=colour), pictures=False).verdict in ("none", "parameters")


def test_what_an_effect_explains_keeps_its_confidence():
    found = diagnose(RIG, session(4, seen=lambda y: np.r_[np.zeros(4), y[:-4]]), pictures=False)
    assert max(c.confidence for cause in found.causes for c in cause.candidates) > 0.9


@pytest.mark.parametrize("causes", [(), ("an effect",)], ids=["alone", "beside an effect"])
@pytest.mark.parametrize("times, restless", [(4.5, False), (7.5, True)])
def test_a_form_that_is_a_little_wrong_leaves_little_more_where_it_moves(
    times, restless, causes, monkeypatch
):
    monkeypatch.setattr(restless_of, "louder", lambda e: times)
    monkeypatch.setattr(restless_of, "is_rounded", lambda causes: False)
    segment = SimpleNamespace(closed=False, pace=0.0, withheld=0.0)
    e = SimpleNamespace(segment=segment, converter=None, causes=causes)
    assert restless_of.is_restless(e) is restless


def explained(made, left):
    """As much of an explanation as tells how loud is what it leaves of two experiments."""
    return SimpleNamespace(
        segment=SimpleNamespace(parts=lambda signal: np.split(signal, 2), run=SimpleNamespace(h=H)),
        nominal=SimpleNamespace(
            problem=SimpleNamespace(references=SimpleNamespace(clocks={"response": 20.0 * H}))
        ),
        best=SimpleNamespace(
            problem=SimpleNamespace(simulate=lambda vector: made), vector=None, weighed=left
        ),
    )


@pytest.mark.parametrize("times, told", [(1.0, 1.0), (3.0, 9.0)])
def test_how_much_louder_is_told_where_it_is_sure(times, told):
    made = np.tile(np.repeat([0.2, 1.0, 0.3, 1.4], 150), 6)
    for first in range(0, len(made), 150):  # each level is come to in 60 samples, and held
        made[first : first + 60] = np.linspace(made[first - 1], made[first], 60)
    moving = np.abs(np.arange(len(made)) % 150 - 49) < 44  # two responses are felt, and a little is a rest
    left = np.random.default_rng(7).normal(size=len(made)) * np.where(moving, times, 1.0)
    found = louder.__wrapped__(explained(made, left))
    assert found == (1.0 if told == 1.0 else pytest.approx(told, rel=0.3))


def test_a_few_stretches_tell_nothing():
    made = np.r_[np.zeros(200), np.linspace(0.0, 1.0, 200)]
    left = np.random.default_rng(8).normal(size=400) * np.where(made > 0.0, 5.0, 1.0)
    assert louder.__wrapped__(explained(made, left)) == 1.0
