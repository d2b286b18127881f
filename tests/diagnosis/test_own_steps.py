"""What a converter's steps explain where each comes at a place of its own.

Red when what a rig does slowly is taken for steps that are uneven, or uneven steps for what a rig does.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses.converter import converter_of, rms
from focgen.diagnosis.hypotheses.explain import candidates_for
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.hypotheses.own_steps import _place, _way, left_by_own_steps
from focgen.diagnosis.hypotheses.search import likeliest_on_all
from focgen.diagnosis.hypotheses.seen_through import _hidden
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import make
from tests.diagnosis.test_converters import HEATER, answered, session, slower_down


def stepped(logs, *families):
    """The converter of a session, and fits with its steps: of the rig by itself, and with each family."""
    problem = problem_of(HEATER, make(logs, "command", "output", None, None), logs)
    every = candidates_for(problem.segment, HEATER)
    converter, nominal = converter_of(problem, every), problem.nominal()
    alone = fit(problem, nominal, WHITE)
    others = [likeliest_on_all(problem, nominal, [c for c in every if c.effect == n]) for n in families]
    return converter, *map(converter.stepped, (alone, *others))


def test_a_place_parts_levels_best_and_no_equal_samples():
    rng = np.random.default_rng(0)
    for _ in range(200):
        x = np.sort(rng.normal(size=12).round(1))
        above = x + 0.4 * rng.normal(size=12) > 0.1
        trust = rng.uniform(size=12)
        missed = lambda place: np.sum(trust[(x >= place) != above])
        assert missed(_place(x, above, trust)) == pytest.approx(min(missed(p) for p in [*x, np.inf]))


def test_the_way_of_an_experiment_begins_with_it():
    x = np.array([0.0, 5.0, 5.0, 0.0, 0.0, 5.0, 3.0])
    assert _way(x, [(0, 3), (3, 7)]).tolist() == [False, True, True, False, False, True, False]


@pytest.mark.parametrize("seed", range(3, 7))
def test_steps_that_are_uneven_leave_nothing_at_places_of_their_own(seed):
    converter, alone, slower = stepped(slower_down(4.0, 0.8, 0.25, seed), "unloading_asymmetry")
    assert left_by_own_steps(alone) < 0.05 * rms(alone.weighed) ** 2
    assert [hidden for hidden, _ in _hidden(converter, alone, {"slower": slower})] == [converter.left**2]


def drifting(step, share):
    """A rig whose gain falls by a ``share`` over its session, read in even steps."""
    logs = session(1e-9, 0.0, 1)
    for i, log in enumerate(logs):
        falls = 1.0 - share * (np.arange(len(log)) + 1200 * i) / 2040
        read = step * np.round(answered(log["command"]) * falls / step)
        logs[i] = replace(log, signals={**log.signals, "output": read})
    return logs


def test_what_drifts_no_places_explain():
    """A leak does not explain it either, and is not tried against what such places leave."""
    converter, alone, drift, leak = stepped(drifting(4.0, 0.1), "gain_drift", "leak")
    assert left_by_own_steps(alone) > 0.6 * rms(alone.weighed) ** 2
    assert left_by_own_steps(drift) < 0.1 * left_by_own_steps(alone)
    tried = {"drift": drift, "leak": leak}
    (usual, all_of_them), (less, far) = _hidden(converter, alone, tried)
    assert (usual, all_of_them) == (converter.left**2, tried)
    assert less == pytest.approx(rms(alone.weighed) ** 2 - left_by_own_steps(alone))
    assert list(far) == ["drift"]


def test_a_converter_makes_something_at_any_place():
    """What moves a few samples of a sound converter is no effect."""
    converter, alone, drift = stepped(drifting(4.0, 0.02), "gain_drift")
    _, (least, _) = _hidden(converter, alone, {"drift": drift})
    assert least == pytest.approx(NUMBERS.vain * converter.left**2)
    assert rms(alone.weighed) ** 2 - left_by_own_steps(alone) < least
