"""Cases that cannot be identified by design: what is tied with what, and what would untie it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.trials import patterns
from focgen.trials.patterns import Experiment


@dataclass(frozen=True)
class Truth:
    """An effect that may be true: its ``effect`` and ``form``; its gap is ``target``, or its amplitude
    ``amplitude``.
    """

    effect: str
    form: str
    target: float = 0.08
    amplitude: float | None = None


@dataclass(frozen=True)
class Design:
    """``tied``: the effects these experiments cannot tell apart; ``truths``: what may be true, ``signals`` of
    which logs.

    ``resolves``: words of which a proposal that would tell them apart holds at least one. ``draw``: what is
    recorded.
    """

    name: str
    tied: tuple[str, ...]
    truths: tuple[Truth, ...]
    signals: str
    resolves: tuple[str, ...]
    draw: Callable[[np.random.Generator, float], list[Experiment]]

    def facts(self) -> dict[str, Any]:
        """What the label says of it."""
        return {"name": self.name, "tied": list(self.tied), "resolves": list(self.resolves)}


def _slow_sine(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """One slow sine twice, entered without a corner: at one frequency a small delay and a small lag are the
    same.
    """
    f, mean, swing = rng.uniform(0.03, 0.04), 0.5, 0.4
    t = np.arange(round(5.0 / f / Ts)) * Ts
    ease = 0.5 - 0.5 * np.cos(np.pi * np.minimum(t * f, 1.0))
    wave = ease * (mean - swing * np.cos(2.0 * np.pi * f * t))
    return [Experiment("slow_sine", wave), Experiment("slow_sine_again", wave.copy())]


def _gentle(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """Slow ramps only: whether the motion stops before or behind the sensor's own lag does not show."""
    up = [
        Experiment(f"ramps{i + 1}", patterns.minor_loops(rng, Ts, speed))
        for i, speed in enumerate((0.05, 0.03))
    ]
    return [*up, Experiment("sway", patterns.sines(rng, Ts, (0.02, 0.04), 2.0, 60.0))]


_AGAIN = (
    "random",
    "shuffl",
    "repeat",
    "again",
    "down",
    "releas",
    "revers",
    "unload",
    "falling",
    "staircase",
    "triangle",
    "first",
)

DESIGNS = (
    Design(
        "rising_steps",
        ("gain_nonlinearity", "softening", "gain_drift"),
        (
            Truth("gain_nonlinearity", "locking_chain"),
            Truth("gain_nonlinearity", "balloon_curve"),
            Truth("softening", "worked_soft"),
            Truth("gain_drift", "warming_gain"),
        ),
        "CBA",
        _AGAIN,
        patterns.rising,
    ),
    Design(
        "no_curvature",
        ("contact", "sensor_saturation", "sensor_nonlinearity"),
        (Truth("contact", "foam_pad", amplitude=400.0), Truth("sensor_saturation", "soft_rail")),
        "BA",
        ("curvature", "camera", "vision", "kappa", "step", "fast"),
        _gentle,
    ),
    Design(
        "slow_sine",
        ("transport_delay", "slow_regulator"),
        (Truth("transport_delay", "tube_wave", 0.01), Truth("slow_regulator", "line_ladder", 0.01)),
        "CB",
        ("step", "fast", "chirp", "multisine", "quick", "higher"),
        _slow_sine,
    ),
)


def draw_design(signals: str, rng: np.random.Generator) -> Design:
    """One that applies to these signals, at random."""
    fitting = [d for d in DESIGNS if signals in d.signals]
    return fitting[rng.integers(len(fitting))]
