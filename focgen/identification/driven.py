"""What a course makes of kernels: the convolutions that a fit asks for again and again."""

from __future__ import annotations

import numpy as np
from scipy import fft

from focgen.arrays import Array
from focgen.identification.kernel import Kernels
from focgen.logs.between import Course


class Driven:
    """A course, transformed once, to be convolved with many kernels."""

    def __init__(self, course: Course) -> None:
        self.course, self.count = course, course.values.shape[1]
        self.size = fft.next_fast_len(2 * self.count, real=True)
        self._parts = {  # the kernel of each part, and how many samples ahead of it the part is made
            "steps": self._transformed(course.jumps, 1),
            "means": self._transformed(course.straight, 1),
            "bends": self._transformed(course.bends, 1),
            "twists": self._transformed(course.twists, 1),
        }

    def _transformed(self, part: Array | None, first: int) -> Array | None:
        if part is None or not np.any(part[:, first:]):
            return None
        made: Array | None = fft.rfft(part[:, first:], self.size)
        return made

    def respond(self, kernels: Kernels, rows: int, count: int) -> Array:
        """The response of each power to each of the first ``rows`` kernels; shape (rows, powers, count)."""
        n, late = self.count, kernels.late
        total = np.zeros((rows, len(self.course.values), n))
        for row in range(rows):  # one at a time: a long log's spectra are large
            total[row, :, 1:] = self._convolved(kernels, row)
        if self.course.jumps_at_first:
            total += kernels.steps[:rows, None, :n] * self.course.jumps[None, :, :1]
        if late:
            total = np.concatenate([np.zeros_like(total[:, :, :late]), total[:, :, :-late]], axis=2)
        return total[:, :, :count]

    def _convolved(self, kernels: Kernels, row: int) -> Array | float:
        """Each power's response to one row of the kernels, from the second sample on."""
        spectrum = 0.0
        for kind, part in self._parts.items():
            if part is not None:
                kernel = getattr(kernels, kind)[row, : self.count - 1]
                spectrum = spectrum + fft.rfft(kernel, self.size) * part
        return fft.irfft(spectrum, self.size)[:, : self.count - 1] if np.ndim(spectrum) else 0.0
