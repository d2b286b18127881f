"""The rig between the controller's samples: exact responses of every linear stage, the nonlinearity K(p)p
between.

The command is held over a sample; the regulator answers exactly. Its pressure goes through K(p)p at every
substep, the result is taken as straight within a substep, and actuator and sensor answer that exactly,
however fractional they are. So the only error is that of the straight lines, O(substep²);
:func:`substeps` bounds it. Dead times pass through K(p)p unchanged, so all of them act at the end of the
chain, where they are exact: the pressure that enters K(p)p is never late, the one that is measured is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from focgen.arrays import Array
from focgen.control.equilibrium import actuator_of
from focgen.errors import RigError
from focgen.fractional.delay import split_delay
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Rig

_TOLERANCE = 1e-5  # of the largest output in a step
_TRIED = (1, 2, 4, 8, 16, 32)
_CHECKED = 256  # samples


@dataclass(frozen=True, eq=False)
class Chain:
    """Responses sampled for a loop of ``samples`` samples of ``sample_time`` s, each in ``substeps`` parts.

    ``pressure`` (samples, substeps + 1, 1): from the held command to the pressure at the substeps of the
    sample, both ends included, without the regulator's delay; where it has one, a last row more is the
    pressure with it at the sample's end. ``output`` and ``curvature`` (samples, 1, substeps + 1): from K(p)p
    there to the sensor's output and the curvature at the sample's end.
    """

    rig: Rig
    sample_time: float
    samples: int
    substeps: int
    pressure: Array
    output: Array
    curvature: Array


def chain(rig: Rig, sample_time: float, samples: int, parts: int | None = None) -> Chain:
    """Prepare ``rig`` for loops of up to ``samples`` samples; ``parts`` substeps, by default
    :func:`substeps`.

    Raises RigError where a stage cannot be simulated.
    """
    parts = parts or substeps(rig, sample_time)
    actuator, delays = actuator_of(rig), rig.delays
    return Chain(
        rig,
        sample_time,
        samples,
        parts,
        _pressure(rig.regulator, sample_time, samples, parts, delays.regulator),
        _straight(actuator.dynamics * rig.sensor, sample_time, samples, parts, delays.total),
        _straight(actuator.dynamics, sample_time, samples, parts, delays.regulator + delays.actuator),
    )


@lru_cache(maxsize=64)
def _cached_substeps(regulator: TransferFunction, rest: TransferFunction, sample_time: float) -> int:
    whole = Convolution(regulator * rest, sample_time, "zero").run(np.ones(_CHECKED + 1))[1:]
    for parts in _TRIED:
        pressure = _held(regulator, sample_time, _CHECKED, parts)[:, :, 0]
        output = _straight(rest, sample_time, _CHECKED, parts)[:, 0, :]
        pulse = sum(np.convolve(pressure[:, i], output[:, i])[:_CHECKED] for i in range(parts + 1))
        found = np.cumsum(pulse)
        if np.abs(found - whole).max() <= _TOLERANCE * np.abs(whole).max():
            break
    return parts


def substeps(rig: Rig, sample_time: float) -> int:
    """Return how many parts of a sample keep the chain's step response within 1e-5 of the exact one (at most
    32). Raises RigError where that response cannot be computed.
    """
    try:
        return _cached_substeps(rig.regulator, actuator_of(rig).dynamics * rig.sensor, sample_time)
    except ArithmeticError as reason:
        raise RigError(
            rig.name, f"cannot be simulated ({reason})", "check num and den of its stages"
        ) from None


def _held(stage: TransferFunction, sample_time: float, samples: int, parts: int) -> Array:
    """Return the kernel from a command held for a sample to the stage's output at the substeps of every
    sample.
    """
    fine = Convolution(stage, sample_time / parts, "zero").run(np.ones(samples * parts + 1))
    places = parts * np.arange(samples)[:, None] + np.arange(parts + 1)
    kernel = fine[places]
    kernel[1:] -= fine[places[1:] - parts]
    # the first sample's end is the left limit, before the next command arrives: nothing to correct
    made: Array = kernel[: _settled(kernel), :, None]
    return made


def _pressure(stage: TransferFunction, sample_time: float, samples: int, parts: int, delay: float) -> Array:
    """Return :func:`_held`, and with a ``delay`` (s) one more row: the output that much later, at the
    sample's end.
    """
    inside = _held(stage, sample_time, samples, parts)
    if not delay:
        return inside
    late = Convolution(stage, sample_time, "zero", delay).run(np.ones(samples + 1))
    whole, part = split_delay(delay, sample_time)
    if not part and whole <= samples:
        late[whole] = 0.0  # the sample's end is the left limit, before the command that arrives there
    kernel = np.zeros((samples, parts + 2, 1))
    kernel[: len(inside), :-1] = inside
    kernel[:, -1, 0] = np.diff(late)
    return kernel[: _settled(kernel)]


def _settled(kernel: Array) -> int:
    """Return how many lags say all: what follows adds up to less than rounding."""
    left = np.cumsum(np.abs(kernel).reshape(len(kernel), -1).sum(axis=1)[::-1])[::-1]
    return max(1, int(np.count_nonzero(left > 1e-15 * left[0])))


def _straight(
    stage: TransferFunction, sample_time: float, samples: int, parts: int, delay: float = 0.0
) -> Array:
    """Return the kernel from values at the substeps, joined by straight lines, to the output at the sample's
    end, ``delay`` s later.
    """
    count, step = samples * parts, sample_time / parts
    pulse = np.eye(1, count + 1)[0]
    falling = Convolution(stage, step, "linear", delay).run(pulse)
    block = Convolution(stage, step, "zero", delay).run(pulse)
    rising = block - falling
    whole, part = split_delay(delay, step)
    if not part and whole < count:  # what arrives at the sample's end is seen from its left
        rising[whole + 1] += block[whole]
        falling[whole] = 0.0
    ends = parts * np.arange(1, samples + 1)[:, None]  # distance of the sample's end from the sample's start
    places = ends - np.arange(parts + 1)
    kernel = np.where(np.arange(parts + 1) < parts, falling[places], 0.0)
    kernel[:, 1:] += rising[places[:, 1:] + 1]
    return kernel[:, None, :]
