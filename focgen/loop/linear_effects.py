"""What small movements meet in a rig's effects: the frequency response of those that are linear.

A form without a response is not linear (a loop, a limit, a band, an asymmetry); the margins leave it aside
and say so.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from focgen.arrays import Array, Complex
from focgen.present import present
from focgen.rig.placed import Placed
from focgen.rig.replay import placed_in
from focgen.rig.rig import Rig

Response = Callable[[Array], Complex]


def linear_part(rig: Rig) -> tuple[Response | None, tuple[str, ...], tuple[str, ...]]:
    """The product of the responses of the rig's linear effects over rad/s, None where there is none; the
    names of those in it, and of those that are not.

    Raises RigError for effects that are unknown.
    """
    placed = placed_in(rig)
    inside = [p for p in placed if p.form.response is not None]
    others = tuple(p.effect for p in placed if p.form.response is None)
    return _product(inside) if inside else None, tuple(p.effect for p in inside), others


def _product(placed: list[Placed]) -> Response:
    def response(omega: Array) -> Complex:
        s = 1j * np.asarray(omega)
        total = np.ones(s.shape, complex)
        for p in placed:
            total = total * present(p.form.response)(p.values, s)
        return total

    return response
