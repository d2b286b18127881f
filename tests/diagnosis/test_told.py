"""Who tells how a log begins: what was found, or a rival of it.

Red when a rival that leaves but a little less has the session begin as suits it.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis import findings as module


@pytest.mark.parametrize("teller", ["begins", "what carries on"])
@pytest.mark.parametrize(
    "left, asked", [(0.5, True), (0.69, True), (0.75, False), (0.94, False), (1.2, False)]
)
def test_a_rival_tells_how_logs_begin_only_where_it_leaves_far_less(left, asked, teller, monkeypatch):
    """By its begins, or by what carries on in it."""
    found, rival = (SimpleNamespace(weighed=np.full(4, np.sqrt(v))) for v in (1.0, left))
    explanation = SimpleNamespace(best=found)
    session = (SimpleNamespace(begins={"command": SimpleNamespace(known=False)}),)
    again = []
    search = SimpleNamespace(only=None, nominal=None, better=lambda e, logs: again.append(logs))
    monkeypatch.setattr(module, "_others", lambda *_: [rival])
    told = [rival if name == teller else found for name in ("begins", "what carries on")]
    monkeypatch.setattr(
        module, "_told_by", lambda nominal, e, number, of, logs: iter(told if of is rival else [found])
    )
    monkeypatch.setattr(module, "begun_as", lambda e, of, logs: logs if of is rival else of)
    assert module._told_by_another(search, (explanation,), session) == ((explanation,), session)
    assert again == [rival] * asked
