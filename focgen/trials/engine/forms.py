"""The forms of the body's effects in the engine: what is added to its hinges, or done to them.

Amplitudes ``a`` are found by bisection; angles are parts of the largest healthy angle ``s.curvature``,
torques of that which bends it so far.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from focgen.trials.engine import governors
from focgen.trials.engine.bodies import Body, Link, Parts, Series
from focgen.trials.forms import Amplitude, Form, either_way


@dataclass(frozen=True)
class Angles:
    """What forms are drawn for: the largest healthy ``angle`` in rad, the body's ``time`` and the session's
    length in s."""

    angle: float
    time: float
    session: float


def _dry(parts: Parts, body: Body, torque: float) -> Parts:
    return replace(parts, friction=torque)


def _slipping(parts: Parts, body: Body, stiffness: float, torque: float) -> Parts:
    return replace(parts, slip=(stiffness, torque))


def _backlash(parts: Parts, body: Body, width: float) -> Parts:
    return replace(parts, link=Link(-width, width, 0.02 * width, 0.0, 0.01))


def _slack(parts: Parts, body: Body, width: float) -> Parts:
    return replace(parts, link=Link(-width, 10.0, 0.0, 0.03, 0.02 * body.time))


def _preloaded(parts: Parts, body: Body, angle: float) -> Parts:
    return replace(parts, preload=angle)


def _bending(parts: Parts, body: Body, linear: float, square: float) -> Parts:
    return replace(parts, bends=(linear, square))


def _heavy(parts: Parts, body: Body, torque: float, phase: float) -> Parts:
    return replace(parts, tip=(torque, phase))


def _stopped(parts: Parts, body: Body, angle: float) -> Parts:
    return replace(parts, stop=angle)


def _bumped(parts: Parts, body: Body, angle: float, stiffness: float) -> Parts:
    return replace(parts, bumper=(angle, stiffness))


def _soaking(parts: Parts, body: Body, share: float, time: float) -> Parts:
    return replace(parts, series=Series(1.0 / share, time / share, 1e-4, True, False))


def _springy(parts: Parts, body: Body, inertia: float, natural: float, damping: float) -> Parts:
    own = Series(inertia * natural**2, 2.0 * damping * natural * inertia, inertia, False, True)
    return replace(parts, series=own)


def _rod(parts: Parts, body: Body, share: float, natural: float, damping: float) -> Parts:
    inertia = 1.0 / (share * natural**2)
    own = Series(1.0 / share, 2.0 * damping * natural * inertia, inertia, True, False)
    return replace(parts, series=own)


ADDED: dict[str, Callable[..., Parts]] = {
    "friction_loss": _dry,
    "slipping_spring": _slipping,
    "backlash": _backlash,
    "slack_tendon": _slack,
    "preloaded_stop": _preloaded,
    "polynomial_spring": _bending,
    "heavy_tip": _heavy,
    "joint_limit": _stopped,
    "bumper": _bumped,
    "soaking_link": _soaking,
    "flexible_tip": _springy,
    "side_rod": _rod,
}

GOVERNED: dict[str, Callable[..., governors.Govern]] = {
    "check_damper": governors.check_damper,
    "worn_by_angle": governors.worn_by_angle,
    "worn_by_travel": governors.worn_by_travel,
    "warming_spring": governors.warming,
    "wind": governors.wind,
    "pushes": governors.pushes,
    "payload": governors.payload,
    "shaking": governors.shaking,
}


def _friction(rng: np.random.Generator, s: Angles) -> Amplitude:
    return lambda a: (a * s.angle,)


def _slip(rng: np.random.Generator, s: Angles) -> Amplitude:
    stiffness = rng.uniform(0.3, 1.0)
    return lambda a: (stiffness, a * s.angle)


def _width(rng: np.random.Generator, s: Angles) -> Amplitude:
    return lambda a: (a * s.angle,)


def _polynomial(rng: np.random.Generator, s: Angles) -> Amplitude:
    linear, sign = rng.uniform(0.0, 1.0), either_way(rng)
    most = 1e9 if sign > 0 else 0.13  # beyond, it would give way at the largest torque

    def amplitude(a: float) -> tuple[float, ...]:
        a = sign * min(a, most)
        return a * linear / s.angle, a * (1.0 - linear) / s.angle**2

    return amplitude


def _tip(rng: np.random.Generator, s: Angles) -> Amplitude:
    phase, sign = rng.uniform(-0.3, 0.9), either_way(rng)
    return lambda a: (sign * min(a, 1e9 if sign > 0 else 0.6), phase)


def _stop(rng: np.random.Generator, s: Angles) -> Amplitude:
    return lambda a: (s.angle * (1.0 - a),)


def _bumper(rng: np.random.Generator, s: Angles) -> Amplitude:
    at = rng.uniform(0.4, 0.65)
    return lambda a: (at * s.angle, a)


def _kelvin(rng: np.random.Generator, s: Angles) -> Amplitude:
    time = rng.uniform(8.0, 25.0)
    return lambda a: (a, time)


def _mode(rng: np.random.Generator, s: Angles) -> Amplitude:
    natural, damping = 2.0 * np.pi * rng.uniform(0.8, 3.0), rng.uniform(0.03, 0.12)
    return lambda a: (a, natural, damping)


def _whip(rng: np.random.Generator, s: Angles) -> Amplitude:
    draw = _mode(rng, s)
    return lambda a: (a * s.time**2, *draw(a)[1:])


def _damper(rng: np.random.Generator, s: Angles) -> Amplitude:
    return lambda a: (a, 0.02 * s.angle)


def _largest(rng: np.random.Generator, s: Angles) -> Amplitude:
    scale = rng.uniform(0.3, 0.8)
    return lambda a: (a, scale * s.angle)


def _travel(rng: np.random.Generator, s: Angles) -> Amplitude:
    strokes = rng.uniform(4.0, 15.0)
    return lambda a: (a, strokes * s.angle)


def _warm(rng: np.random.Generator, s: Angles) -> Amplitude:
    time = rng.uniform(0.3, 1.5) * s.session
    return lambda a: (a, time)


def _seed(rng: np.random.Generator) -> float:
    return float(rng.integers(1, 2**31))


def _gusts(rng: np.random.Generator, s: Angles) -> Amplitude:
    time, seed = rng.uniform(0.5, 3.0), _seed(rng)
    return lambda a: (a * s.angle, time, seed)


def _hands(rng: np.random.Generator, s: Angles) -> Amplitude:
    apart, long, seed = rng.uniform(6.0, 15.0), rng.uniform(0.5, 2.0), _seed(rng)
    return lambda a: (a * s.angle, apart, long, seed)


def _weights(rng: np.random.Generator, s: Angles) -> Amplitude:
    apart, long, seed = rng.uniform(8.0, 20.0), rng.uniform(8.0, 20.0), _seed(rng)
    return lambda a: (a * s.angle, apart, long, seed)


def _shaken(rng: np.random.Generator, s: Angles) -> Amplitude:
    frequency, drift = rng.uniform(0.6, 2.5), rng.uniform(20.0, 60.0)
    return lambda a: (a * s.angle, frequency, drift)


BODY: dict[str, tuple[Form, ...]] = {
    "friction": (Form("friction_loss", 0.01, 0.45, _friction),),
    "hysteresis": (Form("slipping_spring", 0.01, 0.45, _slip), Form("backlash", 0.01, 0.4, _width)),
    "dead_zone": (Form("slack_tendon", 0.01, 0.45, _width), Form("preloaded_stop", 0.01, 0.45, _width)),
    "gain_nonlinearity": (
        Form("polynomial_spring", 0.03, 5.0, _polynomial),
        Form("heavy_tip", 0.05, 3.0, _tip),
    ),
    "contact": (Form("joint_limit", 0.03, 0.7, _stop), Form("bumper", 0.1, 30.0, _bumper)),
    "creep": (Form("soaking_link", 0.02, 1.0, _kelvin),),
    "resonance": (
        Form("flexible_tip", 0.003, 0.6, _whip),
        Form("side_rod", 0.01, 1.0, _mode),
    ),
    "unloading_asymmetry": (Form("check_damper", 0.1, 8.0, _damper),),
    "softening": (Form("worn_by_angle", 0.03, 1.5, _largest), Form("worn_by_travel", 0.03, 1.5, _travel)),
    "gain_drift": (Form("warming_spring", 0.03, 1.5, _warm),),
}
"""Effect of the body → its forms."""

HANDS: dict[str, tuple[Form, ...]] = {
    "wind": (Form("wind", 0.05, 3.0, _gusts),),
    "pushes": (Form("pushes", 0.05, 3.0, _hands),),
    "payload": (Form("payload", 0.03, 1.0, _weights),),
    "shaking": (Form("shaking", 0.05, 5.0, _shaken),),
}
"""What no name of the vocabulary covers → its forms."""
