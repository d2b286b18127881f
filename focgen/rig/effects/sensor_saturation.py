"""A reading that stops at a limit."""

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects._curves import softly_beyond
from focgen.rig.effects._effect import Effect, Form, Parameter, Run, Values
from focgen.rig.effects._sizes import own

_LIMIT = Parameter("limit", level=1, lower=0.1, upper=1.3, starts=(0.9, 0.6), zero=1.3)
_WIDTH = Parameter("width", level=1, lower=1e-3, upper=0.3, starts=(0.02, 0.05), log=True)


def _hard(x: Array, values: Values, run: Run) -> Array:
    return np.minimum(x, values[0])


def _both_ways(x: Array, values: Values, run: Run) -> Array:
    return np.clip(x, -values[0], values[0])


def _soft(x: Array, values: Values, run: Run) -> Array:
    return x - softly_beyond(x, *values)


def _soft_both_ways(x: Array, values: Values, run: Run) -> Array:
    return x - np.sign(x) * softly_beyond(np.abs(x), *values)


EFFECT = Effect(
    name="sensor_saturation",
    stage="sensor",
    meaning="the reading stops at a limit",
    reveals="levels on both sides of the limit with the curvature logged: a flat top",
    confused_with=("contact", "sensor_nonlinearity", "supply_saturation"),
    needs=lambda e: None if e.levels >= 3 else "needs three or more levels",
    static=True,
    sizes=(own("limit"),),
    forms=[
        Form("hard", "reading", (_LIMIT,), _hard),
        # a converter ends on both sides of its zero
        Form("both_ways", "reading", (_LIMIT,), _both_ways, both_ways=True),
        Form("soft", "reading", (_LIMIT, _WIDTH), _soft),
        Form("soft_both_ways", "reading", (_LIMIT, _WIDTH), _soft_both_ways, both_ways=True),
    ],
)
