"""Every effect of the vocabulary, and some that it has no name for, with their forms."""

from __future__ import annotations

import numpy as np

from focgen.trials import forms_actuator, forms_regulator, forms_sensor
from focgen.trials.forms import Drawn, Form, Spans
from focgen.trials.forms_outside import OUTSIDE
from focgen.trials.forms_plants import FRICTION

_STAGES = {"regulator": forms_regulator, "actuator": forms_actuator, "sensor": forms_sensor}

# effect -> its stage and its forms
VOCABULARY: dict[str, tuple[str, tuple[Form, ...]]] = {
    effect: (stage, forms) for stage, module in _STAGES.items() for effect, forms in module.FORMS.items()
}


# what only some suites have
FURTHER: dict[str, tuple[str, tuple[Form, ...]]] = {"friction": ("actuator", FRICTION)}


def stage_of(effect: str) -> str | None:
    """The stage of an effect that has a name; None of any other."""
    known = VOCABULARY.get(effect) or FURTHER.get(effect)
    return known[0] if known else None


def forms_of(effect: str) -> tuple[Form, ...]:
    """The forms of an effect, of whatever suite."""
    return (VOCABULARY.get(effect) or FURTHER.get(effect) or OUTSIDE[effect])[1]


def draw_form(effect: str, rng: np.random.Generator, spans: Spans, name: str | None = None) -> Drawn:
    """One of the effect's forms, ``name`` or at random, all but its amplitude fixed."""
    stage, forms = VOCABULARY.get(effect) or FURTHER.get(effect) or OUTSIDE[effect]
    if name:
        forms = tuple(form for form in forms if form.name == name)
    form = forms[rng.integers(len(forms))]
    amplitude = form.draw(rng, spans)
    return Drawn(effect, stage, form, amplitude, form.memory(rng) if form.memory else None)
