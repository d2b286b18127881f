"""What no effect is, held against a part of what was found.

Red when a pace that is uneven, or a command logged late, beside a cause that is not in question makes the
whole segment `unknown`, or when a cause that is in question stays.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.verdict import conclude, instead, summary, unsteady
from focgen.diagnosis.verdict.instead import Instead, sound_part

DOUBTS = ("changed_at_once", "logged_late", "clocks_apart", "unevenly_paced", "taken_up", "unsteady")


def explained(monkeypatch, *families):
    """A segment of which these were found; a fit without some of them has the others."""

    def fitted(names):
        candidates = [SimpleNamespace(effect=n) for n in names]
        return SimpleNamespace(problem=SimpleNamespace(candidates=candidates, families=list(names)))

    def without(best, gone, weighing):
        return fitted([c.effect for c in best.problem.candidates if c not in gone])

    monkeypatch.setattr(instead, "without", without)
    monkeypatch.setattr(instead, "is_rounded", lambda causes: False)
    causes = tuple(SimpleNamespace(rivals=[SimpleNamespace(effect=n)]) for n in families)
    return Explanation(None, None, None, fitted(families), None, causes, None, None, {})


def asked(monkeypatch, doubt, other):
    """Has one of the doubts answer ``other``; every effect may be unsteady."""
    several = (other,) if other else ()
    monkeypatch.setattr(summary, doubt, lambda e: several if doubt == "unsteady" else other)


CREEPS, STICKS, ALL = (frozenset(names) for names in ({"creep"}, {"dead_zone"}, {"creep", "dead_zone"}))


@pytest.mark.parametrize(
    "others, kept",
    [
        ([Instead(CREEPS, 3.0)], ["dead_zone"]),
        ([Instead(CREEPS, -3.0), None], None),
        ([Instead(ALL, 3.0)], None),  # all is in question: there is no sound part
        ([Instead(CREEPS, 3.0), Instead(STICKS, 3.0)], None),
        ([Instead(CREEPS, 3.0), None, Instead(STICKS, -3.0)], ["dead_zone"]),
    ],
)
def test_the_sound_part_is_what_is_not_in_question(monkeypatch, others, kept):
    e = explained(monkeypatch, "creep", "dead_zone")
    part = sound_part(e, others)
    assert (part is None) == (kept is None)
    if part is not None:
        assert [c.rivals[0].effect for c in part.causes] == part.best.problem.families == kept
        assert part.whole is e and not list(instead.bases(part))  # what is sound is asked no more


@dataclass(frozen=True, eq=False)
class Fills(Instead):
    fills = True


@pytest.mark.parametrize("kind, again", [(Fills, True), (Instead, False)])
def test_what_stays_is_fitted_again_only_without_what_filled_its_gaps(monkeypatch, kind, again):
    e = explained(monkeypatch, "creep", "dead_zone")
    clocks = SimpleNamespace(references=SimpleNamespace(clocks={"response": 1.0}))
    e = replace(e, predictability="before", nominal=SimpleNamespace(problem=clocks))

    def fitted(how):
        return lambda best, gone, weighing: SimpleNamespace(gone=[c.effect for c in gone], weighed=how)

    monkeypatch.setattr(instead, "left_out", fitted("again"))
    monkeypatch.setattr(instead, "without", fitted("as it was"))
    monkeypatch.setattr(instead, "predictability", lambda segment, left, response: f"of {left}")
    part = sound_part(e, [kind(CREEPS, 3.0)])
    assert part.best.gone == ["creep"] and part.best.weighed == ("again" if again else "as it was")
    assert part.predictability == ("of again" if again else "before")
    assert sound_part(e, [Fills(CREEPS, 3.0), Instead(CREEPS, 3.0)]).best.weighed == "as it was"


@pytest.mark.parametrize("doubt", DOUBTS)
@pytest.mark.parametrize("unknown", [False, True])
def test_whatever_is_there_instead_the_sound_part_stands_where_it_explains(monkeypatch, doubt, unknown):
    e = explained(monkeypatch, "creep", "dead_zone")
    for name in DOUBTS:
        asked(monkeypatch, name, Instead(CREEPS, 3.0) if name == doubt else None)
    monkeypatch.setattr(summary, "is_unknown", lambda e: unknown)
    sound = [c.rivals[0].effect for part in summary.sound_parts([e]).values() for c in part.causes]
    assert sound == ([] if unknown else ["dead_zone"])


@pytest.mark.parametrize(
    "other, unsure",
    [(Fills(CREEPS, 3.0), True), (Fills(CREEPS, -3.0), False), (Instead(CREEPS, 3.0), False), (None, False)],
    ids=["no form", "unlikely", "at one moment", "nothing"],
)
def test_beside_what_nobody_has_a_form_of_no_name_is_sure(monkeypatch, other, unsure):
    """A clamp that slips for good was `softening` at 0.93, and instead of the drift beside it was something
    else (0.63). What changes at one moment has a form, and leaves the rest as it is."""
    e = explained(monkeypatch, "creep", "dead_zone")
    part = replace(explained(monkeypatch, "dead_zone"), whole=e)
    monkeypatch.setattr(conclude, "acts_besides", lambda e: False)
    monkeypatch.setattr(conclude, "doubts", lambda of: (None, other) if of is e else ())
    fills = (other,) if other and other.fills else ()
    monkeypatch.setattr(unsteady, "unsteady", lambda of: fills if of is e else ())
    assert conclude.something_unknown_acts(part) == unsure
    assert not conclude.something_unknown_acts(e)


def test_of_one_cause_there_is_no_part(monkeypatch):
    e = explained(monkeypatch, "creep")
    for name in DOUBTS:
        asked(monkeypatch, name, Instead(CREEPS, 3.0))
    assert summary.sound_parts([e]) == {}


@pytest.mark.parametrize("whole", [True, False])
def test_a_part_that_brings_nothing_closer_leaves_its_segment_unknown(monkeypatch, whole):
    """What explained the rest was no effect: the rig's own numbers were said to be all that is off."""
    e = explained(monkeypatch, "creep")
    of = explained(monkeypatch, "creep", "dead_zone") if whole else None
    e = replace(e, whole=of, segment=SimpleNamespace(pace=0.0))
    nothing = SimpleNamespace(in_vain=False, more_is_left=False, causes=[])
    for name, answer in {
        "crossed": [],
        "is_unknown": False,
        "_no_closer": [e],
        "_unaccounted": False,
        "_summary": nothing,
    }.items():
        monkeypatch.setattr(summary, name, lambda *a, answer=answer: answer)
    found = summary.sorted_out(None, [], None, [e], granted=False)
    assert found.unknown == ([e] if whole else [])


