"""What was found first, looked for anew beside what was found next.

Red when the first effect keeps the numbers or the form that it had while nothing stood for the second.
Red when it is exchanged for one that follows anything, or when a fit that leaves noise is looked at again.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.belief.further import Surroundings
from focgen.diagnosis.fitting.fit import WHITE, fit
from focgen.diagnosis.hypotheses import anew as looked
from focgen.diagnosis.hypotheses import explain
from focgen.diagnosis.hypotheses.accept import AcceptanceCriteria
from focgen.diagnosis.hypotheses.anew import looked_anew, may_be
from focgen.diagnosis.hypotheses.explain import candidates_for
from focgen.diagnosis.hypotheses.initial import begun_session
from focgen.diagnosis.hypotheses.nuisances import uncertain
from focgen.diagnosis.hypotheses.rivals import left_out
from focgen.diagnosis.hypotheses.search import Ranking
from focgen.diagnosis.problem.problem import CandidateEffect
from focgen.diagnosis.problem.segments import make
from focgen.logs.experiment import Experiment
from focgen.rig.effects import form_of
from tests.diagnosis.test_valves import valve
from tests.diagnosis_rig import RIG, H, _lag, commands

BAND, LEFT, CEILING, LARGEST = 0.35, 0.15, 0.12, 1.8


def sticking(ceiling=CEILING, seed=0):
    """The regulator of a rig whose valve sticks ahead of a supply that gives no more than ``ceiling``."""
    rng, logs = np.random.default_rng(seed), []
    for name, u in commands().items():
        drive = np.minimum(0.1 * valve(np.r_[0.0, u], BAND, LEFT, True, 0.0)[1:], ceiling)
        p = _lag(drive, 0.12) + 1e-3 * rng.standard_normal(len(u))
        logs.append(Experiment(name, H, {"command": u, "pressure": p, "output": p}))
    return begun_session(RIG, logs)


@pytest.fixture(scope="module")
def regulator():
    session = sticking()
    segment = make(session, "command", "pressure")
    return uncertain(RIG, segment, session), candidates_for(segment, RIG)


def ranked(regulator, form, values, second=("supply_saturation", "hard")):
    """A valve of this form and with these numbers, and the foremost of what may be beside it."""
    problem, candidates = regulator
    known = {(c.effect, c.form.name): c for c in candidates}
    first, other = known["valve_stiction", form], known[second]
    alone, both = problem.with_candidates([first]), problem.with_candidates([first, other])
    base = fit(alone, np.r_[problem.nominal(), values], WHITE, 0)
    beside = fit(both, np.r_[base.vector, both.starts(other)[0]], WHITE, 12)
    best = {other.effect: beside}
    return Ranking(base, np.ones(1), best, {other.effect: 1e3}, {other.effect: 0.5})


def anew(regulator, ranking):
    nothing = fit(regulator[0], regulator[0].nominal(), WHITE, 4)
    return looked_anew(nothing, ranking, regulator[1], Surroundings())


def band(fitted):
    """Of the valve, in the command's unit."""
    return fitted.problem.values(fitted.vector)[0][0]


def test_a_valve_s_band_is_looked_for_again_beside_a_ceiling(regulator):
    ranking = ranked(regulator, "slips", (0.3, LEFT / BAND))
    before, after = ranking.best["supply_saturation"], anew(regulator, ranking).best["supply_saturation"]
    assert abs(band(before) - BAND) > 0.05 and after.sse < 0.1 * before.sse
    assert band(after) == pytest.approx(BAND, abs=0.01)


def test_a_form_that_was_the_better_one_alone_is_exchanged_beside_a_ceiling(regulator):
    ranking = ranked(regulator, "play", (0.15,))
    before, after = ranking.best["supply_saturation"], anew(regulator, ranking).best["supply_saturation"]
    assert after.problem.candidates[0].form.name == "slips" and after.sse < 0.2 * before.sse
    assert band(after) == pytest.approx(BAND, abs=0.01)
    assert [c.effect for c in after.problem.candidates] == ["valve_stiction", "supply_saturation"]


def test_what_leaves_noise_is_not_looked_at_again(regulator, monkeypatch):
    ranking = ranked(regulator, "slips", (BAND / LARGEST, LEFT / BAND))
    monkeypatch.setattr(looked, "_anew", lambda of, candidates: pytest.fail("looked at"))
    assert anew(regulator, ranking) is ranking


def test_what_fell_behind_stays_known_and_is_not_ranked(regulator):
    ranking = ranked(regulator, "slips", (0.3, LEFT / BAND))
    behind = ranked(regulator, "slips", (0.3, LEFT / BAND), ("leak", "turbulent")).best["leak"]
    found = anew(regulator, replace(ranking, left=(behind,)))
    assert found is not ranking and behind in found.left and list(found.best) == ["supply_saturation"]


def test_without_the_second_the_first_has_the_form_that_is_likelier_alone(regulator):
    problem, candidates = regulator
    known = {(c.effect, c.form.name): c for c in candidates}
    ranking = ranked(regulator, "slips", (BAND / LARGEST, LEFT / BAND))
    both = problem.with_candidates([known["valve_stiction", "play"], known["supply_saturation", "hard"]])
    of = fit(both, np.r_[problem.nominal(), 0.15, 0.7], WHITE, 8)
    last = [of.problem.candidates[-1]]
    alone, likelier = left_out(of, last, WHITE), left_out(of, last, WHITE, [ranking.base])
    assert [c.form.name for c in alone.problem.candidates] == ["play"]
    assert [c.form.name for c in likelier.problem.candidates] == ["slips"] and likelier.sse < alone.sse


@pytest.mark.parametrize(
    "family, form, own, may",
    [
        ("gain_drift", "linear", "bending", True),
        ("gain_drift", "wandering", "bending", False),  # it would follow whatever the other makes
        (
            "gain_nonlinearity",
            "limited",
            "spline_behind",
            False,
        ),  # ahead of the dynamics it is another effect
    ],
)
def test_only_a_form_of_the_like_takes_the_place(family, form, own, may):
    other, own = (CandidateEffect(family, form_of(family, name), "actuator") for name in (form, own))
    assert may_be(other, own) is may


def test_what_is_accepted_has_been_looked_at_anew(regulator, monkeypatch):
    ranking = ranked(regulator, "slips", (0.3, LEFT / BAND))
    seen = anew(regulator, ranking)
    monkeypatch.setattr(explain, "rank", lambda problem, vector, candidates: ranking)
    monkeypatch.setattr(explain, "select", lambda rankings, asked: None)
    asked = AcceptanceCriteria(12.0, None, None)
    problem, candidates = regulator
    rankings, _ = explain._grown([], problem, problem.nominal(), candidates, [], asked)
    assert band(rankings[-1].best["supply_saturation"]) == band(seen.best["supply_saturation"])
