"""Forms of effects that no name of the vocabulary covers."""

from __future__ import annotations

import numpy as np

from focgen.trials.forms import Amplitude, Form, Spans


def _seed(rng: np.random.Generator) -> float:
    return float(rng.integers(1, 2**31))


def _ripple(rng: np.random.Generator, s: Spans) -> Amplitude:
    f, seed = rng.uniform(0.4, 2.0), _seed(rng)
    return lambda a: (a * s.pressure, f, seed)


def _seam(rng: np.random.Generator, s: Spans) -> Amplitude:
    on, off, seed = rng.uniform(2, 6), rng.uniform(6, 20), _seed(rng)
    return lambda a: (a, on, off, seed)


def _swing(rng: np.random.Generator, s: Spans) -> Amplitude:
    period, phase = rng.uniform(25.0, 60.0), rng.uniform(0, 6.28)
    return lambda a: (a * s.curvature, period, phase)


def _knock(rng: np.random.Generator, s: Spans) -> Amplitude:
    natural, ring = 2 * np.pi * rng.uniform(1.0, 3.0), rng.uniform(0.4, 1.0)
    return lambda a: (a * s.curvature, 0.03 * a * s.curvature, natural, ring)


def _pick_up(rng: np.random.Generator, s: Spans) -> Amplitude:
    f, on, off, seed = rng.uniform(0.7, 4.0), rng.uniform(3, 12), rng.uniform(5, 20), _seed(rng)
    return lambda a: (a * s.output, f, on, off, seed)


def _plug(rng: np.random.Generator, s: Spans) -> Amplitude:
    on, off, seed = rng.uniform(0.3, 1.2), rng.uniform(4.0, 12.0), _seed(rng)
    return lambda a: (a * s.output, on, off, seed)


def _fold(rng: np.random.Generator, s: Spans) -> Amplitude:
    at = rng.uniform(0.3, 0.5)
    return lambda a: (a * at * s.curvature, 0.03 * s.curvature)


# name -> its stage and its forms
OUTSIDE: dict[str, tuple[str, tuple[Form, ...]]] = {
    "supply_ripple": ("regulator", (Form("supply_ripple", 0.005, 0.2, _ripple),)),
    "opening_seam": ("regulator", (Form("opening_seam", 0.01, 0.6, _seam),)),
    "room_swing": ("actuator", (Form("room_swing", 0.01, 0.3, _swing),)),
    "loose_joint": ("actuator", (Form("loose_joint", 0.02, 0.7, _seam),)),
    "knocking_play": ("actuator", (Form("knocking_play", 0.02, 0.8, _knock),)),
    "pick_up": ("sensor", (Form("pick_up", 0.01, 0.5, _pick_up),)),
    "loose_plug": ("sensor", (Form("loose_plug", 0.02, 0.9, _plug),)),
    "folded_reading": ("sensor", (Form("folded_reading", 0.5, 1.0, _fold),)),
}
