"""Cases that cannot be identified by design: what is tied with what, and what would untie it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from focgen.trials import excitation
from focgen.trials.excitation import Experiment


@dataclass(frozen=True)
class Design:
    """``tied``: the effects these experiments cannot tell apart, the first ``true_ones`` of them may be true.

    ``resolves``: words of which a proposal that would tell them apart holds at least one.
    ``experiments`` draws what is recorded; None where the suite's own experiments already tie them.
    """

    name: str
    tied: tuple[str, ...]
    true_ones: int
    signals: str
    resolves: tuple[str, ...]
    draw: Callable[[np.random.Generator, float], list[Experiment]]

    def effects(self, rng: np.random.Generator) -> tuple[str, ...]:
        """The one effect that is true."""
        return (self.tied[rng.integers(self.true_ones)],)

    def experiments(self, rng: np.random.Generator, Ts: float) -> list[Experiment]:
        """What is recorded."""
        return self.draw(rng, Ts)

    def facts(self) -> dict:
        """What the label says of it."""
        return {"name": self.name, "tied": list(self.tied), "resolves": list(self.resolves)}


def _slow_sine(rng: np.random.Generator, Ts: float) -> list[Experiment]:
    """One slow sine, entered and left without a corner."""
    f, mean, swing = rng.uniform(0.04, 0.06), 0.5, 0.4
    t = np.arange(round(5.0 / f / Ts)) * Ts
    ease = 0.5 - 0.5 * np.cos(np.pi * np.minimum(t * f, 1.0))
    wave = ease * (mean - swing * np.cos(2.0 * np.pi * f * t))
    return [Experiment("slow_sine", wave), Experiment("slow_sine_again", wave.copy())]


DESIGNS = (
    Design(
        "rising_steps",
        ("gain_nonlinearity", "softening", "gain_drift"),
        2,
        "CBA",
        (
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
        ),
        excitation.rising,
    ),
    Design(
        "no_curvature",
        ("contact", "sensor_saturation", "sensor_nonlinearity"),
        2,
        "BA",
        ("curvature", "camera", "vision", "kappa"),
        excitation.full,
    ),
    Design(
        "slow_sine",
        ("transport_delay", "slow_regulator"),
        2,
        "CBA",
        ("step", "fast", "chirp", "multisine", "quick", "higher"),
        _slow_sine,
    ),
)


def draw_design(signals: str, rng: np.random.Generator) -> Design:
    """One that applies to these signals, at random."""
    fitting = [d for d in DESIGNS if signals in d.signals]
    return fitting[rng.integers(len(fitting))]
