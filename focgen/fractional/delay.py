"""Dead times: a delay in samples, and a transfer function behind one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Complex
from focgen.fractional.transfer import TransferFunction

_WHOLE = 1e-9  # samples: nearer to a whole number than this is rounding


def split_delay(delay: float, step: float) -> tuple[int, float]:
    """``delay`` (s) as whole samples of ``step`` (s), and what is left of one: 0 or more, below 1."""
    samples = delay / step
    whole = math.floor(samples + _WHOLE)
    part = samples - whole
    return whole, part if part > _WHOLE else 0.0


@dataclass(frozen=True)
class Delayed:
    """``transfer`` · e^(−``delay`` s), the delay in s."""

    transfer: TransferFunction
    delay: float = 0.0

    def frequency_response(self, omega: ArrayLike) -> Complex:
        """Complex gain at the angular frequencies ``omega`` > 0 (rad/s), shape of ``omega``."""
        found = self.transfer.frequency_response(omega)
        made: Complex = found * np.exp(-1j * np.asarray(omega) * self.delay) if self.delay else found
        return made
