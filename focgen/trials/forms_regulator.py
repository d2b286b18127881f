"""Forms of the regulator's effects: supply, valve, tube and chamber."""

from __future__ import annotations

import numpy as np

from focgen.trials.forms import Amplitude, Form, Spans, alone


def _ladder(rng: np.random.Generator, s: Spans) -> Amplitude:
    return lambda a: (a / 6.0,)


def _second_order(rng: np.random.Generator, s: Spans) -> Amplitude:
    damping = rng.uniform(1.0, 1.6)
    return lambda a: (2.0 * damping / a, damping)


def _exhaust(rng: np.random.Generator, s: Spans) -> Amplitude:
    way = -1.0 if rng.random() < 0.25 else 1.0
    near = rng.uniform(0.03, 0.1)
    return lambda a: (0.6 / a, s.pressure, near * s.pressure, s.atmosphere, way, 1.5 * s.pressure)


def _spool(rng: np.random.Generator, s: Spans) -> Amplitude:
    kinetic, lag = rng.uniform(0.4, 0.7), rng.uniform(0.01, 0.03)
    return lambda a: (a * s.command, kinetic * a * s.command, lag)


def _stick_band(rng: np.random.Generator, s: Spans) -> Amplitude:
    jump = rng.uniform(0.2, 0.8)
    return lambda a: (a * s.command, jump * a * s.command)


def _tank(rng: np.random.Generator, s: Spans) -> Amplitude:
    drain, refill = rng.uniform(0.05, 0.25), rng.uniform(0.5, 3.0)
    return lambda a: (s.pressure * (1.0 - 0.7 * a), drain, refill)


def _soft_supply(rng: np.random.Generator, s: Spans) -> Amplitude:
    knee = rng.uniform(0.01, 0.03)
    return lambda a: (s.pressure * (1.0 - 0.7 * a), knee * s.pressure)


def _leak(rng: np.random.Generator, s: Spans) -> Amplitude:
    lag = rng.uniform(0.03, 0.2)
    return lambda a: (a, lag, s.pressure, s.atmosphere)


FORMS: dict[str, tuple[Form, ...]] = {
    "transport_delay": (Form("tube_wave", 0.01, 0.8, alone), Form("tube_cells", 0.01, 0.8, alone)),
    "slow_regulator": (
        Form("line_ladder", 0.02, 2.0, _ladder),
        Form("second_order", 0.02, 1.5, _second_order),
    ),
    "valve_asymmetry": (
        Form("exhaust_orifice", 0.05, 8.0, _exhaust),
        Form("exhaust_laminar", 0.05, 4.0, lambda rng, s: lambda a: (a, s.pressure)),
    ),
    "valve_stiction": (
        Form("spool_friction", 0.005, 0.4, _spool),
        Form("stick_band", 0.005, 0.4, _stick_band),
    ),
    "flow_limit": (
        Form("flow_servo", 0.2, 12.0, lambda rng, s: lambda a: (s.pressure / a, 0.012)),
        Form("flow_choked", 0.2, 12.0, lambda rng, s: lambda a: (s.pressure / a, s.pressure)),
    ),
    "supply_saturation": (
        Form("supply_soft", 0.02, 1.0, _soft_supply),
        Form("supply_tank", 0.02, 1.0, _tank),
    ),
    "leak": (Form("leak_turbulent", 0.01, 0.5, _leak), Form("leak_laminar", 0.01, 0.5, _leak)),
}
