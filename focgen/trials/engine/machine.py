"""A rig whose body the physics engine moves; regulator and sensor around it are those of the other suites."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.errors import InputError
from focgen.rig.rig import UNITY, Rig
from focgen.trials import machine
from focgen.trials.engine.bodies import Body, Parts, model_text
from focgen.trials.engine.forms import ADDED, GOVERNED
from focgen.trials.engine.governors import Hands
from focgen.trials.forms_outside import OUTSIDE
from focgen.trials.machine import Setting, Trace
from focgen.trials.vocabulary import VOCABULARY

_SETTLING = 8.0  # body times before each experiment: it hangs as it hangs
_STAGE_OF = {form.name: stage for stage, forms in (*VOCABULARY.values(), *OUTSIDE.values()) for form in forms}


def engine() -> Any:
    """The physics engine. Raises InputError where it is not installed."""
    try:
        import mujoco
    except ImportError:
        what = "needs the physics engine MuJoCo, which is not installed"
        raise InputError("--suite engine", what, "install it: pip install 'focgen[engine]'") from None
    mujoco.set_mju_user_warning(_silent)
    return mujoco


def _silent(message: str) -> None:
    """The engine writes its warnings into a file in the working folder; :meth:`Moved.run` looks at them."""


@dataclass(frozen=True)
class EngineRig:
    """The true rig: ``rig`` has its regulator and sensor, and the actuator that its owner would identify;
    ``body`` is what moves; ``torque`` of one unit of pressure, ``angle`` of one radian in the rig's unit."""

    rig: Rig
    body: Body
    torque: float
    angle: float


class EngineSession:
    """The rig in use: what outlives a rest stays from one experiment to the next."""

    def __init__(self, true: EngineRig, settings: Sequence[Setting], h: float) -> None:
        self.h = h
        bare = replace(true.rig, actuator=None)
        at: dict[str, list[Setting]] = {"regulator": [], "sensor": [], "actuator": []}
        for setting in settings:
            at[_STAGE_OF.get(setting.form, "actuator")].append(setting)
        plain = {"regulator": replace(bare, sensor=UNITY), "sensor": replace(bare, regulator=UNITY)}
        self.ahead, self.behind = (
            machine.Session(machine.Machine(plain[stage], tuple(at[stage])), h) for stage in plain
        )
        self.moved = Moved(true, at["actuator"], h)

    def run(self, command: Array, clock: float) -> Trace:
        """One experiment from rest, the command (n,) held from step to step."""
        pressure = self.ahead.run(command, clock).pressure
        curvature = self.moved.run(pressure, clock)
        output = self.behind.run(curvature, clock).output
        return Trace(self.h, clock, np.ascontiguousarray(command, float), pressure, curvature, output)

    def read(self, output: Array) -> Array:
        """The samples as the sensor's converter gives them (a new array)."""
        return self.behind.read(output)


class Moved:
    """The body in the engine, with what ``settings`` add to it."""

    def __init__(self, true: EngineRig, settings: Sequence[Setting], h: float) -> None:
        self.mujoco, self.true, self.h = engine(), true, h
        parts = Parts()
        for setting in settings:
            if setting.form in ADDED:
                parts = ADDED[setting.form](parts, true.body, *setting.parameters)
        self.model = self.mujoco.MjModel.from_xml_string(model_text(true.body, parts, h))
        self.data = self.mujoco.MjData(self.model)
        row = np.arange(true.body.links)
        springs, dampers = self.model.jnt_stiffness[row].copy(), self.model.dof_damping[row].copy()
        hands = Hands(self.model, self.data, h, springs, dampers, row, {})
        governed = [s for s in settings if s.form in GOVERNED]
        self.governors = [GOVERNED[s.form](hands, *s.parameters) for s in governed]
        self.seen = self.model.tendon("seen").id

    def run(self, pressure: Array, clock: float) -> Array:
        """The angle (n,) in the rig's unit under ``pressure`` (n,), from where the body hangs; infinite
        throughout where no spring holds it any more and the engine gives up."""
        self.mujoco.mj_resetData(self.model, self.data)
        self._steps(np.zeros(round(_SETTLING * self.true.body.time / self.h)), None)
        angle = self._steps(self.true.torque * np.asarray(pressure, float), clock)
        lost = any(warning.number for warning in self.data.warning)
        return np.full(len(angle), np.inf) if lost else self.true.angle * angle

    def _steps(self, torque: Array, clock: float | None) -> Array:
        """The angle at the beginning of each step, ``clock`` None: nobody interferes."""
        step, model, data, seen = self.mujoco.mj_step, self.model, self.data, self.seen
        angle, control, length, speed = np.empty(len(torque)), data.ctrl, data.ten_length, data.ten_velocity
        governors, began = (self.governors, clock) if clock is not None else ([], 0.0)
        for k, now in enumerate(torque.tolist()):
            control[0] = now
            for govern in governors:
                govern(began + k * self.h, float(length[seen]), float(speed[seen]))
            step(model, data)
            angle[k] = length[seen]
        return angle


@dataclass(frozen=True, eq=False)
class EngineTrial:
    """What the rig goes through: commands on the grid of step ``h`` s, and the session's clock at each."""

    commands: Sequence[Array]
    clocks: Sequence[float]
    h: float

    def signals(self, true: EngineRig, settings: Sequence[Setting] = ()) -> dict[str, Array]:
        """Noise-free pressure, curvature and output (N,) of all experiments, one after the other."""
        session = EngineSession(true, settings, self.h)
        traces = [session.run(command, clock) for command, clock in zip(self.commands, self.clocks)]
        names = ("pressure", "curvature", "output")
        found = {name: np.concatenate([getattr(t, name) for t in traces]) for name in names}
        found["output"] = session.read(found["output"])
        return found
