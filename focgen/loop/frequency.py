"""Frequency responses of the loop: continuous and exact, or sampled with hold, delay and memory as it will
run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import gamma, zeta

from focgen.arrays import Array, Complex
from focgen.control.controller import Controller
from focgen.control.equilibrium import actuator_of
from focgen.control.margins import DELAYED, SMALL, Curve, Margins, curve, margins
from focgen.fractional.delay import Delayed, split_delay
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.loop.linear_effects import Response, linear_part
from focgen.plan.canonical import Table, realise, tables
from focgen.plan.plan import Plan
from focgen.plan.response import designed_response, running_gain, running_response
from focgen.rig.rig import Actuator, Rig

_ALIASES = 40  # pairs of side bands summed one by one
LOW = 1e-5  # of the sampling frequency: where the curves begin
_HIGH = 1e3  # of the same: where the continuous ones end
_LERCH = 0.2  # spacing in ln t: the rule's own error is about exp(−π²/spacing)


def chain_transfer(rig: Rig) -> TransferFunction:
    """Regulator, actuator (its dynamics only) and sensor in series, without their delays."""
    return rig.regulator * actuator_of(rig).dynamics * rig.sensor


def slope_at(rig: Rig, pressure: float) -> float:
    """d(K(p) p)/dp: the gain that small movements about ``pressure`` meet; 1 for a linear actuator."""
    actuator = actuator_of(rig)
    if not isinstance(actuator, Actuator):
        return 1.0
    drive = np.polynomial.Polynomial((0.0, *actuator.gain))
    return float(drive.deriv()(pressure))


def side_bands(sample_time: float, omega: Array) -> Array:
    """The frequencies that sampling brings to ``omega`` (n,), rad/s, (81, n): all but those far beyond."""
    bands = np.arange(-_ALIASES, _ALIASES + 1)[:, None]
    made: Array = np.asarray(omega, dtype=float) + 2.0 * math.pi / sample_time * bands
    return made


def held_response(
    transfer: TransferFunction,
    sample_time: float,
    omega: Array,
    more: Response | None = None,
    delay: float = 0.0,
    known: Array | None = None,
) -> Complex:
    """The response of hold, ``transfer``, a ``delay`` (s) and sampling, at ``omega`` ≤ π/h rad/s: all side
    bands added up.

    The sample is taken before the hold moves on, so what passes at once arrives one sample late. ``more``: a
    factor of the response that is no transfer function, as an effect's; beyond 40 bands it adds nothing.
    ``known``: the transfer function at :func:`side_bands`, where it has been computed.
    """
    h, omega = sample_time, np.asarray(omega, dtype=float)
    whole, part = split_delay(delay, h)
    back = np.exp(-1j * omega * h)
    passing, rest = _split(transfer)
    at_once: Any = passing
    if more is not None:
        at_once = at_once * more(omega)
    if not rest.num:
        passed: Complex = at_once * back ** (whole + 1)
        return passed
    bands = side_bands(h, omega)
    near = rest.frequency_response(bands) if known is None else known - passing
    near = near * (1.0 if more is None else more(bands))
    if part:
        near = near * np.exp(-1j * bands * part * h)
    total = (near / (1j * bands)).sum(axis=0) + (_far_bands(rest, h, omega, part) if more is None else 0.0)
    held = (1.0 - back) * total / h + at_once * back
    made: Complex = held * back**whole if whole else held
    return made


def _split(transfer: TransferFunction) -> tuple[float, TransferFunction]:
    """What passes at once, and the strictly proper rest."""
    if not transfer.num or transfer.num[0].order < transfer.den[0].order:
        return 0.0, transfer
    at_once = transfer.num[0].coefficient / transfer.den[0].coefficient
    lower = [(-at_once * c, o) for c, o in transfer.den[1:]]
    return at_once, TransferFunction([*transfer.num[1:], *lower], transfer.den)


def _far_bands(rest: TransferFunction, h: float, omega: Array, part: float = 0.0) -> Complex:
    """Σ P(jω_n)/(jω_n) over the bands beyond those summed one by one, where P is its leading power, delayed
    by the ``part`` of a sample.
    """
    fall = rest.den[0].order - rest.num[0].order + 1.0
    size = rest.num[0].coefficient / rest.den[0].coefficient * (2.0 * math.pi / h) ** -fall
    place, first = omega * h / (2.0 * math.pi), _ALIASES + 1.0
    if not part:
        whole: Complex = size * (
            1j**-fall * zeta(fall, first + place) + (-1j) ** -fall * zeta(fall, first - place)
        )
        return whole
    turn = np.exp(-2j * math.pi * part)
    above = turn**first * _lerch(turn, fall, first + place)
    below = turn**-first * _lerch(1.0 / turn, fall, first - place)
    made: Complex = size * np.exp(-1j * omega * part * h) * (1j**-fall * above + (-1j) ** -fall * below)
    return made


def _lerch(turn: complex, power: float, first: Array) -> Complex:
    """Lerch's Σ turn^n (n + ``first``)^−``power`` over n ≥ 0, ``first`` (n,) > 1, from its integral over
    t^(power−1) e^(−first t)/(1 − turn e^−t) by the trapezoidal rule in ln t, which converges geometrically
    (DLMF 25.14.5).
    """
    log_t = np.arange(-60.0, 3.0, _LERCH)
    t = np.exp(log_t)
    share = np.exp(power * log_t) / (1.0 - turn * np.exp(-t)) * (_LERCH / gamma(power))
    made: Complex = np.exp(-first[..., None] * t) @ share
    return made


def sampled_response(controller: Controller, omega: Array, length: int | None = None) -> Complex:
    """C(e^jωh) without its gain, in exact arithmetic; memory ``length``, or infinite where None."""
    h, omega = controller.sample_time, np.asarray(omega, dtype=float)
    back = np.exp(-1j * omega * h)
    trapezoid = 0.5 * h * (1.0 + back) / (1.0 - back)
    direct, rest, den = _endless(controller, back) if length is None else _truncated(controller, back, length)
    total = (direct + rest * trapezoid) / den
    made: Complex = total * trapezoid if controller.integrator else total
    return made


def _endless(controller: Controller, back: Complex) -> tuple[Complex, Complex, Complex]:
    difference = (1.0 - back) / controller.sample_time
    form = realise(controller)

    def value(terms: Polynomial) -> Complex:
        return sum((t.coefficient * difference**t.order for t in terms), np.zeros(back.shape, complex))

    return value(form.direct), value(form.rest), value(form.den)


def _truncated(controller: Controller, back: Complex, length: int) -> tuple[Complex, Complex, Complex]:
    parts = tables(controller, length)
    half = 0.5 * controller.sample_time  # inside the table, but in the trapezoid here
    direct, rest = (_summed(table, back) for table in (parts.direct, parts.rest))
    den = np.ones(back.shape, complex) if parts.feedback is None else _summed(parts.feedback, back)
    return direct, rest / half, den


def _summed(table: Table | None, back: Complex) -> Complex:
    """Σ w_j z^−j."""
    total = np.zeros(back.shape, complex)
    for weight in () if table is None else table.weights[::-1]:
        total = total * back + weight
    return total


@dataclass(frozen=True)
class Shapes:
    """Open loops but for the gain: what multiplies controller gain · slope of K(p)p.

    ``ideal``: continuous. ``sampled``: sampled, held, delayed, infinite memory. ``truncated``: that with the
    memory length. ``running``: that with the plan's weights; its gain is the plan's, h/2 inside.
    """

    ideal: Curve
    sampled: Curve
    truncated: Curve
    running: Curve


def shapes(rig: Rig, controller: Controller, plan: Plan, delay: int) -> Shapes:
    """Sample the four loops, from 1e-5 of the sampling frequency up; the rig's delays and its linear effects
    are in them.
    """
    h, chain = controller.sample_time, Delayed(chain_transfer(rig), rig.delays.total)
    effects, _, _ = linear_part(rig)
    low, nyquist = LOW * 2.0 * math.pi / h, math.pi / h
    unit = running_gain(plan, any_schedule(controller))

    def held(omega: Array) -> Complex:
        rig_held = held_response(chain.transfer, h, omega, effects, chain.delay)
        made: Complex = rig_held * np.exp(-1j * omega * h * delay)
        return made

    def ideal(omega: Array) -> Complex:
        part = controller.transfer.frequency_response(omega) * chain.frequency_response(omega)
        part = part if effects is None else part * effects(omega)
        made: Complex = part / (1j * omega) if controller.integrator else part
        return made

    def sampled(length: int | None) -> Curve:
        return curve(lambda omega: sampled_response(controller, omega, length) * held(omega), low, nyquist)

    def running(omega: Array) -> Complex:
        return running_response(plan, omega, any_schedule(controller)) / unit * held(omega)

    return Shapes(
        curve(ideal, low, _HIGH * nyquist, DELAYED if chain.delay else SMALL),
        sampled(None),
        sampled(controller.length),
        curve(running, low, nyquist),
    )


def any_schedule(controller: Controller) -> float | None:
    """A value of the scheduling signal to compare responses at; None where the gain is constant."""
    return controller.schedule.breakpoints[0] if controller.scheduled else None


@dataclass(frozen=True)
class PointMargins:
    """Margins at one operating point of ``pressure``.

    ``frozen``: the ideal loop with K held constant, so that it cancels (the paper's). The others meet the
    slope of K(p)p as small movements do. ``ideal``: continuous; ``sampled``: with sampling, hold and
    computation delay; ``truncated``: with the memory length too; ``running``: with the quantised weights
    and gains too.
    """

    pressure: float
    frozen: Margins
    ideal: Margins
    sampled: Margins
    truncated: Margins
    running: Margins


def margins_at(rig: Rig, controller: Controller, plan: Plan, loops: Shapes, pressure: float) -> PointMargins:
    """Return the margins at ``pressure`` from the prepared ``loops``."""
    gain, slope = float(controller.gain_at(pressure)), slope_at(rig, pressure)
    actuator = actuator_of(rig)
    still = float(actuator.K(pressure)) if isinstance(actuator, Actuator) else 1.0
    run = running_gain(plan, pressure if controller.scheduled else None)
    return PointMargins(
        pressure,
        frozen=margins(loops.ideal.times(gain * still)),
        ideal=margins(loops.ideal.times(gain * slope)),
        sampled=margins(loops.sampled.times(gain * slope)),
        truncated=margins(loops.truncated.times(gain * slope)),
        running=margins(loops.running.times(run * slope)),
    )


__all__ = [
    "LOW",
    "PointMargins",
    "Shapes",
    "any_schedule",
    "chain_transfer",
    "designed_response",
    "held_response",
    "margins_at",
    "sampled_response",
    "shapes",
    "side_bands",
    "slope_at",
]
