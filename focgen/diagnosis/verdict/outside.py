"""Whether a tone that came into a closed loop from outside explains a gap as well as the effects found do.

A loop answers a tone with the same tone in its input. So at one frequency whatever lies between input and
output can be made to fit: a lag, a delay, a loop of hysteresis. What parts a cause from a tone is all that is
not at that frequency: a valve that sticks makes a loop cycle as well, but with corners, and these are
explained with the rest.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, fit
from focgen.diagnosis.hypotheses.disturbance import SLOWEST, disturbance
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.numbers import NUMBERS

_BAND = 1.3  # times its frequency, either way: what belongs to a tone that comes and goes, or strays
_ASKED = 0.05  # of the power of what was asked of the rig: then the tone was asked for
_ROUNDS, _ITERATIONS = 2, 6  # of telling tone and nominal parameters apart


def from_outside(e: Explanation) -> bool:
    """Whether the gap of a segment in a closed loop is a tone that nobody asked for: the rig without effects,
    and such a tone on its output, leave less than the effects found do."""
    segment, nominal = e.segment, e.nominal
    if not segment.closed:
        return False
    h, response = segment.run.h, nominal.problem.references.clocks["response"]
    if disturbance(segment.parts(nominal.weighed), h, response).line <= NUMBERS.tonal:
        return False
    slow = max(SLOWEST, 4.0 * response / h)  # samples
    found = nominal
    for _ in range(_ROUNDS):
        found = _without_tone(found, nominal, slow)
    return float(np.mean(found.weighed**2)) < float(np.mean(e.best.weighed**2))


def _without_tone(of: Fit, nominal: Fit, slow: float) -> Fit:
    """The nominal fit, made anew to the output less what is a tone in what the fit ``of`` leaves of it."""
    problem = nominal.problem
    segment = problem.segment
    left = segment.y - problem.simulate(of.vector)
    parts = zip(segment.parts(left), segment.parts(segment.wanted))
    tone = np.concatenate([_tone(rest, wanted, slow) for rest, wanted in parts])
    rid = replace(problem, segment=replace(segment, y=segment.y - tone), memory={})
    return fit(rid, of.vector, WHITE, _ITERATIONS)


def _tone(left: np.ndarray, wanted: np.ndarray, slow: float) -> np.ndarray:
    """What of a residual (n,) is of its strongest line, those slower than ``slow`` samples apart; nothing
    where the reference has as much there."""
    power = np.convolve(_power(left), np.ones(5), "same")
    first = math.ceil(len(left) / slow)
    if first >= len(power):
        return np.zeros(len(left))
    line, place = first + int(np.argmax(power[first:])), np.arange(len(power))
    band = (place > line / _BAND - 3) & (place < line * _BAND + 3)
    asked = _power(wanted)
    if asked[band].sum() > _ASKED * asked[1:].sum():
        return np.zeros(len(left))
    return np.fft.irfft(np.fft.rfft(left) * band, len(left))


def _power(signal: np.ndarray) -> np.ndarray:
    """The power of a signal (n,) less its mean, by frequency."""
    return np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(signal)))) ** 2
