"""Simulators of 1/(1.32 s^0.6 + 1) at 10 ms: time and error for 10³ … 10⁵ samples."""

import time

import numpy as np
from scipy import fft, signal

from focgen.fractional import Convolution, GrunwaldLetnikov, TransferFunction, step_response
from focgen.fractional.recursion import ExponentialRecursion

MODEL = TransferFunction([(1, 0)], [(1.32, 0.6), (1, 0)])
STEP = 0.01


def best_time(action, budget=1.0) -> float:
    """Return the shortest time of one call in s, repeated within about ``budget`` seconds."""
    times = []
    while not times or (sum(times) < budget and len(times) < 20):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def _plain(u):
    num, den = GrunwaldLetnikov(MODEL, STEP).coefficients(len(u) - 1)
    return signal.lfilter(num, den, u)


def _one_transform(u):
    size = fft.next_fast_len(2 * len(u), real=True)
    return fft.irfft(fft.rfft(u, size), size)[: len(u)]


SIMULATORS = {
    "eq. (10), lfilter": _plain,
    "eq. (10), blocks": lambda u: GrunwaldLetnikov(MODEL, STEP).run(u),
    "eq. (10), exponentials": lambda u: ExponentialRecursion(MODEL, STEP, 1_000_000, 1e-8).run(u),
    "Convolution, held": lambda u: Convolution(MODEL, STEP).run(u),
    "Convolution, linear": lambda u: Convolution(MODEL, STEP, "linear").run(u),
    "(one pair of FFTs)": _one_transform,
}


def run() -> str:
    """Return the table: from nothing to the step response, kernels included."""
    lines = [
        "Simulators of a unit step, kernel included (the exponentials are found once and kept): time,",
        "and ratio to Convolution held; largest error.",
    ]
    counts = "".join(f"{f'N = {n}':>22}" for n in (1000, 10_000, 100_000))
    lines.append(f"{'':24}{counts}{'error':>12}")
    rows = dict.fromkeys(SIMULATORS, "")
    errors = {}
    for count in (1000, 10_000, 100_000):
        u = np.ones(count)
        truth = step_response(MODEL, STEP * np.arange(count))
        times = {name: best_time(lambda f=f, u=u: f(u)) for name, f in SIMULATORS.items()}
        for name, seconds in times.items():
            ratio = seconds / times["Convolution, held"]
            rows[name] += f"{seconds * 1e3:11.2f} ms {ratio:6.1f}x"
        if count == 10_000:
            errors = {name: np.max(np.abs(f(u) - truth)) for name, f in SIMULATORS.items()}
    for name, row in rows.items():
        error = "" if name.startswith("(") else f"{errors[name]:12.1e}"
        lines.append(f"{name:24}{row}{error}")
    return "\n".join(lines)
