"""Which regulator tells how a measured pressure runs between two readings.

One that is through with its way before the next reading leaves little of it in the readings: a dead time and
a lag, or either alone, may have made the same. The actuator behind it is later by the one or the other, so
that its numbers are known no better than these rivals leave them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.errors import FitError
from focgen.fractional.simulation import Convolution
from focgen.identification.excitation import hold_of, is_held
from focgen.identification.ready import running
from focgen.identification.shapes import ShapeFit
from focgen.identification.stages import StageFit, identify_stage, transfer_of
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig
from focgen.rig.within import as_sent, kinks, scaled_to

_AS_WELL = 1.1  # times the strays: a file's regulator that leaves no more is taken
# of Schwarz's criterion: shapes that are no further behind are rivals, if they are lags and dead times: what
# rings or leads within a sample is anything
_TIED, _ANYTHING = 10.0, {"wn", "zero"}
_APART = 0.02  # samples: rivals that are no later or sooner are none


def fed(experiments: Sequence[Experiment], rig: Rig, found: StageFit | None) -> tuple[Rig, Rig | None]:
    """The rig with the regulator that tells how the pressure of the ``experiments`` runs, and with a rival
    that is as likely and the farthest from it in time, None where there is none. ``found``: the one that was
    fitted to these logs and is the rig's; else the rig's file has it, which is asked whether it suits them.
    """
    step = experiments[0].sample_time
    logged = all("pressure" in e and "command" in e for e in experiments)
    if not logged or not kinks(rig, ("regulator",), step):
        return rig, None
    try:
        fit = found or identify_stage(experiments, "regulator", rig.between)
    except FitError:
        return replace(rig, between=Between.STRAIGHT), None  # between two readings nothing is known
    here = _with(running(rig, fit.between), fit)
    least = min(shape.bic for shape in fit.fits) + _TIED
    plain = [shape for shape in fit.fits if not _ANYTHING & set(shape.parameters)]
    others = [here, *(_with(here, shape) for shape in plain if shape.bic <= least)]
    of_file = rig if found else _suiting(rig, here, experiments)
    told = of_file or here
    if not is_held(told):
        return told, None
    rival = max(others, key=lambda other: abs(_late(other, step) - _late(told, step)), default=told)
    return told, rival if abs(_late(rival, step) - _late(told, step)) > _APART * step else None


def _suiting(rig: Rig, here: Rig, experiments: Sequence[Experiment]) -> Rig | None:
    """The rig of the file, where the pressure strays as little from its regulator as from the one ``here``:
    as a whole, and from sample to sample."""
    strays = np.array([sum(_strays(e, of) for e in experiments) for of in (rig, here)])
    return rig if np.all(strays[0] <= _AS_WELL * strays[1]) else None


def _strays(experiment: Experiment, rig: Rig) -> Array:
    """The mean squares (2,) of what the pressure strays by off what the regulator makes, and of its changes
    from sample to sample."""
    step, late = experiment.sample_time, rig.delays.regulator - rig.lead
    command, late = as_sent(np.asarray(experiment["command"], float), step, late)
    made = Convolution(rig.regulator, step, hold_of(rig), late).run(command - command[0])
    read = np.asarray(experiment["pressure"], float)
    off = read - scaled_to(read, made[None])[0]
    return np.array([np.mean(off**2), np.mean(np.diff(off) ** 2)])


def _with(rig: Rig, of: StageFit | ShapeFit) -> Rig:
    """The rig with a regulator as fitted."""
    made = {name: value for name, (value, _) in of.parameters.items()}
    delays = replace(rig.delays, regulator=made.get("delay", 0.0))
    return replace(rig, regulator=transfer_of(of.parameters), delays=delays, lead=made.get("lead", 0.0))


def _late(rig: Rig, step: float) -> float:
    """The mean time by which a pressure is late, s: the first moment of its regulator's impulse response, and
    half of a ``step`` for which its command is held."""

    def moment(terms: Sequence[tuple[float, float]]) -> float:
        by_order = {order: c for c, order in terms}
        return by_order.get(1.0, 0.0) / by_order.get(0.0, np.inf)

    num, den = ([(t.coefficient, t.order) for t in part] for part in (rig.regulator.num, rig.regulator.den))
    held = 0.5 * step * is_held(rig)
    return moment(den) - moment(num) + rig.delays.regulator - rig.lead + held