@pytest.mark.parametrize(
    "apart, pace, others, unknown",
    [
        (True, 0.0, False, True),
        (True, 0.0, True, True),  # another segment's effect is named, and this much is left beside it
        (False, 1.0, False, True),
        (False, 1.0, True, False),  # what adds up is what the other one left
    ],
)
def test_what_leaves_far_more_than_noise_is_said_to_be_unknown(monkeypatch, apart, pace, others, unknown):
    e = replace(explained(monkeypatch, "creep"), segment=SimpleNamespace(pace=pace))
    left = SimpleNamespace(in_vain=False, more_is_left=False, causes=[(e, None)] if others else [])
    for name, answer in {
        "crossed": [],
        "is_unknown": False,
        "_no_closer": [e] if apart else [],
        "_unaccounted": True,
        "_at_odds": [],
        "_summary": left,
    }.items():
        monkeypatch.setattr(summary, name, lambda *a, answer=answer: answer)
    found = summary.sorted_out(None, [], None, [e], granted=False)
    assert found.unknown == ([e] if unknown else [])


def test_what_one_segment_brings_no_closer_leaves_what_is_clear_in_another(monkeypatch):
    """Though more is left than was closed. And what was left out stays so, whatever is unknown beside it."""
    clear, last = (replace(explained(monkeypatch, "creep"), segment=SimpleNamespace(pace=0.0)) for _ in "ab")
    left_out = []

    def summed(*given):
        left_out.append(given[-1])
        return SimpleNamespace(in_vain=False, more_is_left=True, causes=[(clear, None)])

    for name, answer in {
        "crossed": [],
        "is_unknown": False,
        "_no_closer": [last],
        "_unaccounted": True,
        "_at_odds": [clear],
    }.items():
        monkeypatch.setattr(summary, name, lambda *a, answer=answer: answer)
    monkeypatch.setattr(summary, "_summary", summed)
    found = summary.sorted_out(None, [], None, [clear, last], granted=False)
    assert found.beside == [] and found.unknown == [last, clear]
    assert all(last in given for given in left_out)
