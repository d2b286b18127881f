"""What is not there by as much all along is not the effect that it is taken for.

Red when stretches of noise are told apart, when stretches that differ are not or are not said, or when a real
effect, and one whose delay is another at every pressure, are taken for one another.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.findings import explain_all
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict import unsteady as judging
from focgen.diagnosis.verdict.unsteady import unsteady
from tests.diagnosis_rig import RIG, H, session

COUNT, LONG = 5, 800


def stretches(seed, differ, noise=1.0):
    """A shape (n,) that a fit gives an effect, and what it leaves: noise, and ``differ`` of the shape, more
    in the first two quarters of every experiment and less in the last two."""
    rng = np.random.default_rng(seed)
    shape = np.sin(np.arange(COUNT * LONG) * 0.07) * np.repeat(rng.uniform(0.5, 2.0, COUNT), LONG)
    more = np.tile(np.repeat([1.0, -1.0], LONG // 2), COUNT)
    return shape, differ * more * shape + rng.normal(0.0, noise, len(shape))


def judged(shape, left):
    spans = tuple((k * LONG, (k + 1) * LONG) for k in range(COUNT))
    run = SimpleNamespace(spans=spans, h=0.1)
    segment = SimpleNamespace(run=run, names=tuple(f"log{k}" for k in range(COUNT)))
    return judging._judged(SimpleNamespace(segment=segment), frozenset({"leak"}), shape, left)


@pytest.mark.parametrize("seed", range(20))
def test_stretches_of_noise_do_not_differ(seed):
    found = judged(*stretches(seed, differ=0.0))
    assert found.by < 0.05 and found.sure < 1e-3


@pytest.mark.parametrize("differ, likelier", [(0.1, False), (0.3, False), (0.6, True)])
@pytest.mark.parametrize("seed", range(5))
def test_by_how_much_stretches_differ_is_told(seed, differ, likelier):
    found = judged(*stretches(seed, differ, noise=0.3))
    assert found.by == pytest.approx(differ, abs=0.03)
    assert (found.odds > 0.0) == likelier
    assert found.most.within < 0.5 * LONG * 0.1 <= found.least.within
    assert found.most.times == pytest.approx(1.0 + differ, abs=0.1)
    assert found.most.experiment in found.said and f"{found.least.times:.1f} times" in found.said


def test_an_effect_that_shows_in_one_stretch_has_nothing_to_agree_with():
    shape, left = stretches(1, differ=0.0)
    shape[LONG // 4 :] = 0.0
    assert judged(shape, left) is None


def test_what_noise_is_other_than_assumed_tells_nothing(monkeypatch):
    """A small part of what is left goes with an effect, here more and there less: more than chance."""
    shape, differing = stretches(1, differ=1.0, noise=0.0)
    left = 0.02 * (-1.0) ** np.arange(len(shape))
    along = np.sqrt(48.0 / len(shape)) * np.std(left) / np.std(shape)  # of χ², which is 36 by chance
    left = left + along * differing
    assert judged(shape, left).by == 0.0
    monkeypatch.setattr(judging, "NUMBERS", replace(NUMBERS, other=0.0))
    assert judged(shape, left).by > 0.0


@pytest.mark.parametrize("left_of_it", [0.0, 1e-17, 1e-170])
def test_what_rounding_leaves_of_an_effect_is_no_stretch(left_of_it):
    shape, left = stretches(1, differ=0.0)
    shape[LONG // 4 :] *= left_of_it
    assert judged(shape, left) is None and judged(0.0 * shape, left) is None


def earlier_when_full(most):
    """Logs of a rig whose pressure is as much as ``most`` s late, the less the higher it is."""
    made = []
    for number, log in enumerate(session(4, noise=0.0, roles=("pressure",))):
        p, t = log["pressure"], np.arange(len(log["pressure"])) * H
        read = np.interp(t - most * np.clip(1.0 - p / 0.18, 0.0, 1.0), t, p, left=p[0])
        noise = np.random.default_rng(number).normal(0.0, 0.0006, len(p))
        made.append(replace(log, signals={**log.signals, "pressure": read + noise}))
    return made


@pytest.mark.long
def test_a_delay_that_is_another_at_every_pressure_is_neither_a_valve_nor_a_delay():
    (e, *_) = explain_all(RIG, earlier_when_full(0.6), NUMBERS.nats, ["valve_asymmetry", "transport_delay"])
    doubts = {name: one for one in unsteady(e) for name in one.instead}
    assert doubts["transport_delay"].by > 1.2 * NUMBERS.form and doubts["valve_asymmetry"].by > NUMBERS.form


@pytest.mark.parametrize("effect", [{"vent": 0.5}, {"delay": 3}])
def test_a_valve_and_a_delay_are_there_by_as_much_all_along(effect):
    (e, *_) = explain_all(RIG, session(1, **effect), NUMBERS.nats, ["valve_asymmetry", "transport_delay"])
    assert unsteady(e) and all(one.by < 0.05 for one in unsteady(e))
