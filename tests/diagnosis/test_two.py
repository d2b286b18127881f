"""Two effects at once, where each alone leaves most of the other.

Red when the first effect is what fits best alone, whatever stands beside it, or when two are named that leave
what inputs predict.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.belief.further import Surroundings
from focgen.diagnosis.hypotheses import two
from tests.diagnosis.test_belief import _COUNT, _fit

ASKED = SimpleNamespace(surroundings=Surroundings())


def ranking(base, *best):
    """What ``base`` was ranked with; families by their last effect."""
    named = {f.problem.candidates[-1].effect: f for f in best}
    return SimpleNamespace(base=base, best=named, winner=next(iter(named), None), ar=np.ones(1))


def left(square, *effects, told):
    made = _fit(square, effects, told, weighed=np.full(_COUNT, np.sqrt(square)), vector=None)
    vars(made.problem).update(untried=lambda candidates: candidates)
    return made


def asked(monkeypatch, both, found):
    """What comes of a gap of 100, of which a bend leaves most, and two others alone leave more."""
    gap = left(100.0, told=0.98)
    bend, creep, friction = (
        left(s, name, told=0.9) for s, name in ((50.0, "bend"), (60.0, "creep"), (70.0, "friction"))
    )
    beside = {"bend": (), "creep": (both,), "friction": ()}

    def rank(problem, vector, candidates):  # each as it was fitted while nothing stood for the other
        return ranking(
            None, *(left(45.0, *f.problem.families, told=0.9) for f in beside[problem.families[0]])
        )

    def looked_anew(first, second, candidates, surroundings):
        return ranking(None, *(both for _ in second.best))

    monkeypatch.setattr(two, "rank", rank)
    monkeypatch.setattr(two, "looked_anew", looked_anew)
    monkeypatch.setattr(two, "fit", lambda problem, vector, weighing, iterations: known[id(problem)])
    fits = (gap, bend, creep, friction, both, found or bend)
    known = {id(f.problem): f for f in fits}
    first = ranking(gap, bend, creep, friction)
    return two.two_at_once([first, ranking(found or bend)], (), ASKED)


def test_two_are_found_where_each_alone_leaves_most(monkeypatch):
    both = left(1.02, "creep", "friction", told=0.02)
    (first, second), found = asked(monkeypatch, both, None)
    assert found is both and second.winner == "friction" and first.winner == "bend"


@pytest.mark.parametrize(
    "both, found",
    [
        (left(30.0, "creep", "friction", told=0.9), None),  # inputs predict most of what they leave
        (left(1.02, "creep", "friction", told=0.02), left(1.01, "contact", told=0.01)),  # one does as well
    ],
    ids=["much left", "one as good"],
)
def test_two_are_not_found_where_they_leave_much_or_one_does(both, found, monkeypatch):
    assert asked(monkeypatch, both, found) is None
