"""What changes a body while it moves, step by step: hands, wind, wear, a damper that works one way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.arrays import Array, Ints

Govern = Callable[[float, float, float], None]
"""Called ahead of every step with the session's clock in s, the angle and its speed."""


@dataclass(eq=False)
class Hands:
    """What a governor may take hold of: the engine's ``model`` and ``data``, the step ``h`` in s, the healthy
    stiffness and damping of each hinge (k,), and what it ``kept`` from one experiment to the next."""

    model: Any
    data: Any
    h: float
    stiffness: Array
    damping: Array
    hinges: Ints
    kept: dict[str, Any]

    def soften(self, factor: float) -> None:
        """Make every spring ``factor`` times as stiff as it was."""
        self.model.jnt_stiffness[self.hinges] = factor * self.stiffness

    def slow(self, factor: float) -> None:
        """Make every damper ``factor`` times as strong as it was."""
        self.model.dof_damping[self.hinges] = factor * self.damping

    def push(self, torque: float) -> None:
        """A torque on the whole row."""
        self.data.qfrc_applied[self.hinges] = torque


def check_damper(hands: Hands, extra: float, blend: float) -> Govern:
    """A damper 1 + ``extra`` times as strong while the angle falls, the change spread over a speed."""

    def act(clock: float, angle: float, speed: float) -> None:
        hands.slow(1.0 + extra * 0.5 * (1.0 - np.tanh(speed * np.sign(angle) / blend)))

    return act


def worn_by_angle(hands: Hands, growth: float, scale: float) -> Govern:
    """A spring that the largest angle so far has weakened (Mullins)."""

    def act(clock: float, angle: float, speed: float) -> None:
        most = hands.kept["most"] = max(hands.kept.get("most", 0.0), abs(angle))
        hands.soften(1.0 / (1.0 + growth * (1.0 - np.exp(-most / scale))))

    return act


def worn_by_travel(hands: Hands, growth: float, travel: float) -> Govern:
    """A spring that weakens with the angle travelled."""

    def act(clock: float, angle: float, speed: float) -> None:
        way = hands.kept["way"] = hands.kept.get("way", 0.0) + abs(speed) * hands.h
        hands.soften(1.0 / (1.0 + growth * way / (way + travel)))

    return act


def warming(hands: Hands, growth: float, time: float) -> Govern:
    """A spring that weakens with the clock, whatever it does."""

    def act(clock: float, angle: float, speed: float) -> None:
        hands.soften(1.0 / (1.0 + growth * (1.0 - np.exp(-clock / time))))

    return act


def wind(hands: Hands, torque: float, time: float, seed: float) -> Govern:
    """Gusts: a torque that wanders, of a correlation ``time``."""
    rng, keep = np.random.default_rng(int(seed)), np.exp(-hands.h / time)
    state = np.zeros(2)

    def act(clock: float, angle: float, speed: float) -> None:
        state[0] = keep * state[0] + np.sqrt(1.0 - keep**2) * rng.normal()
        state[1] += (1.0 - keep) * (state[0] - state[1])
        hands.push(torque * state[1])

    return act


def pushes(hands: Hands, torque: float, apart: float, long: float, seed: float) -> Govern:
    """Somebody pushes now and then, either way."""
    return _now_and_then(hands, apart, long, seed, lambda sign, angle: sign * torque)


def payload(hands: Hands, torque: float, apart: float, long: float, seed: float) -> Govern:
    """A weight is hung on and taken off."""
    return _now_and_then(hands, apart, long, seed, lambda sign, angle: -torque * np.cos(angle))


def shaking(hands: Hands, torque: float, frequency: float, drift: float) -> Govern:
    """The bench shakes: a tone whose strength comes and goes."""

    def act(clock: float, angle: float, speed: float) -> None:
        strength = 0.5 - 0.5 * np.cos(2 * np.pi * clock / drift)
        hands.push(torque * strength * np.sin(2 * np.pi * frequency * clock))

    return act


def _now_and_then(
    hands: Hands, apart: float, long: float, seed: float, torque: Callable[[float, float], float]
) -> Govern:
    rng = np.random.default_rng(int(seed))
    state = {"until": rng.exponential(apart), "on": False, "sign": 1.0}

    def act(clock: float, angle: float, speed: float) -> None:
        state["until"] -= hands.h
        if state["until"] < 0.0:
            state["on"] = not state["on"]
            state["sign"] = float(rng.choice((-1.0, 1.0)))
            state["until"] = rng.exponential(long if state["on"] else apart)
        hands.push(torque(state["sign"], angle) if state["on"] else 0.0)

    return act
