"""The frozen linear loop: K held at an operating point, continuous, unlimited; its response is exact."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.control.equilibrium import actuator_of
from focgen.control.margins import DELAYED, SMALL, Margins, curve, margins
from focgen.fractional.delay import Delayed
from focgen.fractional.responses import step_response
from focgen.fractional.simulation import Convolution, divided
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.rig.rig import Actuator, Rig

_INTEGRATOR = TransferFunction([(1.0, 0.0)], [(1.0, 1.0)])
_SAME = 1e-12  # relative difference of coefficients that cancel
_CLOSE = 1e-5  # between a delayed step response and that on a grid twice as fine
_FINEST = 64  # parts of a sample


def frozen_loop(rig: Rig, controller: Controller, pressure: float) -> Delayed:
    """Return the open loop C(s) R(s) G(s) H(s) with K = K(p) and the controller's gain at ``pressure``,
    behind the rig's delays.

    Factors that cancel exactly, as the inverse and the model do, are gone.
    """
    actuator = actuator_of(rig)
    still = float(actuator.K(pressure)) if isinstance(actuator, Actuator) else 1.0
    gain = float(controller.gain_at(pressure)) * still
    parts = [controller.transfer, rig.regulator, actuator.dynamics, rig.sensor]
    return Delayed(_series(parts + [_INTEGRATOR] * controller.integrator) * gain, rig.delays.total)


def frozen_step(loop: Delayed, t: ArrayLike) -> Array:
    """Return the closed loop's unit step response at the times ``t`` (s), shape of ``t``: exact without a
    delay, else to about 1e-5.
    """
    if loop.delay:
        return _delayed_step(loop, np.asarray(t, dtype=float))
    open_loop = loop.transfer
    closed = TransferFunction(open_loop.num, open_loop.den + open_loop.num)
    return step_response(closed, t)


def _delayed_step(loop: Delayed, t: Array) -> Array:
    """The error as straight between ever more samples, until that no longer shows."""
    last, count, parts = float(t.max()), max(2, t.size - 1), 1
    found = _sampled_step(loop, t, last, count)
    while parts < _FINEST:
        parts *= 2
        before, found = found, _sampled_step(loop, t, last, count * parts)
        if np.abs(found - before).max() <= _CLOSE * np.abs(found).max():
            break
    return found


def _sampled_step(loop: Delayed, t: Array, last: float, count: int) -> Array:
    """y = L e with e = 1 − y straight between ``count`` + 1 samples up to ``last`` s, solved for y."""
    open_loop = Convolution(loop.transfer, last / count, "linear", loop.delay)
    unclosed = open_loop.run(np.ones(count + 1))
    weights = open_loop.run(np.eye(1, count + 2, 1)[0])[1:]
    weights[0] += 1.0
    return np.interp(t, np.arange(count + 1) * (last / count), divided(unclosed, weights))


def frozen_margins(loop: Delayed, sample_time: float) -> Margins:
    """Return the margins of the open loop, looked at from 1e-6 to 1e3 times the sampling frequency."""
    unit = 2.0 * math.pi / sample_time
    small = DELAYED if loop.delay else SMALL
    return margins(curve(loop.frequency_response, 1e-6 * unit, 1e3 * unit, small))


def _series(parts: list[TransferFunction]) -> TransferFunction:
    nums, dens = [part.num for part in parts], [part.den for part in parts]
    factor = 1.0
    for num in list(nums):
        match = next((den for den in dens if len(num) > 1 and _ratio(num, den)), None)
        if match is not None:
            factor *= _ratio(num, match)
            nums.remove(num)
            dens.remove(match)
    total = TransferFunction([(factor, 0.0)])
    for num in nums:
        total = total * TransferFunction(num)
    for den in dens:
        total = total * TransferFunction([(1.0, 0.0)], den)
    return total


def _ratio(num: Polynomial, den: Polynomial) -> float:
    """num/den where it is a constant, else 0."""
    if [t.order for t in num] != [t.order for t in den]:
        return 0.0
    ratios = [a.coefficient / b.coefficient for a, b in zip(num, den)]
    return ratios[0] if all(math.isclose(r, ratios[0], rel_tol=_SAME) for r in ratios) else 0.0
