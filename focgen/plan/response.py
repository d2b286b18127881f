"""Frequency response of a controller: as designed, and as it will run."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Complex
from focgen.control.controller import Controller
from focgen.plan.plan import Bank, Plan, Sum
from focgen.plan.scenario import nearest_raw
from focgen.plan.values import scheduled_gain
from focgen.present import present


def designed_response(
    controller: Controller, omega: ArrayLike, schedule_value: float | None = None
) -> Complex:
    """C(jω) from error to output, continuous and exact; ``omega`` > 0 in rad/s, any shape."""
    omega = np.asarray(omega, dtype=float)
    response = controller.transfer.frequency_response(omega) * controller.gain_at(schedule_value)
    made: Complex = response / (1j * omega) if controller.integrator else response
    return made


def running_response(plan: Plan, omega: ArrayLike, schedule_value: float | None = None) -> Complex:
    """C(e^jωh) from error to output as the plan runs it: sampled, truncated, with its quantised weights and
    gain.

    ``omega`` in rad/s, up to π/h, any shape; ``schedule_value`` in physical units, needed where the gain is
    scheduled. Physical units. Neither sample and hold nor computation delay is in it, nor rounding of
    signals, nor clamps.
    """
    total = filtered_response(plan, omega) * running_gain(plan, schedule_value)
    return total * _trapezoid(_back(plan, omega)) if plan.integrator else total


def filtered_response(plan: Plan, omega: ArrayLike) -> Complex:
    """From the error to the filtered error v alone, likewise: the transfer function as the plan runs it."""
    back = _back(plan, omega)
    total = np.zeros(back.shape, complex)
    if plan.direct:
        total = total + _response(plan.direct, back)
    if plan.inner:
        total = total + _response(plan.inner.rest, back) * _trapezoid(back)
    if plan.feedback:
        total = total / (1.0 + _response(plan.feedback.table, back))
    return total


def _back(plan: Plan, omega: ArrayLike) -> Complex:
    """z⁻¹."""
    return np.exp(-1j * np.asarray(omega, dtype=float) * plan.sample_time)


def _trapezoid(back: Complex) -> Complex:
    return (1.0 + back) / (1.0 - back)


def running_gain(plan: Plan, schedule_value: float | None = None) -> float:
    """g at a value of the scheduling signal (physical), with h/2 inside where an integrator follows."""
    if plan.schedule is None:
        return plan.constant_gain * plan.gain.lsb
    count = nearest_raw(present(schedule_value), plan.schedule.signal)
    return float(scheduled_gain(plan, np.asarray(count))) * plan.gain.lsb


def _response(table: Sum, back: Complex) -> Complex:
    """Σ w_j z^−j by Horner's rule from the oldest weight on."""
    total = np.zeros(back.shape, complex)
    for weight in reversed(table.values):
        total = total * back + weight
    return total * back**table.first + sum(_bank_response(bank, back) for bank in table.banks)


def _bank_response(bank: Bank, back: Complex) -> Complex:
    """Σ c_i z^−1 ∇^m / (1 − p_i z^−1)."""
    modes = sum(c / (1.0 - (1.0 - q) * back) for c, q in zip(bank.values, bank.real_rates))
    return modes * back * (1.0 - back) ** bank.differences
