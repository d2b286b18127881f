"""What no effect is, held against a part of what was found.

Red when a pace that is uneven, or a command logged late, beside a cause that is not in question makes the
whole segment `unknown`, or when a cause that is in question stays.
"""

from types import SimpleNamespace

import pytest

from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.verdict import instead, summary
from focgen.diagnosis.verdict.instead import Instead, sound_part

DOUBTS = ("changed_at_once", "logged_late", "clocks_apart", "unevenly_paced", "taken_up")


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


@pytest.mark.parametrize("doubt", DOUBTS)
@pytest.mark.parametrize("unknown", [False, True])
def test_whatever_is_there_instead_the_sound_part_stands_where_it_explains(monkeypatch, doubt, unknown):
    e = explained(monkeypatch, "creep", "dead_zone")
    for name in DOUBTS:
        other = Instead(CREEPS, 3.0) if name == doubt else None
        monkeypatch.setattr(summary, name, lambda e, other=other: other)
    monkeypatch.setattr(summary, "is_unknown", lambda e: unknown)
    sound = [c.rivals[0].effect for part in summary.sound_parts([e]).values() for c in part.causes]
    assert sound == ([] if unknown else ["dead_zone"])


def test_of_one_cause_there_is_no_part(monkeypatch):
    e = explained(monkeypatch, "creep")
    for name in DOUBTS:
        monkeypatch.setattr(summary, name, lambda e: Instead(CREEPS, 3.0))
    assert summary.sound_parts([e]) == {}
