"""A smooth static curve of any shape, shared by the families that bend."""

import numpy as np

from focgen.rig.effects._effect import Form, Parameter

_BEYOND = 1.2  # of the largest level seen: the bend grows no further there


def _quartic(x, values, run):
    *sizes, scale = values
    place = np.minimum(np.abs(x) / scale, _BEYOND)
    return x * (1.0 + sum(size * place ** (i + 1) for i, size in enumerate(sizes)))


def quartic(slot):
    """x (1 + a q + b q² + c q³), q = |x| over the largest level."""
    sizes = (
        Parameter(n, lower=-2.0, upper=2.0, starts=(0.02,), zero=0.0) for n in ("first", "second", "third")
    )
    scale = Parameter("scale", level=1, lower=1.0, upper=1.0 + 1e-9, starts=(1.0,))
    return Form("quartic", slot, (*sizes, scale), _quartic)
