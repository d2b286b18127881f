"""What the owner of a rig in the engine believes of it: a line through its healthy motion, data sheets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.rig.corners import EXACT, moved
from focgen.rig.rig import Actuator, LinearActuator, Relative, Rig

_TIMES, _GAINS = (0.03, 0.10), 0.01  # by what data sheets of regulator and sensor are off


def fitted(
    pressures: Sequence[Array], curvatures: Sequence[Array], h: float, order: int, time: float
) -> Actuator | LinearActuator:
    """The lag of ``order`` 1 or 2 that comes closest to the healthy body's motion, sampled every ``h`` s;
    ``time`` in s to begin with. One of order 1 is written as T and alpha = 1."""

    def missed(v: Array) -> Array:
        num, den = _coefficients(v)
        b, a, _ = cont2discrete((num, den), h, "foh")
        made = [lfilter(b.ravel(), a, p) for p in pressures]
        return np.concatenate([m - c for m, c in zip(made, curvatures)]) / size

    size = max(float(np.max(np.abs(c))) for c in curvatures)
    gain = size / max(float(np.max(np.abs(p))) for p in pressures)
    start = [np.log(gain), np.log(time), *([np.log(0.1 * time)] if order == 2 else [])]
    num, den = _coefficients(least_squares(missed, start).x)
    if order == 1:
        return Actuator(den[0], 1.0, (num[0],))
    terms = [(float(c), float(2 - i)) for i, c in enumerate(den)]
    return LinearActuator(TransferFunction([(num[0], 0.0)], terms))


def _coefficients(v: Array) -> tuple[list[float], list[float]]:
    """K/(T s + 1), or K/((T s + 1)(U s + 1)), from the logarithms of K, T and U."""
    gain, *times = (float(x) for x in np.exp(v))
    den = np.polymul([times[0], 1.0], [times[1], 1.0]) if len(times) == 2 else [times[0], 1.0]
    return [gain], [float(c) for c in den]


def believed(rig: Rig, rng: np.random.Generator) -> Rig:
    """The rig with regulator and sensor as in their data sheets: times 3 to 10 % off, gains up to 1 %."""

    def off() -> Relative:
        time = rng.uniform(*_TIMES) * rng.choice((-1.0, 1.0))
        return Relative(float(rng.uniform(-_GAINS, _GAINS)), float(time))

    return moved(rig, replace(EXACT, regulator=off(), sensor=off()))
