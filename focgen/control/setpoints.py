"""Default set points: tenths 1 … 7 of the output's range, as Fig. 10 has them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from focgen.errors import DesignError

_TENTHS = tuple(range(1, 8))


def check_setpoints(given: Sequence[float]) -> None:
    """Raise DesignError where there are none, or one is no finite number."""
    remedy = "give outputs in the rig's unit"
    if not given:
        raise DesignError("--setpoints", "are none", remedy)
    if not all(map(math.isfinite, given)):
        raise DesignError("--setpoints", "are not finite numbers", remedy)


def default_setpoints(rest: float, span: tuple[float, float]) -> tuple[float, ...]:
    """Return seven outputs from ``rest`` towards the far end of the range ``span``, nearest first.

    With 0 and (0, 0.02) they are 0.002 … 0.014, the paper's.
    """
    far = max(span, key=lambda end: abs(end - rest))
    return tuple(float(f"{rest + tenth * (far - rest) / 10.0:.12g}") for tenth in _TENTHS)
