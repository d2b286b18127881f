"""Memory forms of D^α: error against multiplies and words, beside fracmem (PyPI) and short memory.

Errors are the largest of a unit step, a ramp, a sine of 0.2 Hz at 10 ms and white noise, each relative to the
largest output, against the full Grünwald–Letnikov sum. fracmem: L exact taps and p modes with two
multiplications each, its ``from_analytic`` designed for the horizon; its own count is not used.
"""

import numpy as np
from scipy.signal import fftconvolve

from focgen.fractional.exponential import fit_states
from focgen.fractional.weights import gl_weights

STEP = 0.01
HORIZON = 10_000
INPUTS = ("step", "ramp", "sine", "noise")
RIVALS = [(4, 12), (4, 20), (8, 16), (16, 16), (16, 24), (32, 16), (32, 24), (64, 32)]
ORDERS = [0.1, 0.3, 0.5, 0.6, 0.7, 0.9]


def inputs(horizon: int) -> dict[str, np.ndarray]:
    """The four inputs, samples 0 … horizon."""
    k = np.arange(horizon + 1)
    noise = np.random.default_rng(2024).standard_normal(len(k))
    sine = np.sin(2 * np.pi * 0.2 * STEP * k)
    return {"step": np.ones(len(k)), "ramp": k * STEP, "sine": sine, "noise": noise}


def exact_output(order: float, x: np.ndarray) -> np.ndarray:
    """Full memory at unit sample time, by the differences of x, so that nothing cancels."""
    v = np.diff(x, prepend=0.0)
    moving = np.flatnonzero(v)
    weights = gl_weights(order - 1.0, len(x) - 1)
    if len(moving) == 1:
        return np.concatenate([np.zeros(moving[0]), v[moving[0]] * weights])[: len(x)]
    if np.ptp(v[1:]) == 0.0:
        return v[1] * np.concatenate([[0.0], np.cumsum(weights[:-1])])
    return fftconvolve(v, weights)[: len(x)]


def errors(order: float, horizon: int, operator) -> dict[str, float]:
    """The largest error of ``operator`` (unit sample time), relative to the largest output, by input."""
    found = {}
    for name, x in inputs(horizon).items():
        exact = exact_output(order, x)
        found[name] = float(np.max(np.abs(operator(x) - exact)) / np.max(np.abs(exact)))
    return found


def _short(order: float, taps: int):
    weights = gl_weights(order, taps - 1)
    return lambda x: fftconvolve(x, weights)[: len(x)]


def _rival(order: float, horizon: int, taps: int, modes: int):
    from fracmem import CompressedFractionalFilter

    made = CompressedFractionalFilter.from_analytic(order, STEP, taps, modes, j_max=horizon)
    return lambda x: made.predict(x) * STEP**order


def _row(name: str, multiplies: int, words: int, found: dict[str, float], remark: str = "") -> str:
    cells = "".join(f"{found[key]:>10.1e}" for key in INPUTS)
    return f"  {name:<22}{multiplies:>6}{words:>7}{cells}  {remark}".rstrip()


def _cheapest(order: float, horizon: int, good_enough):
    """The fewest states whose errors are good enough."""
    for states in range(1, 40):
        memory = fit_states(order, horizon, states)
        found = errors(order, horizon, memory.run)
        if good_enough(found):
            return memory, found
    raise AssertionError("no memory is as good")


def _against_rival() -> list[str]:
    try:
        import fracmem  # noqa: F401
    except ImportError:
        return ["fracmem is not installed: pip install 'focgen[bench]'"]
    lines = [
        f"Beside fracmem, order 0.6, horizon {HORIZON}: the fewest states whose largest error of the",
        "four is no larger, then the fewest that are as good with each input by itself.",
        _head(),
    ]
    ratios: dict[str, list[float]] = {"largest": [], "each": []}
    for taps, modes in RIVALS:
        goal = errors(0.6, HORIZON, _rival(0.6, HORIZON, taps, modes))
        cost = taps + 2 * modes
        lines.append(_row(f"fracmem L{taps} p{modes}", cost, taps + modes, goal))
        for good_enough, what in (
            (lambda found, goal=goal: max(found.values()) <= max(goal.values()), "largest"),
            (lambda found, goal=goal: all(found[key] <= goal[key] for key in goal), "each"),
        ):
            memory, found = _cheapest(0.6, HORIZON, good_enough)
            ratios[what].append(cost / memory.multiplies)
            ratio = f"{cost / memory.multiplies:.1f} times fewer multiplies ({what})"
            name = f"  exponential n{memory.states}"
            lines.append(_row(name, memory.multiplies, memory.words, found, ratio))
    spans = {what: f"{min(found):.1f} to {max(found):.1f}" for what, found in ratios.items()}
    return [
        *lines,
        f"  {spans['largest']} times fewer multiplies where the largest of the four errors is no larger,",
        f"  {spans['each']} where each of them is no larger.",
    ]


def _head() -> str:
    return f"  {'':<22}{'mult':>6}{'words':>7}" + "".join(f"{key:>10}" for key in INPUTS)


def _by_order(horizon: int, states: int, orders: list[float]) -> list[str]:
    lines = [f"By order, horizon {horizon}, {states} states.", _head()]
    for order in orders:
        memory = fit_states(order, horizon, states)
        found = errors(order, horizon, memory.run)
        remark = f"certified kernel {memory.certificate.kernel:.1e}"
        lines.append(_row(f"order {order}", memory.multiplies, memory.words, found, remark))
    return lines


def _short_memory() -> list[str]:
    lines = [f"Short memory, order 0.6, horizon {HORIZON}.", _head()]
    for taps in (100, 1000, 8361):
        lines.append(_row(f"L = {taps}", taps, taps, errors(0.6, HORIZON, _short(0.6, taps))))
    return lines


def run() -> str:
    """Return the tables."""
    parts = [["Memory of D^α: multiplies, words of state, error relative to the largest output."]]
    parts += [_against_rival(), _by_order(HORIZON, 10, ORDERS)]
    parts += [_by_order(10**6, 20, [0.1, 0.6, 0.9]), _short_memory()]
    return "\n".join(line for part in parts for line in part)
