"""Training records that a benchmark publishes as equations, integrated by other means than the project's."""

from __future__ import annotations

import numpy as np
from scipy.signal import decimate

RATE, FINER = 750.0, 20  # Hz, and how many steps of the integration are a sample
SAMPLES, SETTLED = 8192, 1500
BAND, FORCE = (5.0, 150.0), 50.0  # Hz, N rms
NOISE = 8e-6  # m, of the benchmark's own estimation data
M, C, K, ALPHA, BETA, GAMMA, DELTA = 2.0, 10.0, 5e4, 5e4, 1e3, 0.8, -1.1


def bouc_wen(seed: int = 1, samples: int = SAMPLES) -> dict[str, np.ndarray]:
    """A record of the hysteretic benchmark (J.-P. Noël and M. Schoukens, 2016) by its columns: a random
    multisine from rest, integrated at 15 kHz, with noise."""
    rng = np.random.default_rng(seed)
    bins = np.arange(1, samples // 2)
    spectrum = np.zeros(samples * FINER // 2 + 1, complex)
    inside = bins[(bins * RATE / samples >= BAND[0]) & (bins * RATE / samples <= BAND[1])]
    spectrum[inside] = np.exp(2j * np.pi * rng.random(len(inside)))
    force = np.fft.irfft(spectrum)
    force *= FORCE / force.std()
    fine = _integrated(np.r_[force, force[:FINER]])[: len(force)]
    y = decimate(decimate(fine, 4, ftype="fir"), 5, ftype="fir")
    f = force[::FINER]
    return {"t_s": np.arange(samples) / RATE, "f_N": f, "y_m": y + NOISE * rng.standard_normal(samples)}


def _integrated(force: np.ndarray) -> np.ndarray:
    """Runge and Kutta's rule of fourth order, the force linear within a step."""
    h, state, found = 1.0 / (RATE * FINER), (0.0, 0.0, 0.0), np.zeros(len(force))
    for k in range(len(force) - 1):
        found[k] = state[0]
        now, then = float(force[k]), float(force[k + 1])
        a = _slope(state, now)
        b = _slope(_moved(state, a, 0.5 * h), 0.5 * (now + then))
        c = _slope(_moved(state, b, 0.5 * h), 0.5 * (now + then))
        d = _slope(_moved(state, c, h), then)
        state = tuple(s + h / 6.0 * (p + 2 * q + 2 * r + t) for s, p, q, r, t in zip(state, a, b, c, d))
    found[-1] = state[0]
    return found


def _moved(state, slope, step: float):
    return tuple(s + step * v for s, v in zip(state, slope))


def _slope(state, force: float):
    y, v, z = state
    return v, (force - K * y - C * v - z) / M, ALPHA * v - BETA * (GAMMA * abs(v) * z + DELTA * v * abs(z))
