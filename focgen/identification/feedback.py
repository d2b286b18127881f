"""Closed loops: what the reference alone would have moved, as the instrument that feedback's noise is not in.

In a closed loop the input answers the disturbance that is in the output, and a fit that takes the input for
independent of it is biased. The reference is independent. What a bank of first-order lags makes of it, and of its
square (the gain is scheduled), foretells part of each power of the input; with that part in the input's place the
derivatives of the model are instruments (Ljung, System Identification, 1999, §7.6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from focgen.identification.between import Course, course_of
from focgen.identification.excitation import Excitation

_LAGS = 8  # time constants of the bank, from two samples to a third of the experiment


def instruments_of(experiments: Sequence[Excitation]) -> list[Excitation | None] | None:
    """For each closed-loop experiment itself, driven by what its reference foretells; None where no loop is
    closed in any."""
    if all(x.reference is None for x in experiments):
        return None
    return [None if x.reference is None else _foretold(x) for x in experiments]


def _foretold(x: Excitation) -> Excitation:
    values = x.course.values
    bank = _bank(x.reference)
    made = bank @ np.linalg.lstsq(bank, values.T, rcond=1e-9)[0]
    none = np.zeros(len(x), bool)
    return replace(x, course=_from_rest(course_of(made.T, none)))


def _from_rest(course: Course) -> Course:
    """A course that rests at its first value, for an instrument's first value is no jump."""
    return course_of(course.values - course.values[:, :1], np.zeros(course.values.shape[1], bool))


def _bank(reference: np.ndarray) -> np.ndarray:
    """Lags of the reference and of its square, beside both and 1; (n, columns)."""
    centred = reference - reference[0]
    columns = [np.ones(len(centred))]
    for signal in (centred, centred * np.abs(reference)):
        columns.append(signal)
        for tau in np.geomspace(2.0, len(signal) / 3.0, _LAGS):
            pole = np.exp(-1.0 / tau)
            columns.append(lfilter([1.0 - pole], [1.0, -pole], signal))
    return np.column_stack(columns)
