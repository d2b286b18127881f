"""The forms of every effect in the generator's own physics.

A form maps an amplitude ``a``, found by bisection, onto the parameters of its C function; everything else
about it is drawn once a case. No formula here is one of the library's simulator.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.trials.machine import Setting


@dataclass(frozen=True)
class Spans:
    """The nominal swing of each signal in this rig's units; ``atmosphere`` as the pressure; times in s."""

    command: float
    pressure: float
    drive: float
    curvature: float
    output: float
    atmosphere: float
    session: float


Amplitude = Callable[[float], tuple[float, ...]]


@dataclass(frozen=True)
class Form:
    """``name`` in C; ``low`` and ``high`` bound the amplitude; ``draw`` fixes the rest; ``memory`` what it
    needs.
    """

    name: str
    low: float
    high: float
    draw: Callable[[np.random.Generator, Any], Amplitude]  # for Spans; for Angles where it is of a body
    memory: Callable[[np.random.Generator], tuple[Any, ...]] | None = None


@dataclass(frozen=True)
class Drawn:
    """A form with everything but its amplitude fixed."""

    effect: str
    stage: str
    form: Form
    amplitude: Amplitude
    memory: tuple[Any, ...] | None

    def at(self, a: float) -> Setting:
        """The setting of amplitude ``a``."""
        return Setting(self.form.name, tuple(float(x) for x in self.amplitude(a)), self.memory)


def either_way(rng: np.random.Generator) -> float:
    """-1 or 1."""
    return float(rng.choice((-1.0, 1.0)))


def wander(rng: np.random.Generator) -> list[float]:
    """Five half waves whose slow part dominates."""
    waves = rng.normal(size=5)
    waves[0] = np.sign(waves[0]) * max(abs(waves[0]), 0.6)
    return list(waves)


def alone(rng: np.random.Generator, spans: Spans) -> Amplitude:
    """The amplitude is the only parameter."""
    return lambda a: (a,)
