"""Plants beside the soft actuator: axes that integrate, lightly damped ones, lags of first and second order.

Every one sits behind a regulator (its drive) and before a sensor. Axes go both ways about where they begin,
so effects that know of one direction only, as pressure does, have no meaning there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import LinearActuator, Rig
from focgen.trials.forms import Form
from focgen.trials.rigs import columns_of, draw_chain, draw_regulator, draw_units
from focgen.trials.vocabulary import VOCABULARY, forms_of

AXIS, MODE, FIRST, SECOND, SOFT = "integrating", "oscillating", "first order", "second order", "fractional"
_SHARES = {AXIS: 0.4, MODE: 0.4, FIRST: 0.08, SECOND: 0.12}
_INSIDE = ("recovery_viscosity", "hertz_load")  # forms in the equation of the fractional actuator
_ON_AXES = (
    *("friction", "transport_delay", "slow_regulator", "flow_limit", "valve_stiction", "gain_drift"),
    *("sensor_lag", "sensor_drift", "sensor_saturation", "sensor_quantization", "sensor_hysteresis"),
    *("sensor_relaxation", "supply_ripple", "pick_up", "loose_plug", "loose_joint"),
)
SINGLES = (*VOCABULARY, *(6 * ("friction",)))
"""The effects that singles have, friction as often as all of a stage's others."""
OUTSIDE = ("supply_ripple", "pick_up", "loose_plug", "loose_joint")
"""What is outside of the vocabulary, on any plant."""


def draw_kind(effects: tuple[str, ...], rng: np.random.Generator) -> str:
    """Which plant a case with these effects has; friction also the fractional actuator."""
    if "friction" in effects and rng.random() < 0.15:
        return SOFT
    fit = {kind: share for kind, share in _SHARES.items() if all(e in effects_on(kind) for e in effects)}
    shares = np.array(list(fit.values()))
    return str(rng.choice(list(fit), p=shares / shares.sum()))


def effects_on(kind: str) -> tuple[str, ...]:
    """The effects that have a meaning on a plant: one that oscillates shows no mode of its own beside it."""
    if kind == AXIS:
        return _ON_AXES
    found = (*VOCABULARY, "friction", *OUTSIDE)
    return tuple(e for e in found if kind != MODE or e != "resonance")


def forms_on(kind: str, effect: str) -> tuple[Form, ...]:
    """The forms of an effect that a plant can have."""
    return tuple(f for f in forms_of(effect) if kind == SOFT or f.name not in _INSIDE)


def draw_plant(rng: np.random.Generator, kind: str, signals: str, sample_time: float) -> tuple[Rig, float]:
    """A true rig around a plant, and the command (its units) that reaches the top of its range, either way
    on an axis."""
    if kind == SOFT:
        return draw_chain(rng, signals, sample_time)
    units = draw_units(rng)
    top, full = rng.uniform(0.15, 0.35) * units.pressure, rng.uniform(0.008, 0.02) * units.curvature
    regulator, gain = draw_regulator(rng, units)
    pole = rng.uniform(8.0, 20.0)
    sensor = TransferFunction([(pole, 0.0)], [(1.0, 1.0), (pole, 0.0)])
    actuator = _axis(rng, top, full) if kind == AXIS else _lag(rng, kind, full / top)
    name, columns = f"plant{rng.integers(1000)}", columns_of(units, signals)
    return Rig(name, sample_time, columns, actuator, regulator, sensor), top / gain


def _axis(rng: np.random.Generator, top: float, full: float) -> LinearActuator:
    """Position from force, g/(T s² + s): at full force by ``full`` in 0.7 to 2 s; the zero of its drive is up
    to 3 % off."""
    speed, time = full / rng.uniform(0.7, 2.0), rng.uniform(0.15, 0.8)
    dynamics = TransferFunction([(float(speed / top), 0.0)], [(time, 2.0), (1.0, 1.0)])
    return LinearActuator(dynamics, bias=float(rng.uniform(-0.03, 0.03) * top))


def _lag(rng: np.random.Generator, kind: str, gain: float) -> LinearActuator:
    if kind == FIRST:
        den = [(rng.uniform(0.3, 1.5), 1.0), (1.0, 0.0)]
        return LinearActuator(TransferFunction([(gain, 0.0)], den))
    light = kind == MODE
    natural = rng.uniform(3.0, 10.0) if light else rng.uniform(2.0, 6.0)
    damping = rng.uniform(0.04, 0.2) if light else rng.uniform(0.7, 1.4)
    den = [(1.0, 2.0), (2.0 * damping * natural, 1.0), (natural**2, 0.0)]
    return LinearActuator(TransferFunction([(gain * natural**2, 0.0)], den))


def given_of(rig: Rig, span: float) -> Rig:
    """The nominal rig of an axis with what it can reach: both ways, ``span`` of its output."""
    if rig.ranges.command is None:
        return rig
    top = rig.ranges.command[1]
    return replace(rig, ranges=replace(rig.ranges, command=(-top, top), pressure=None, output=(-span, span)))
