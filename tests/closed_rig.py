"""The rig of the other diagnosis tests in a closed loop, simulated apart from the library, step by step."""

import numpy as np

from focgen.logs.experiment import Experiment
from tests.diagnosis_rig import RIG, H, _noise

_N = 2400


def references():
    """Set points in mixed order, a climb in steps, slow sines, as shares of the output's range."""
    t = np.arange(_N) * H
    return {
        "setpoints": np.repeat([0, 0.4, 0.9, 0.2, 0.6, 0.0, 0.8, 0.3], _N // 8),
        "climb": np.repeat([0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.7, 0.4, 0.1, 0.0], _N // 10),
        "sway": 0.45 - 0.4 * np.cos(2 * np.pi * 0.03 * t),
    }


def closed_session(seed=0, noise=0.006, hum=0.0, lock=0.0, slip=0.0, roles=()):
    """A proportional-integral controller leads the rig. ``hum``: of the output's range, picked up by the
    reading at 1.3 Hz; ``lock``: 1/bar, the gain grows as exp(lock p); ``slip``: share of dry friction."""
    rng, logs, start = np.random.default_rng(seed), [], 0.0
    for name, shares in references().items():
        signals = _run(0.009 * shares, rng, noise, hum, lock, slip)
        kept = {r: v for r, v in signals.items() if r in ("reference", "command", "output", *roles)}
        logs.append(Experiment(name, H, kept, start))
        start += _N * H + 15
    return tuple(logs)


def _run(reference, rng, noise, hum, lock, slip):
    n, a = len(reference), RIG.actuator
    w = np.cumprod(np.r_[1.0, 1 - (a.alpha + 1) / np.arange(1, n)])
    stiff = a.T * H**-a.alpha
    u, p, kappa, y = (np.zeros(n) for _ in range(4))
    errors = {role: _noise(rng, n) * noise * size for role, size in (("p", 0.18), ("k", 0.011), ("y", 0.011))}
    errors["y"] += hum * 0.011 * np.sin(2 * np.pi * 1.3 * H * np.arange(n))
    total, stretch, force = 0.0, 0.0, 0.0
    for k in range(n):
        if k:
            p[k] = p[k - 1] + (0.1 * u[k - 1] - p[k - 1]) * -np.expm1(-H / 0.12)
            v = (a.gain[0] + a.gain[1] * p[k]) * p[k] * np.exp(lock * p[k])
            force, stretch = float(np.clip(force + v - stretch, -1e-3, 1e-3)), v
            v += -2 * slip * force
            kappa[k] = (v - stiff * (w[1 : k + 1] @ kappa[k - 1 :: -1][:k])) / (1 + stiff)
            y[k] = y[k - 1] + (kappa[k] - y[k - 1]) * -np.expm1(-H * 6.0)
        error = reference[k] - y[k] - errors["y"][k]
        total = min(max(total + 60.0 * H * error, 0.0), 2.0)
        u[k] = min(max(total + 40.0 * error, 0.0), 2.0)
    read = {"pressure": p + errors["p"], "curvature": kappa + errors["k"], "output": y + errors["y"]}
    return {"reference": reference, "command": u, **read}
