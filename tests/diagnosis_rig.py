"""A rig for tests, simulated apart from the library: Grünwald–Letnikov sums over the whole past, Euler steps,
loops.
"""

from itertools import pairwise

import numpy as np

from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Ranges, Rig, Signals

H = 0.05
RIG = Rig(
    "soft finger",
    H,
    Signals("t_s", "y", "u", "p", "k"),
    Actuator(1.3, 0.6, (0.002, 0.34)),
    TransferFunction([(0.1, 0.0)], [(0.12, 1.0), (1.0, 0.0)]),
    TransferFunction([(6.0, 0.0)], [(1.0, 1.0), (6.0, 0.0)]),
    Ranges((0.0, 2.0), (0.0, 0.2), (0.0, 0.02)),
)


def commands():
    """Steps with releases in mixed order, sines, a staircase, a long hold, a triangle with smaller ones."""
    steps = np.repeat([0, 1.2, 0, 0.6, 0, 1.8, 0, 1.0, 0, 1.2, 0], int(8 / H))
    t = np.arange(int(60 / H)) * H
    sines = 0.9 - 0.8 * np.cos(2 * np.pi * t * np.where(t < 40, 0.05, 0.3))
    stairs = np.repeat([0, 0.4, 0.8, 1.2, 1.6, 1.2, 0.8, 0.4, 0], int(6 / H))
    hold = np.repeat([0, 1.4, 0], [int(2 / H), int(60 / H), int(40 / H)])
    corners = [0, 1.8, 0.6, 1.2, 0.8, 1.8, 0]
    triangle = np.concatenate([np.linspace(a, b, int(8 / H)) for a, b in pairwise(corners)])
    return {"steps": steps, "sines": sines, "stairs": stairs, "hold": hold, "triangle": triangle}


def _lag(x, tau_up, tau_down=None, sub=10):
    y, now = np.zeros(len(x)), 0.0
    for k in range(1, len(x)):
        for j in range(sub):
            to = x[k - 1] + (x[k] - x[k - 1]) * (j + 0.5) / sub
            now += H / sub * (to - now) / (tau_up if to > now or tau_down is None else tau_down)
        y[k] = now
    return y


def _fractional(v, T, alpha):
    """T D^alpha y + y = v by the two-point mean of Grünwald–Letnikov sums, all of the past."""
    n = len(v)
    w = np.cumprod(np.r_[1.0, 1 - (alpha + 1) / np.arange(1, n)])
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = (v[k] - T * H**-alpha * (w[1 : k + 1] @ y[k - 1 :: -1][:k])) / (1 + T * H**-alpha)
    return y


def session(
    seed=0,
    noise=0.006,
    T=1.3,
    alpha=0.6,
    gain=(0.002, 0.34),
    delay=0,
    vent=None,
    zone=0.0,
    slip=0.0,
    bend=0.0,
    drift=0.0,
    cap=np.inf,
    camera=1.0,
    roles=("pressure", "curvature"),
    regulator=(1.0, 0.12),
    sensor=(1.0, 1 / 6.0),
):
    """Experiments of a rig with one of these effects: ``delay`` samples, ``vent`` slower s, dead ``zone``,
    ``slip`` (a Maxwell element of dry friction, share), a ``bend`` of the sensor, a ``drift`` of the gain a
    second, a ``cap`` that the pressure's effect nears, bar. ``camera``: how much noisier the curvature is;
    ``regulator``, ``sensor``: the gain, times that of ``RIG``, and the time constant, s.
    """
    rng, logs, start = np.random.default_rng(seed), [], 0.0
    for name, u in commands().items():
        p = _lag(0.1 * regulator[0] * np.r_[np.zeros(delay), u][: len(u)], regulator[1])
        if vent:
            p = _lag(p, 1e-2, vent)
        load = np.maximum(p - zone, 0.0)
        load = load / np.cbrt(1 + (load / cap) ** 3)
        clock = start + H * np.arange(len(u))
        drive = (gain[0] + gain[1] * load) * load * (1 + drift * clock)
        kappa = _fractional(_friction(drive, slip), T, alpha)
        y = sensor[0] * _lag(kappa + bend * kappa**2, sensor[1])
        signals = {"command": u, "pressure": p, "curvature": kappa, "output": y}
        for role, size in (("pressure", 0.18), ("curvature", 0.011 * camera), ("output", 0.011)):
            signals[role] = signals[role] + _noise(rng, len(u)) * noise * size
        logs.append(
            Experiment(
                name, H, {r: s for r, s in signals.items() if r in ("command", "output", *roles)}, start
            )
        )
        start += len(u) * H + 15
    return tuple(logs)


def _friction(v, share):
    """Jenkins elements in parallel: each a spring that slips at its own force."""
    out = v * (1 - share)
    for limit in (2e-4, 6e-4, 1.5e-3):
        z, past, force = 0.0, 0.0, np.zeros(len(v))
        for k in range(len(v)):
            z = min(max(z + v[k] - past, -limit), limit)
            past, force[k] = v[k], z
        out = out + share / 3 * (v - 2.0 * force * (share > 0))
    return out


def _noise(rng, n):
    white, slow = rng.normal(size=n), np.zeros(n)
    for k in range(1, n):
        slow[k] = 0.9 * slow[k - 1] + 0.436 * rng.normal()
    return (white + slow) / np.sqrt(2)
