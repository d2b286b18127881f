"""The baseline every diagnosis must beat: which hand-made regressor looks most like the residual.

The nominal rig is simulated stage by stage on measured inputs, its nominal parameters refitted to first
order; the stage whose residual is the largest share of its signal is taken, and of its effects the one whose
regressor has the largest cosine with that residual.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

import focgen
from focgen.arrays import Array
from focgen.logs.experiment import Experiment
from focgen.rig.rig import UNITY, Rig
from focgen.trials.belongs import logs_of_case
from focgen.trials.severity import Trial, below_one, moved_rigs, rms

_STEP = 0.01
_STAGES = {
    "pressure": (
        "transport_delay",
        "slow_regulator",
        "valve_asymmetry",
        "valve_stiction",
        "flow_limit",
        "supply_saturation",
        "leak",
    ),
    "curvature": (
        "hysteresis",
        "creep",
        "unloading_asymmetry",
        "softening",
        "gain_nonlinearity",
        "dead_zone",
        "contact",
        "resonance",
        "gain_drift",
    ),
    "output": (
        "sensor_nonlinearity",
        "sensor_hysteresis",
        "sensor_relaxation",
        "sensor_lag",
        "sensor_drift",
        "sensor_quantization",
        "sensor_saturation",
    ),
}


def guess(case: Path) -> str | None:
    """The heuristic's one effect for a case folder, or None where the rig is beyond it."""
    rig = focgen.read_rig(case / "rig.toml")
    if rig.sample_time < _STEP or rig.sample_time > 0.2:
        return None
    logs = focgen.read_logs(rig, logs_of_case(case))
    best, found = -1.0, None
    inputs = "command"
    waiting: list[str] = []
    for name, effects in _STAGES.items():
        waiting += effects
        if name in logs[0]:
            size, effect = _look(rig, logs, inputs, name, tuple(waiting))
            if size > best:
                best, found = size, effect
            inputs, waiting = name, []
    return found


def _look(
    rig: Rig, logs: Sequence[Experiment], inputs: str, name: str, effects: Sequence[str]
) -> tuple[float, str]:
    """Relative residual of the part from ``inputs`` to ``name``, and the best-looking of ``effects``."""
    part = below_one(_part(rig, inputs, name))
    every = round(rig.sample_time / _STEP)
    trial = Trial([np.repeat(log[inputs], every) for log in logs], [log.start for log in logs], _STEP)
    made = trial.signals(part)[name][::every]
    measured = np.concatenate([log[name] for log in logs])
    time = np.concatenate([log.start + log.time for log in logs])
    sensitive = [trial.signals(moved)[name][::every] - made for moved, _ in moved_rigs(part)]
    rest = _without(measured - made, sensitive)
    ends = np.cumsum([len(log) for log in logs])[:-1]
    looks = {}
    for effect in effects:
        shape = _without(
            np.concatenate(
                [
                    _REGRESSORS[effect](s, t, rig.sample_time)
                    for s, t in zip(np.split(made / np.ptp(made), ends), np.split(time, ends))
                ]
            ),
            sensitive,
        )
        looks[effect] = abs(shape @ rest) / (np.linalg.norm(shape) * np.linalg.norm(rest) + 1e-300)
    return rms(rest) / np.ptp(measured), max(looks, key=lambda effect: looks[effect])


def _part(rig: Rig, inputs: str, name: str) -> Rig:
    """The rig without the stages before ``inputs``; those after ``name`` do no harm."""
    if inputs == "command":
        return rig
    if inputs == "pressure":
        return replace(rig, regulator=UNITY)
    return replace(rig, regulator=UNITY, actuator=None)


def _without(values: Array, columns: Sequence[Array]) -> Array:
    kept = [c / np.linalg.norm(c) for c in columns if np.linalg.norm(c) > 0.0]
    if not kept:
        return values
    matrix = np.stack(kept, axis=1)
    made: Array = values - matrix @ np.linalg.lstsq(matrix, values, rcond=1e-8)[0]
    return made


def _low(s: Array, tau: float, Ts: float) -> Array:
    share = np.exp(-Ts / tau)
    made: Array = lfilter([1.0 - share], [1.0, -share], s)
    return made


def _rate(s: Array, Ts: float) -> Array:
    return np.gradient(s, Ts)


def _play(s: Array, width: float) -> Array:
    out, at = np.empty_like(s), 0.0
    for i, value in enumerate(s):
        at = min(max(at, value - width), value + width)
        out[i] = at
    return out


# of the simulated signal s (share of its span), the session's time t and the sample time
_REGRESSORS: dict[str, Callable[[Array, Array, float], Array]] = {
    "transport_delay": lambda s, t, Ts: _rate(s, Ts),
    "slow_regulator": lambda s, t, Ts: s - _low(s, 0.3, Ts),
    "valve_asymmetry": lambda s, t, Ts: np.minimum(_rate(s, Ts), 0.0),
    "valve_stiction": lambda s, t, Ts: s - _play(s, 0.03),
    "flow_limit": lambda s, t, Ts: _rate(s, Ts) * np.abs(_rate(s, Ts)),
    "supply_saturation": lambda s, t, Ts: np.maximum(s - 0.8, 0.0),
    "leak": lambda s, t, Ts: s,
    "hysteresis": lambda s, t, Ts: s - _play(s, 0.1),
    "creep": lambda s, t, Ts: _low(s, 40.0, Ts),
    "unloading_asymmetry": lambda s, t, Ts: np.minimum(_rate(_low(s, 0.5, Ts), Ts), 0.0),
    "softening": lambda s, t, Ts: s * np.maximum.accumulate(s),
    "gain_nonlinearity": lambda s, t, Ts: s**3,
    "dead_zone": lambda s, t, Ts: np.minimum(s, 0.1),
    "contact": lambda s, t, Ts: np.maximum(s - 0.5, 0.0),
    "resonance": lambda s, t, Ts: np.gradient(_rate(s, Ts), Ts),
    "gain_drift": lambda s, t, Ts: s * t,
    "sensor_nonlinearity": lambda s, t, Ts: s**2,
    "sensor_hysteresis": lambda s, t, Ts: s - _play(s, 0.1),
    "sensor_relaxation": lambda s, t, Ts: s - _low(s, 5.0, Ts),
    "sensor_lag": lambda s, t, Ts: _rate(s, Ts),
    "sensor_drift": lambda s, t, Ts: t,
    "sensor_quantization": lambda s, t, Ts: s - 0.05 * np.round(s / 0.05),
    "sensor_saturation": lambda s, t, Ts: np.maximum(s - 0.85, 0.0),
}
