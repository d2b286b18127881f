"""The output's zero: what it reads where K(p) p is 0, as far as all experiments agree on one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from focgen.arrays import Array
from focgen.identification.digits import told_value
from focgen.identification.excitation import Excitation
from focgen.identification.fractional import FractionalFit
from focgen.identification.noise import ResidualModel
from focgen.logs.between import noise_level

_MOVED = 0.1  # of its step: the input has left its rest
_LITTLE = 0.02  # of the output's spread: a zero below this is no part of a rig,
_INFERRED = 0.1  # and one below this no log shows that does not rest: a past takes as much
_NEAR = 0.2  # of the input's reach: from further off than this no log shows what is at 0


def shared_zero(excitations: Sequence[Excitation], fit: FractionalFit) -> float:
    """The zero of the fitted signal, its units; 0 where it is little, where no input comes near 0, or where
    experiments with a zero of their own each do not show a common one.

    A log that rests without input reads its zero there, whatever offset the fit gives it. Any other log has
    the fit's offset, less what K(p) p holds before its first sample: no better known than K(p). One zero is
    that of all where their mean lies outside the 95 % interval about 0, by noise, by K(p), and by how the
    experiments differ.
    """
    reach = max(float(np.max(np.abs(x.pressure))) for x in excitations)
    if min(float(np.min(np.abs(x.pressure))) for x in excitations) > _NEAR * reach:
        return 0.0
    zeros, noise, drives = zip(*(_zero_of(i, x, fit) for i, x in enumerate(excitations)))
    mean, count, drive = float(np.mean(zeros)), len(zeros), np.mean(drives, axis=0)
    apart = 1.96 * float(np.linalg.norm(noise)) / count
    if count > 1:
        scatter = float(np.std(zeros, ddof=1)) / np.sqrt(count)
        apart = max(apart, float(student.ppf(0.975, count - 1)) * scatter)
    half = float(np.hypot(apart, 1.96 * np.sqrt(max(drive @ fit.gain_covariance @ drive, 0.0))))
    little = (_INFERRED if np.any(drive) else _LITTLE) * float(np.median([x.spread for x in excitations]))
    return told_value(mean, half) if abs(mean) > max(half, little) else 0.0


def resting(x: Excitation) -> int:
    """How many first samples show the output where the input still rests at 0; half of those before it moves,
    for the other half may lie ahead of a slow gauge's edge."""
    moved = np.flatnonzero(np.abs(x.pressure - x.before) > _MOVED * abs(x.level - x.before))
    shown = len(moved) > 0 and x.rest_shown and not x.begins_up
    return int(moved[0]) // 2 if shown else 0


def _zero_of(i: int, x: Excitation, fit: FractionalFit) -> tuple[float, float, Array]:
    """An experiment's zero, its standard deviation by noise alone, and by what (powers,) it changes with the
    coefficients of K(p): an offset goes through the mean of what is driven."""
    powers = np.arange(1, len(fit.gain) + 1)
    count = resting(x) if fit.pasts[i] is None else 0
    if count >= 2:
        noise = noise_level(x.measured) / np.sqrt(count)
        return float(np.mean(x.measured[:count])), noise, np.zeros(len(powers))
    zero = float(fit.offset[i]) - x.sensor_gain * float(fit.gain @ x.before**powers)
    drive: Array = x.sensor_gain * np.mean(x.pressure[:, None] ** powers, axis=0)
    return zero, x.spread * _of_a_mean(fit.residuals[i]), drive


def _of_a_mean(model: ResidualModel) -> float:
    """Standard deviation of the mean of a residual."""
    return float(np.sqrt(model.variance / model.count) / abs(np.sum(model.a)))
