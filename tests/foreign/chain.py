"""The foreign chain: a valve and chamber, a fractional actuator by the L1 scheme on all of its past, a lag.

Fine steps of 10 ms; the command is held between samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import gamma

import numpy as np

Act = Callable[[np.ndarray, np.ndarray, dict], np.ndarray]


@dataclass(frozen=True)
class Physics:
    """Times in s, levels in the log's units: ``gain`` and ``tau`` of valve and chamber, ``T``, ``alpha``,
    and ``curve`` (linear, quadratic) of the actuator, ``scale`` and ``lag`` of the sensor."""

    gain: float
    tau: float
    T: float
    alpha: float
    curve: tuple[float, float]
    scale: float
    lag: float


@dataclass(frozen=True, eq=False)
class Fault:
    """What is wrong: ``slot`` and ``act(x, clock, memory)`` on a whole experiment (n,), or ``rate(to, p,
    tau)`` of the chamber, 1/s, or ``slow``, by how much longer T is while unloading. The memory lasts for the
    session."""

    slot: str = ""
    act: Act | None = None
    rate: Callable[[float, float, float], float] | None = None
    slow: float = 0.0


@dataclass(eq=False)
class Session:
    """A session of one rig; what outlives a rest is kept from call to call."""

    physics: Physics
    faults: tuple[Fault, ...] = ()
    h: float = 0.01
    memory: dict = field(default_factory=dict)

    def run(self, command: np.ndarray, clock: np.ndarray) -> dict[str, np.ndarray]:
        """Pressure, curvature and output (n,) without noise of a command (n,) at times ``clock`` (n,)."""
        does, physics = lambda slot, x: self._does(slot, x, clock), self.physics
        pressure = does("supply", self._chamber(does("command", command)))
        (first, second), load = physics.curve, does("load", pressure)
        drive = does("drive", (first + second * load) * load)
        curvature = does("response", self._material(drive))
        strain = does("strain", curvature)
        output = does("reading", physics.scale * lagged(strain, physics.lag, self.h))
        return {"command": command, "pressure": pressure, "curvature": curvature, "output": output}

    def _does(self, slot: str, x: np.ndarray, clock: np.ndarray) -> np.ndarray:
        for fault in self.faults:
            if fault.slot == slot and fault.act is not None:
                x = fault.act(x, clock, self.memory)
        return x

    def _chamber(self, command: np.ndarray) -> np.ndarray:
        """Heun's steps of p' = rate(gain u, p)."""
        rate = next((f.rate for f in self.faults if f.rate), lambda to, p, tau: (to - p) / tau)
        found, p, tau = np.zeros(len(command)), 0.0, self.physics.tau
        for k, to in enumerate(self.physics.gain * command[:-1]):
            first = rate(to, p, tau)
            p += 0.5 * self.h * (first + rate(to, p + self.h * first, tau))
            found[k + 1] = p
        return found

    def _material(self, drive: np.ndarray) -> np.ndarray:
        """T D^alpha y + y = v from rest, T longer while v is below y."""
        alpha, slow = self.physics.alpha, sum(f.slow for f in self.faults)
        k = np.arange(len(drive) + 1.0)
        b = np.diff(k ** (1.0 - alpha))[::-1]
        y, rises, unit = np.zeros(len(drive)), np.zeros(len(drive)), self.h**-alpha / gamma(2.0 - alpha)
        for n in range(1, len(drive)):
            T = unit * self.physics.T * (1.0 + slow * (drive[n] < y[n - 1]))
            past = b[-n:-1] @ rises[1:n] if n > 1 else 0.0
            y[n] = (drive[n] + T * (y[n - 1] - past)) / (1.0 + T)
            rises[n] = y[n] - y[n - 1]
        return y


def lagged(x: np.ndarray, tau: float, h: float) -> np.ndarray:
    """First-order lag of a polygon (n,), from rest at its first value being 0."""
    found, now, keep = np.zeros(len(x)), 0.0, float(np.exp(-h / tau))
    for k in range(1, len(x)):
        now = keep * now + (1.0 - keep) * 0.5 * (x[k] + x[k - 1])
        found[k] = now
    return found
