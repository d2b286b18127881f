"""A lag whose own equation effects change: a chamber that fills and vents, each in its way."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.present import present
from focgen.rig import kernels, lags, linear
from focgen.rig.delay import delayed
from focgen.rig.dynamics import Dynamics
from focgen.rig.rig import UNITY


def asked(transfer: TransferFunction, x: Array, supply: float) -> Array:
    """What a regulator is asked for, (n,), of which its ``supply``, in units of its output, can give no more
    than that."""
    most, way = supply / abs(transfer.dc_gain), np.copysign(1.0, transfer.dc_gain)
    made: Array = way * np.minimum(way * x, most)
    return made


def run(
    transfer: TransferFunction,
    x: Array,
    rest: Bytes,
    h: float,
    own: Dynamics,
    between: Between | bool,
    delay: float = 0.0,
) -> Array:
    """The response (n,) of gain/(T s + 1) with another pace while it rises and while it falls, a highest rate
    and a throat each way, and a ceiling; of several lags, the slowest is meant, and the others are ahead of
    it. The delay is exact in whole samples only."""
    ahead, slowest = lags.parted(transfer)
    if ahead != UNITY:
        x, between = linear.run(ahead, x, rest, h, len(x) * h, between), Between.STRAIGHT
    gain, T, _ = present(linear.single_lag(slowest))
    size, way = abs(gain), np.copysign(1.0, gain)
    T /= own.throat.pace
    times, rates = (T / own.loading, T / own.unloading), (own.flow.fill / size, own.flow.vent / size)
    throats, held = (own.throat.fill / size, own.throat.vent / size), between == Between.HELD
    made = size * kernels.chamber(way * x, rest, h, times, rates, throats, own.ceiling / size, held)
    return delayed(made, rest, h, delay) if delay else made
