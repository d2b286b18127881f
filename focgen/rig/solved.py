"""Transfer functions run over samples with what depends on their own response: that is solved for at every
sample."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import kernels
from focgen.rig.courses import sharpened
from focgen.rig.delay import delayed
from focgen.rig.dynamics import Dynamics, Lever
from focgen.rig.linear import discrete, row_of
from focgen.rig.modes import about_as_long, settled


def run_bent(
    transfer: TransferFunction,
    x: Array,
    rest: Bytes,
    h: float,
    between: Between | bool,
    dynamics: Dynamics,
    delay: float = 0.0,
) -> Array:
    """As :func:`~focgen.rig.linear.run` of a plant with a spring (:func:`~focgen.rig.linear.is_spring`) that
    follows ``dynamics``; the response counts as linear between samples, and the delay is exact in whole
    samples only."""
    x = _in_lines(x, rest, between)
    made = kernels.bent_rational(x, rest, *_sides(transfer, h, between), dynamics.bending(transfer.dc_gain))
    return delayed(made, rest, h, delay) if delay else made


def run_paced(
    transfer: TransferFunction,
    x: Array,
    rest: Bytes,
    h: float,
    duration: float,
    between: Between | bool,
    slowness: kernels.Slowness,
) -> Array:
    """As :func:`~focgen.rig.linear.run` of a stage that :func:`~focgen.rig.linear.holds_level`, at its
    fastest, whose pace ``slowness`` tells."""
    x = _in_lines(x, rest, between)
    if transfer.is_integer:
        return kernels.paced_rational(x, rest, *_sides(transfer, h, between), slowness)
    gain, row, missing = row_of(transfer, h, about_as_long(duration))
    by, (own, *pace), share = slowness
    made = kernels.paced_modes(x, rest, row, between == Between.HELD, (by, (own / gain, *pace), share))
    return gain * settled(made, x, rest, missing)


def run_levered(
    transfer: TransferFunction,
    x: Array,
    rest: Bytes,
    h: float,
    duration: float,
    between: Between | bool,
    lever: Lever,
) -> Array:
    """As :func:`~focgen.rig.linear.run` of a stage that :func:`~focgen.rig.linear.holds_level`, whose input
    pulls as strongly as ``lever`` says."""
    x = _in_lines(x, rest, between)
    if transfer.is_integer:
        own = lever.first, lever.second, lever.scale
        return kernels.levered_rational(x, rest, *discrete(transfer, h, between == Between.HELD), own)
    gain, row, missing = row_of(transfer, h, about_as_long(duration))
    own = lever.first, lever.second, lever.scale / gain
    made = gain * kernels.levered_modes(x, rest, row, between == Between.HELD, own)
    return settled(made, x * lever.strength(made), rest, gain * missing)


def run_weak(
    transfer: TransferFunction,
    x: Array,
    rest: Bytes,
    h: float,
    duration: float,
    between: Between | bool,
    wear: kernels.Wear,
) -> Array:
    """As :func:`~focgen.rig.linear.run` of a stage that :func:`~focgen.rig.linear.holds_level`, whose spring
    gives way as ``wear`` says, in the response's unit."""
    x = _in_lines(x, rest, between)
    if transfer.is_integer:
        return kernels.weak_rational(x, rest, *_sides(transfer, h, between), wear)
    gain, row, missing = row_of(transfer, h, about_as_long(duration))
    by, (growth, scale, before, own), given = wear
    per = abs(gain)
    wear = by, (growth, scale / per, before / per, own / gain), given
    made = kernels.weak_modes(x, rest, row, between == Between.HELD, wear)
    entered = made / (own / gain - missing)  # of what rests
    return gain * settled(made, entered, rest, missing)


def _in_lines(x: Array, rest: Bytes, between: Between | bool) -> Array:
    """The input (n,) for loops that take it in straight lines: a smooth one with its bends sharpened."""
    return sharpened(np.ascontiguousarray(x, float), rest) if between == Between.SMOOTH else x


def _sides(transfer: TransferFunction, h: float, between: Between | bool) -> tuple[Array, Array, Array]:
    """The numerators for the input and for what of the response comes back, which runs in lines, and the
    denominator."""
    b, a = discrete(transfer, h, between == Between.HELD)
    c, _ = discrete(transfer, h, False)
    return b, c, a
