"""How a state is written down: the bytes of every member, and what tells one configuration from another."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

import focgen
from focgen.codegen.kernels import PORTABLE, Kernels
from focgen.codegen.state import Member, members, size_of
from focgen.plan.plan import Plan

_NAMED, _CHECKED = 8, 4  # bytes of the configuration and of the check sum


@dataclass(frozen=True)
class SavedMember:
    """A member in C: ``array`` its length where it is one; ``put`` its bits, ``get`` the value that is read,
    each of so many ``bytes``.
    """

    name: str
    array: str
    put: str
    get: str
    bytes: int


@dataclass(frozen=True)
class SavedText:
    """``members`` in their order, and the number of 64 bits that names the ``configuration``."""

    members: list[SavedMember]
    configuration: str


def saved_text(plan: Plan, sha256: str, kernels: Kernels = PORTABLE) -> SavedText:
    """How NAME_save and NAME_restore write the state; ``sha256`` is of the controller's file."""
    return SavedText([_member(m) for m in members(plan, kernels)], _configuration(plan, sha256, kernels))


def saved_bytes(plan: Plan, kernels: Kernels = PORTABLE) -> int:
    """NAME_SAVED_BYTES."""
    return _NAMED + sum(size_of(m.ctype) * m.count for m in members(plan, kernels)) + _CHECKED


def _member(member: Member) -> SavedMember:
    ctype, value = member.ctype, f"s->{member.name}" + ("[i]" if member.array else "")
    if ctype in ("float", "double"):
        kind = "f32" if ctype == "float" else "f64"
        put, get = f"foc_bits_{kind}({value})", f"foc_float_{kind}(%s)"
    else:
        put, get = f"(uint64_t){value}", f"({ctype})%s"
    size = size_of(ctype)
    return SavedMember(value, member.array, put, get % f"foc_get(from, &at, {size})", size)


def _configuration(plan: Plan, sha256: str, kernels: Kernels) -> str:
    """A number of 64 bits in C: of all that gives a state its meaning."""
    settings: list[Any] = [focgen.__version__, sha256, plan.name, plan.arithmetic, plan.memory, plan.length]
    settings += [plan.tolerance, plan.horizon, kernels.target]
    settings += [plan.operator, plan.band] if plan.band else []
    settings += ["tunable"] if plan.tuning else []
    digest = hashlib.sha256(json.dumps(settings).encode()).digest()
    return f"0x{digest[:_NAMED].hex()}"
