"""The exponential memory by itself in float64, where no plan carries it."""

from __future__ import annotations

import math

import numpy as np

from focgen.control.controller import Controller
from focgen.fractional.exponential import ExponentialMemory, fit_exponential
from focgen.studies.model import INPUTS, Curves, Row, Setup, Variant
from focgen.studies.operator import fractional_terms
from focgen.studies.signals import exact_power, inputs, relative_errors


def unplanned_row(setup: Setup, variant: Variant, controller: Controller, note: str) -> tuple[Row, Curves]:
    """What is known without a plan: the operator alone."""
    given = inputs(controller, setup.controller.sample_time, setup.samples)
    h = variant.sample_time
    found, bounds, memories = [], [], []
    for term in fractional_terms(controller):
        memory: ExponentialMemory = fit_exponential(term.order, variant.horizon, variant.tolerance)
        exact = exact_power(term.order, h, given.error)
        made = np.array([memory.run(row) for row in given.error]) * h**-term.order
        found.append(relative_errors(made, exact))
        largest = memory.certificate.output_error(given.amplitude) * h**-term.order
        bounds.append(max(_bounds(memory, largest, np.abs(exact).max(axis=1), len(given.error[0]))))
        memories.append(memory)
    errors = {name: max(one[name] for one in found) for name in INPUTS}
    bound = float(max(bounds))
    row = Row(
        **{
            k: getattr(variant, k)
            for k in ("memory", "arithmetic", "sample_time", "length", "tolerance", "horizon")
        },
        states=sum(m.states for m in memories),
        error=max(errors.values()),
        errors=errors,
        bound=bound if math.isfinite(bound) else None,
        dc_bias=0.0,
        operator_bias=0.0,
        multiplies=sum(m.multiplies + 1 for m in memories),
        ram_bytes=8 * sum(m.words for m in memories),
        note=note,
    )
    return row, Curves()


def _bounds(memory: ExponentialMemory, largest: float, sizes: np.ndarray, samples: int) -> list[float]:
    """What each input's error cannot exceed; step and ramp only rise, so the kernel's error is theirs."""
    bounds = [largest / size for size in sizes]
    if memory.differences == 1 and samples <= memory.horizon:
        kernel = memory.certificate.kernel
        bounds = [min(b, kernel) if name in ("step", "ramp") else b for name, b in zip(INPUTS, bounds)]
    return bounds
