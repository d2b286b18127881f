"""The curvature that drives a sensor, between its readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.identification.excitation import is_held, varying_reference
from focgen.identification.smoothed import without_noise
from focgen.logs.between import Between, jumps_of
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.rig import Rig
from focgen.rig.within import kinks, laid_on_samples, made_within, read_within, scaled_to

_AHEAD = ("regulator", "actuator")  # of the sensor


def turns_within(rig: Rig, step: float) -> bool:
    """Whether a held command makes a rig's curvature turn within samples of ``step`` s."""
    return rig.actuator is not None and is_held(rig) and kinks(rig, _AHEAD, step)


def driving(experiment: Experiment, rig: Rig | None) -> Array:
    """The curvature (n,) of an experiment without its noise, for what takes it to be straight between
    samples: with what lines miss of what the ``rig`` ahead of the sensor makes of a held command, where that
    is known and the readings follow it."""
    read = np.asarray(experiment["curvature"], float)
    plain = without_noise(read, jumps_of(read))
    if rig is None or "command" not in experiment or not turns_within(rig, experiment.sample_time):
        return plain
    if varying_reference(experiment) is not None:  # noise that a loop passes on moves the rig
        return plain
    command, step = np.asarray(experiment["command"], float), experiment.sample_time
    run = Run.of([len(command)], [0.0], step)
    run.rest[0] = BALANCED  # logs begin at rest with their first command

    def made(late: float, way: Between = Between.HELD) -> Array:
        chain = Chain(replace(rig, lead=rig.lead - late, known=()))
        return chain.run(command, *_AHEAD, run, way)

    first, model = np.arange(len(command)) == 0, scaled_to(read, made_within(made, step))
    straight = scaled_to(read, made(0.0, Between.STRAIGHT)[None])[0]
    if np.var(read - straight) < np.var(read - model[-1]):  # which is then not held
        return plain
    curve = without_noise(read, jumps_of(read), model[-1])
    values = read_within(curve, model, first)
    return plain if values is None else curve + laid_on_samples(values, first)
