"""Forms of the sensor's effects: calibration, material, electronics and converter."""

from __future__ import annotations

import numpy as np

from focgen.trials.forms import Amplitude, Form, Spans, alone, either_way, wander


def _bend(rng: np.random.Generator, s: Spans) -> Amplitude:
    sign = either_way(rng)
    return lambda a: (sign * a, s.curvature)


def _divider(rng: np.random.Generator, s: Spans) -> Amplitude:
    return lambda a: (a, s.curvature)


def _hang(rng: np.random.Generator, s: Spans) -> Amplitude:
    up, down = rng.uniform(0.06, 0.15), rng.uniform(0.06, 0.15)
    return lambda a: (a, s.curvature, up, down)


def _lens(rng: np.random.Generator, s: Spans) -> Amplitude:
    way = rng.uniform(0.15, 0.4)
    return lambda a: (a, s.curvature, way)


def _healing(rng: np.random.Generator, s: Spans) -> Amplitude:
    tau = rng.uniform(3.0, 15.0)
    return lambda a: (a, tau, s.curvature)


def _depths(rng: np.random.Generator, s: Spans) -> Amplitude:
    share = rng.uniform(0.65, 0.9)
    return lambda a: (a, share)


def _warm_offset(rng: np.random.Generator, s: Spans) -> Amplitude:
    tau, sign = rng.uniform(0.3, 1.5) * s.session, either_way(rng)
    return lambda a: (sign * a * s.output, tau)


def _wander_offset(rng: np.random.Generator, s: Spans) -> Amplitude:
    waves, length = wander(rng), rng.uniform(1.0, 1.6) * s.session
    return lambda a: (a * s.output, length, *waves)


def _soft_rail(rng: np.random.Generator, s: Spans) -> Amplitude:
    knee = rng.uniform(0.008, 0.03)
    return lambda a: (s.output * (1.0 - 0.7 * a), knee * s.output)


def _sticky_rail(rng: np.random.Generator, s: Spans) -> Amplitude:
    lag = rng.uniform(0.05, 0.3)
    return lambda a: (s.output * (1.0 - 0.7 * a), lag)


def _lazy(rng: np.random.Generator, s: Spans) -> Amplitude:
    lazy = rng.uniform(0.05, 0.3)
    return lambda a: (a * s.output, lazy)


def _uneven(rng: np.random.Generator, s: Spans) -> Amplitude:
    uneven, phase = rng.uniform(0.03, 0.15), rng.uniform(0, 6.28)
    return lambda a: (a * s.output, uneven, phase)


def _stretched_memory(rng: np.random.Generator) -> tuple[str, float, float]:
    return ("electrode", rng.uniform(2.0, 8.0), rng.uniform(0.5, 0.8))


FORMS: dict[str, tuple[Form, ...]] = {
    "sensor_nonlinearity": (
        Form("exponential_curve", 0.03, 2.5, _bend),
        Form("divider_curve", 0.03, 4.0, _divider),
    ),
    "sensor_hysteresis": (Form("uneven_hang", 0.01, 0.3, _hang), Form("lens_curves", 0.01, 0.3, _lens)),
    "sensor_relaxation": (
        Form("stretched_relaxation", 0.03, 1.2, alone, _stretched_memory),
        Form("healing_contacts", 0.03, 1.2, _healing),
    ),
    "sensor_lag": (Form("bessel_filter", 0.02, 1.5, alone), Form("two_depths", 0.03, 3.0, _depths)),
    "sensor_drift": (
        Form("warming_offset", 0.01, 0.6, _warm_offset),
        Form("wandering_offset", 0.005, 0.4, _wander_offset),
    ),
    "sensor_quantization": (
        Form("lazy_converter", 0.01, 0.35, _lazy),
        Form("uneven_converter", 0.01, 0.35, _uneven),
    ),
    "sensor_saturation": (
        Form("soft_rail", 0.02, 1.0, _soft_rail),
        Form("sticky_rail", 0.02, 1.0, _sticky_rail),
    ),
}
