"""Two effects at once, where each alone leaves most of the other.

Red when the first effect is what fits best alone, whatever stands beside it, or when two are named that leave
what inputs predict.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis.belief.further import Surroundings
from focgen.diagnosis.fitting.fit import Weighing
from focgen.diagnosis.hypotheses import two
from focgen.diagnosis.verdict.two_instead import two_instead
from tests.diagnosis.test_belief import _COUNT, _fit

ASKED = SimpleNamespace(surroundings=Surroundings())


def ranking(base, *best, fallen=()):
    """What ``base`` was ranked with; families by their last effect, and those that are ``fallen`` behind."""
    named = {f.problem.candidates[-1].effect: f for f in best}
    firsts = [*best, *fallen]

    def but(without=lambda c: False):
        return [f for f in firsts if not without(f.problem.candidates[-1])]

    return SimpleNamespace(base=base, best=named, winner=next(iter(named), None), ar=np.ones(1), firsts=but)


def left(square, *effects, told):
    made = _fit(square, effects, told, weighed=np.full(_COUNT, np.sqrt(square)), vector=None)
    vars(made.problem).update(untried=lambda candidates: candidates)
    return made


def asked(monkeypatch, both, found, behind=False):
    """What comes of a gap of 100, of which a bend leaves most, and two others alone leave more; so much that
    they fell ``behind``, maybe."""
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
    first = ranking(gap, bend, fallen=(creep, friction)) if behind else ranking(gap, bend, creep, friction)
    return two.two_at_once([first, ranking(found or bend)], (), ASKED)


@pytest.mark.parametrize("behind", [False, True])
def test_two_are_found_where_each_alone_leaves_most(behind, monkeypatch):
    both = left(1.02, "creep", "friction", told=0.02)
    (first, second), found = asked(monkeypatch, both, None, behind)
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


def others(monkeypatch, share, *pairs):
    """What two effects each may be instead of a bend that leaves ``share`` of what it changes to inputs, by
    what the ``pairs`` leave of a gap of 100."""
    gap, bend = left(100.0, told=0.98), left(1.0 + 99.0 * share, "bend", told=0.0)
    bend.predictable_share = 99.0 * share / (1.0 + 99.0 * share)
    whole = [left(square, *names.split(), told=0.3) for square, names in pairs]
    known = {id(f.problem): f for f in (gap, bend, *whole)}
    monkeypatch.setattr(two, "_pairs", lambda name, first, candidates: whole)
    monkeypatch.setattr(two, "fit", lambda problem, vector, weighing, iterations: known[id(problem)])
    return two.two_others(bend, ranking(gap, bend), (), Weighing(np.ones(1)), ASKED)


def test_two_others_may_be_there_instead_of_one_that_leaves_more_than_right_forms(monkeypatch):
    """A supply's end and a drift were `softening`, 0.95: no pair was asked where one explains nine tenths."""
    near, best, far = (1.9, "creep rail"), (1.2, "drift rail"), (30.0, "drift leak")
    found = others(monkeypatch, 0.07, near, best, far, (1.5, "drift rail"))
    assert [sorted(p.families) for p in found] == [["drift", "rail"], ["creep", "rail"]]
    assert all(p.instead == "bend" for p in found)
    assert found[0].odds > found[1].odds > -4.0
    assert others(monkeypatch, 0.03, best) == ()
    beside = others(monkeypatch, 0.07, near, best, (1.1, "bend drift"))  # it may have another beside it, too
    assert [p.families for p in beside] == [p.families for p in found]
    assert beside[0].odds < found[0].odds - 0.7


def test_what_was_found_is_asked_in_other_forms_beside_others(monkeypatch):
    """A loop stood alone at 0.01, two others being far likelier: it had not been asked beside an obstacle."""
    families = ("bend", "creep", "friction", "leak")
    gap, bend, creep, friction, leak = left(9.0, told=0.9), *(left(5.0, name, told=0.5) for name in families)
    for of in (bend, creep, friction, leak):
        vars(of.problem).update(segment=SimpleNamespace(y=np.zeros(10)), coarsest=1)
        vars(of.problem).update(thinned=lambda factor, p=of.problem: p, stretched=lambda vector, times: None)
    every = [SimpleNamespace(effect=name, form=SimpleNamespace(slot="load")) for name in families]

    def rank(problem, vector, candidates):
        of = problem.families[0]
        return ranking(None, *(left(1.0, of, c.effect, told=0.0) for c in reversed(candidates)))

    monkeypatch.setattr(two, "rank", rank)
    monkeypatch.setattr(two, "on_all", lambda both, problem, factor: both)
    monkeypatch.setattr(two, "_in_the_plant", lambda candidate: False)
    pairs = list(two._pairs(bend, ranking(gap, bend, creep, friction, leak), every))
    asked_of = {
        one: [f.problem.families[1] for f in pairs if f.problem.families[0] == one] for one in families
    }
    assert asked_of["bend"] == ["leak", "friction"]  # the two likeliest beside it
    assert all("bend" in beside and len(beside) == 3 for one, beside in asked_of.items() if one != "bend")


def test_what_two_others_may_be_is_taken_from_a_confidence_and_said():
    pairs = [two.TwoOthers("softening", frozenset({"drift", "rail"}), np.log(0.5))]
    pairs.append(two.TwoOthers("softening", frozenset({"creep", "rail"}), np.log(0.25)))
    one, another = (SimpleNamespace(rivals=[SimpleNamespace(effect=n)]) for n in ("softening", "leak"))
    e = SimpleNamespace(others=tuple(pairs), causes=(one,))
    doubt = two_instead(e)
    assert doubt.sure == pytest.approx(0.75 / 1.75) and doubt.instead == {"softening"}
    assert doubt.said == "instead of softening it may be (43%) two effects: drift and rail, or creep and rail"
    for others, causes in ((), (one,)), (tuple(pairs), (one, another)), (tuple(pairs), (another,)):
        assert two_instead(SimpleNamespace(others=others, causes=causes)) is None
