"""The effects a nominal chain may lack: one file a family.

>>> sorted(library())[:3]
['contact', 'creep', 'dead_zone']
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import NoReturn

from focgen.rig.effects._effect import (
    EQUATIONS,
    SLOTS,
    STEP,
    Effect,
    Excitation,
    Form,
    Parameter,
    Run,
)
from focgen.rig.effects._sizes import Size

__all__ = [
    "EQUATIONS",
    "SLOTS",
    "STEP",
    "Effect",
    "Excitation",
    "Form",
    "Parameter",
    "Run",
    "Size",
    "form_of",
    "library",
]


@cache
def library() -> Mapping[str, Effect]:
    """Every family by its name."""
    names = sorted(m.name for m in iter_modules(__path__) if not m.name.startswith("_"))
    modules = (import_module(f"{__name__}.{name}") for name in names)
    return MappingProxyType({m.EFFECT.name: m.EFFECT for m in modules})


def form_of(effect: str, form: str) -> Form:
    """The form of a family by their names. Raises KeyError where there is none."""
    return next((f for f in library()[effect].forms if f.name == form), None) or _missing(effect, form)


def _missing(effect: str, form: str) -> NoReturn:
    raise KeyError(f"{effect} has no form {form!r}")
