"""A user's program, strictly typed: whatever it calls and gets has a type that a checker knows.

It is checked, and run by nobody. Each ``assert_type`` fails where a type became Any, or another.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, assert_type

import numpy as np
import numpy.typing as npt

import focgen
from focgen.errors import LogError
from focgen.fractional import TransferFunction, gl_weights
from focgen.testing import assert_equivalent, from_c


def chain(log: Path, rig: Mapping[str, Any]) -> float:
    """From data to verified C."""
    found = focgen.identify(rig, [log], from_=0.0, to=40.0, stages=("regulator", "actuator"))
    assert_type(found, focgen.Identification)
    assert_type(found.rig, focgen.Rig)
    alpha = found.joint.alpha if found.joint is not None else 1.0
    designed = focgen.design(found.rig, settling=1.5, out="controller.toml")
    assert_type(designed.controller, focgen.Controller)
    simulated = focgen.simulate(found.rig, designed.controller, setpoints=[0.01])
    assert_type(simulated.setpoints[0].settling_s, float)
    made = focgen.generate(designed.controller, "firmware", arithmetic="q31", for_="plain")
    assert_type(made.folder, Path)
    checked = focgen.verify(made.folder, target=["host", "avr"])
    assert_type(checked.holds, bool)
    costs = focgen.cost(made.folder)
    assert_type(costs.controllers[0].memory, str)
    return alpha


def frames(frame: dict[str, np.ndarray], rig: focgen.Rig) -> None:
    """Logs in memory."""
    assert_type(focgen.init(frame).text, str)
    experiments = focgen.read_logs(rig, frame)
    assert_type(experiments, tuple[focgen.Experiment, ...])
    told = focgen.diagnose(rig, experiments, out=None)
    assert_type(told.verdict, str)
    if told.augmented is not None:
        assert_type(focgen.replay(told.augmented, frame).logs["log"].gof, float)
    studied = focgen.study("memory", "controller.toml", lengths=(100, 200), memory=("short",))
    assert_type(studied.rows[0].error, float | None)
    assert_type(focgen.trial("score", "cases", partial=True), focgen.Summary)
    assert_type(focgen.report(["firmware"], "page.html"), Path)


def mathematics() -> TransferFunction:
    """The fractional side, and C of one's own."""
    model = TransferFunction([(1.0, 0.0)], [(1.32, 0.6), (1.0, 0.0)])
    assert_type(model * 2.0 + model.inverse(), TransferFunction)
    assert_type(gl_weights(0.6, 10), npt.NDArray[np.floating[Any]])
    assert_equivalent("firmware", from_c(["port.c"], prefix="port"), within="bits")
    return model


def loaded(folder: str) -> float:
    """A generated controller; errors with three parts."""
    try:
        spba = focgen.load(folder)
        if isinstance(spba, focgen.ScheduledController):
            return spba.step(0.01, 0.0, sched=0.1)
        return spba.step(0.01, 0.0)
    except LogError as error:
        assert_type((error.where, error.what, error.remedy), tuple[str, str, str])
        raise
