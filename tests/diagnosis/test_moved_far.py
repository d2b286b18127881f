"""A candidate whose fit takes the rig's own numbers far is weighed as what it is with them kept.

Red when one is left out for the numbers that a free fit moves. Beside a valve that vents quickly a dead time
of the same regulator took the time of that 19 uncertainties away, and was never asked again with it kept.
"""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from focgen.diagnosis.belief.choice import likeliest
from focgen.rig.effects import form_of


def found(effect: str, form: str, explains: float, penalty: float, kept: float) -> SimpleNamespace:
    """A fit that ``explains`` nats with numbers ``penalty`` nats off, and has the odds ``kept`` without."""
    candidate = SimpleNamespace(effect=effect, form=form_of(effect, form), stage="regulator")
    problem = SimpleNamespace(candidates=(candidate,))
    return SimpleNamespace(problem=problem, explains=explains, prior_penalty=penalty, kept=kept, sse=1.0)


GROUND = SimpleNamespace(
    roughly=lambda fit: fit.explains - fit.prior_penalty,
    odds=lambda fit: fit.kept,
    closer=lambda fit: 0.0,
    base=SimpleNamespace(problem=SimpleNamespace(candidates=())),
)


@pytest.mark.parametrize("penalty", [0.0, 60.0, 182.0])
def test_numbers_that_a_fit_has_moved_far_leave_out_none(penalty):
    late = found("transport_delay", "delay", 30.0, penalty, kept=20.0)
    slow = found("slow_regulator", "one_lag", 12.0, 1.0, kept=4.0)
    assert likeliest(GROUND, [slow, late])[0] is late


def test_what_explains_far_less_is_not_asked():
    """It takes a fit each."""
    asked = []
    ground = SimpleNamespace(**vars(GROUND) | {"odds": lambda fit: asked.append(fit) or fit.kept})
    late = found("transport_delay", "delay", 90.0, 0.0, kept=20.0)
    slow = found("slow_regulator", "one_lag", 12.0, 1.0, kept=4.0)
    likeliest(ground, [slow, late])
    assert asked == [late]
