"""Readings far off in the first and the last rows of a part, where only one side has neighbours enough."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array, Bools
from focgen.logs.answers import WIDEST

SIDE = 3  # readings on either side that have to agree
FAR = 5.2  # robust standard deviations of a reading from the line through its neighbours
CLEAR = 2.75  # times the worst departure of the neighbours from that line
ROWS = 3 * SIDE - 1 + WIDEST  # readings at an end that are looked at
_MOVES = 3.0  # times what noise could do: a signal that does no more may have been released as its log begins
_AT_REST = 2.0  # times what noise could do, where the signal does no more than to rest
_BLOCK = 128  # readings from the end, whose usual step is one of noise


def at_an_end(y: Array, least: float, reach: float, first: bool, calm: bool) -> Bools:
    """Which of the first readings of ``y`` (n,) are outliers, as a mask (``ROWS``,).

    They are one to three in a row that begin in the first, the second or the third reading, off the line
    through the six behind by more than ``reach`` and than noise, ``least`` at least. Those ahead of them lie
    on that line. One that begins in the ``first`` reading counts only if that is allowed, and where the
    signal does more than to rest. The others come and go, so a ``calm`` command is enough: it has no pulses.
    """
    found = np.zeros(ROWS, bool)
    usual = 1.4826 * float(np.median(np.abs(np.diff(y[:_BLOCK]))))
    for ahead in range(0 if first else 1, SIDE):
        for width in range(1, WIDEST + 1):
            off, rough = ahead_of_line(y, ahead + width)
            size, noise = np.abs(off), FAR * max(rough, least)
            beside, inside = size[:ahead].max(initial=0.0), size[ahead:].min()
            moves = reach > _MOVES * noise
            rests = ahead > 0 and calm and inside > _AT_REST * max(noise, FAR * usual)
            far = inside > max(noise, reach, CLEAR * beside) and (moves or rests)
            if far and abs(np.sign(off[ahead:]).sum()) == width:
                found[ahead : ahead + width] = True
    return found


def ahead_of_line(y: Array, width: int) -> tuple[Array, float]:
    """How far the first ``width`` readings of ``y`` (n,) are off the line through six behind them, and how
    far the worst of these six is."""
    places = np.arange(width + 2 * SIDE) - width - SIDE + 0.5
    behind, places_behind = y[width : width + 2 * SIDE], places[width:]
    slope = behind @ places_behind / np.sum(places_behind**2)
    off = y[: width + 2 * SIDE] - behind.mean() - slope * places
    return off[:width], float(np.abs(off[width:]).max())
