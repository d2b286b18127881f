"""Forms of the actuator's effects: what its material and its neighbours do."""

from __future__ import annotations

import numpy as np

from focgen.trials.forms import Amplitude, Form, Spans, either_way, wander


def _preisach(rng: np.random.Generator, s: Spans) -> Amplitude:
    width, level = rng.uniform(1.3, 1.9), rng.uniform(-0.15, 0.3)
    return lambda a: (a, width, level, s.drive)


def _duhem(rng: np.random.Generator, s: Spans) -> Amplitude:
    steep, power = rng.uniform(4.0, 10.0), rng.uniform(1.2, 1.8)
    return lambda a: (a, s.drive, steep, power)


def _eyring(rng: np.random.Generator, s: Spans) -> Amplitude:
    tau, stress = rng.uniform(30.0, 90.0), rng.uniform(0.25, 0.5)
    return lambda a: (a * _reach(s), tau, stress * s.drive)


def _roxburgh(rng: np.random.Generator, s: Spans) -> Amplitude:
    floor, slope = rng.uniform(0.08, 0.2), rng.uniform(0.1, 0.3)
    return lambda a: (a, s.drive, floor, slope)


def _worked(rng: np.random.Generator, s: Spans) -> Amplitude:
    strokes = rng.uniform(3.0, 12.0)
    return lambda a: (a, s.drive, strokes)


def _warm_gain(rng: np.random.Generator, s: Spans) -> Amplitude:
    tau, sign = rng.uniform(0.3, 2.0) * s.session, either_way(rng)
    return lambda a: (sign * a, tau)


def _wander_gain(rng: np.random.Generator, s: Spans) -> Amplitude:
    waves, length = wander(rng), rng.uniform(1.0, 1.6) * s.session
    return lambda a: (a, length, *waves)


def _viscosity(rng: np.random.Generator, s: Spans) -> Amplitude:
    blend = rng.uniform(0.01, 0.04)
    return lambda a: (a, blend * s.drive)


def _locking(rng: np.random.Generator, s: Spans) -> Amplitude:
    sharp = rng.uniform(2.5, 6.0)
    return lambda a: (s.drive / a, sharp)


def _balloon(rng: np.random.Generator, s: Spans) -> Amplitude:
    middle, width, sign = rng.uniform(0.35, 0.65), rng.uniform(0.15, 0.3), either_way(rng)
    limit = 0.8 * width if sign < 0 else 1.0  # the curve must keep rising
    return lambda a: (sign * min(a, limit), s.drive, middle, width)


def _preload(rng: np.random.Generator, s: Spans) -> Amplitude:
    bend = rng.uniform(0.2, 0.8)
    return lambda a: (a * s.drive, bend * a * s.drive)


def _hertz(rng: np.random.Generator, s: Spans) -> Amplitude:
    knee = rng.uniform(0.4, 0.65)
    return lambda a: (a, knee * s.curvature, 0.2 * s.curvature)


def _foam(rng: np.random.Generator, s: Spans) -> Amplitude:
    knee = rng.uniform(0.4, 0.65)
    return lambda a: (s.curvature / a, knee * s.curvature)


def _oscillator(rng: np.random.Generator, s: Spans) -> Amplitude:
    natural, damping = 2.0 * np.pi * rng.uniform(0.6, 2.2), rng.uniform(0.04, 0.2)
    return lambda a: (a, natural, damping, s.drive)


def _side(rng: np.random.Generator, s: Spans) -> Amplitude:
    drawn = _oscillator(rng, s)
    return lambda a: (a * _reach(s), *drawn(a)[1:])


def _reach(s: Spans) -> float:
    """What moves per drive: a curvature per curvature, and per pressure of a plant that pressure drives."""
    return s.curvature / s.drive


def _log_creep(rng: np.random.Generator, s: Spans) -> Amplitude:
    return lambda a: (a * _reach(s),)


def _log_memory(rng: np.random.Generator) -> tuple[str, float, float]:
    return ("creep", rng.uniform(4.0, 20.0), 200.0)


FORMS: dict[str, tuple[Form, ...]] = {
    "hysteresis": (Form("preisach_share", 0.05, 1.0, _preisach), Form("duhem_friction", 0.01, 0.3, _duhem)),
    "creep": (
        Form("log_creep", 0.02, 1.0, _log_creep, _log_memory),
        Form("eyring_creep", 0.02, 1.0, _eyring),
    ),
    "unloading_asymmetry": (
        Form("recovery_viscosity", 0.05, 6.0, _viscosity),
        Form("sticky_release", 0.05, 6.0, lambda rng, s: lambda a: (a, s.curvature)),
    ),
    "softening": (Form("roxburgh", 0.02, 0.8, _roxburgh), Form("worked_soft", 0.02, 0.8, _worked)),
    "gain_nonlinearity": (
        Form("locking_chain", 0.3, 4.0, _locking),
        Form("balloon_curve", 0.01, 0.4, _balloon),
    ),
    "dead_zone": (
        Form("slack_hinge", 0.02, 0.45, lambda rng, s: lambda a: (a * s.drive, 0.02 * s.drive)),
        Form("preload", 0.02, 0.45, _preload),
    ),
    "contact": (Form("hertz_load", 0.03, 20.0, _hertz), Form("foam_pad", 0.2, 40.0, _foam)),
    "resonance": (Form("duffing_share", 0.05, 1.0, _oscillator), Form("side_mode", 0.05, 1.2, _side)),
    "gain_drift": (
        Form("warming_gain", 0.01, 1.0, _warm_gain),
        Form("wandering_gain", 0.005, 0.6, _wander_gain),
    ),
}
