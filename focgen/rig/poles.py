"""The poles of a fractional transfer function, and the share that each has in its response."""

from __future__ import annotations

import numpy as np

from focgen.fractional.transfer import TransferFunction


def residue_at(transfer: TransferFunction, pole: complex) -> complex:
    """Of a simple pole."""
    num = sum(t.coefficient * pole**t.order for t in transfer.num)
    slope = sum(t.coefficient * t.order * pole ** (t.order - 1) for t in transfer.den if t.order)
    return num / slope


def fractional_poles(transfer: TransferFunction, low: float, high: float) -> list[complex]:
    """Zeros of the denominator on the principal sheet, upper half plane and negative-free axis, by Newton's
    rule from places between ``low`` and ``high`` rad/s."""
    radius, angle = np.meshgrid(np.geomspace(low, high, 60), np.linspace(0.0, 0.999 * np.pi, 24))
    s = (radius * np.exp(1j * angle)).ravel()
    with np.errstate(all="ignore"):
        for _ in range(60):
            value = sum(t.coefficient * s**t.order for t in transfer.den)
            slope = sum(t.coefficient * t.order * s ** (t.order - 1) for t in transfer.den if t.order)
            step = value / slope
            step = step * np.minimum(1.0, 0.5 * np.abs(s) / np.maximum(np.abs(step), 1e-300))
            s = s - step
        size = sum(abs(t.coefficient) * np.abs(s) ** t.order for t in transfer.den)
        good = np.isfinite(s) & (np.abs(value) < 1e-9 * size) & (np.abs(np.angle(s)) < np.pi * (1 - 1e-6))
    found: list[complex] = []
    for p in s[good]:
        p = complex(p.real, abs(p.imag)) if abs(p.imag) > 1e-9 * abs(p) else complex(p.real, 0.0)
        if all(abs(p - q) > 1e-6 * abs(p) for q in found):
            found.append(p)
    return found
