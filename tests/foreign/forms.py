"""What may be wrong with a foreign rig, by the family that it belongs to: one form each, of its own.

``MAKE[family](a, s, rng)`` gives the fault of amount ``a``; ``s`` are the sound rig's largest levels by
signal, and its times.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import fftconvolve

from tests.foreign.chain import Fault, lagged


def _static(slot, curve):
    return Fault(slot, lambda x, clock, memory: curve(x))


def _dispersed_delay(a, s, rng):
    """A slug that spreads on its way: what enters comes out over half to one and a half of the delay."""
    count = max(1, round(a / s.h))
    spread = np.ones(count + 1) / (count + 1)
    return _static("supply", lambda x: np.r_[np.zeros(count // 2), np.convolve(x, spread)][: len(x)])


def _two_chambers(a, s, rng):
    return _static("supply", lambda x: lagged(lagged(x, a, s.h), 0.35 * a, s.h))


def _throttled_vent(a, s, rng):
    def rate(to, p, tau):
        vents = 0.5 - 0.5 * np.tanh((to - p) / (0.02 * s.pressure))
        return (to - p) / (tau * (1.0 + a * vents * np.sqrt(0.3 + p / s.pressure)))

    return Fault(rate=rate)


def _sticky_spool(a, s, rng):
    """The spool rests until it is ``a`` off, then goes to within a fifth of that, at a finite speed."""

    def act(x, clock, memory):
        found, place, moves = np.zeros(len(x)), 0.0, False
        for k, to in enumerate(x):
            off = to - place
            moves = abs(off) > a * s.command or (moves and abs(off) > 0.2 * a * s.command)
            place += np.clip(off, -1, 1) * min(abs(off), 8.0 * s.command * s.h) if moves else 0.0
            found[k] = place
        return found

    return Fault("command", act)


def _choked(a, s, rng):
    most = s.pressure / a
    return Fault(rate=lambda to, p, tau: most * np.tanh((to - p) / tau / most))


def _weak_supply(a, s, rng):
    top = s.pressure / a
    return _static("supply", lambda x: x / (1.0 + (np.abs(x) / top) ** 10) ** 0.1)


def _seam(a, s, rng):
    return Fault(rate=lambda to, p, tau: (to - p - a * s.pressure * (max(p, 0.0) / s.pressure) ** 1.25) / tau)


def _jenkins(slot, level):
    def make(a, s, rng):
        limits = getattr(s, level) * np.geomspace(0.01, 0.5, 12)

        def act(x, clock, memory):
            return x + a * (_slipping(x, limits) - x)

        return Fault(slot, act)

    return make


def _slipping(x, limits):
    """The mean of springs that slip at forces ``limits``, over what it were without slipping."""
    force, found, past = np.zeros(len(limits)), np.zeros(len(x)), 0.0
    for k, now in enumerate(x):
        force = np.clip(force + now - past, -limits, limits)
        past, found[k] = now, force.mean()
    return x + found


def _stretched_creep(a, s, rng):
    tau = rng.uniform(8.0, 25.0)

    def act(x, clock, memory):
        t = s.h * np.arange(1, len(x) + 1)
        kernel = np.diff(1.0 - np.exp(-np.sqrt(t / tau)), prepend=0.0)
        return x + a * fftconvolve(x, kernel)[: len(x)]

    return Fault("drive", act)


def _worn(a, s, rng):
    """Stiffer where never loaded so high: by the largest drive so far, and how far below it one is."""

    def act(x, clock, memory):
        most = np.maximum(np.maximum.accumulate(np.abs(x)), memory.get("most", 1e-12))
        memory["most"] = float(most[-1])
        return x * (1.0 + a * (most / s.drive) ** 1.4 * (1.0 - 0.6 * np.abs(x) / most))

    return Fault("drive", act)


def _rational_gain(a, s, rng):
    sign = rng.choice((-1.0, 1.0))
    return _static("drive", lambda x: x * (1.0 + sign * a * (x / s.drive) ** 2 / (0.3 + (x / s.drive) ** 2)))


def _slack(a, s, rng):
    soft, zone = 0.02 * s.pressure, a * s.pressure

    def curve(x):
        return soft * (np.logaddexp(0.0, (x - zone) / soft) - np.logaddexp(0.0, -zone / soft))

    return _static("load", curve)


def _wall(a, s, rng):
    knee, soft = 0.55 * s.curvature, 0.015 * s.curvature
    yields = a / (1.0 + a)
    return _static("response", lambda x: x - yields * soft * np.logaddexp(0.0, (x - knee) / soft))


def _ringing(a, s, rng):
    """A light mode beside the main motion, its damping of the air's kind."""
    natural = 2.0 * np.pi * rng.uniform(0.7, 1.6)

    def act(x, clock, memory):
        place, speed, found, top = 0.0, 0.0, np.zeros(len(x)), s.curvature * natural
        for k, to in enumerate(x):
            drag = 0.08 + 0.3 * abs(speed) / top
            speed += s.h * (natural**2 * (to - place) - 2.0 * drag * natural * speed)
            place += s.h * speed
            found[k] = place
        return x + a * (found - x)

    return Fault("response", act)


def _tiring(a, s, rng):
    power, sign = rng.uniform(0.6, 1.5), rng.choice((-1.0, 1.0))
    return Fault("drive", lambda x, clock, memory: x * (1.0 + sign * a * (clock / s.session) ** power))


def _viscous_release(a, s, rng):
    return Fault(slow=a)


def _bowed(a, s, rng):
    sign = rng.choice((-1.0, 1.0))
    return _static("strain", lambda x: x * (1.0 + sign * a * np.cos(1.6 * x / s.curvature)))


def _relaxing(a, s, rng):
    slow = rng.uniform(8.0, 16.0)
    return _static("strain", lambda x: x - a * (0.6 * lagged(x, 2.5, s.h) + 0.4 * lagged(x, slow, s.h)))


def _filtered(a, s, rng):
    return _static("reading", lambda x: lagged(lagged(x, 0.7 * a, s.h), 0.5 * a, s.h))


def _warming(a, s, rng):
    power, sign = rng.uniform(0.5, 1.6), rng.choice((-1.0, 1.0))
    return Fault("reading", lambda x, clock, memory: x + sign * a * s.output * (clock / s.session) ** power)


def _uneven_steps(a, s, rng):
    step = a * s.output

    def curve(x):
        place = x / step
        return step * (np.floor(place + 0.06 * np.sin(2.1 * np.floor(place))) + 0.5)

    return _static("converter", curve)


def _clipped(a, s, rng):
    top = s.output / a
    return _static("reading", lambda x: top * np.tanh((np.abs(x) / top) ** 4) ** 0.25 * np.sign(x))


MAKE: dict[str, Callable[..., Fault]] = {
    "transport_delay": _dispersed_delay,
    "slow_regulator": _two_chambers,
    "valve_asymmetry": _throttled_vent,
    "valve_stiction": _sticky_spool,
    "flow_limit": _choked,
    "supply_saturation": _weak_supply,
    "leak": _seam,
    "hysteresis": _jenkins("drive", "drive"),
    "creep": _stretched_creep,
    "unloading_asymmetry": _viscous_release,
    "softening": _worn,
    "gain_nonlinearity": _rational_gain,
    "dead_zone": _slack,
    "contact": _wall,
    "resonance": _ringing,
    "gain_drift": _tiring,
    "sensor_nonlinearity": _bowed,
    "sensor_hysteresis": _jenkins("strain", "curvature"),
    "sensor_relaxation": _relaxing,
    "sensor_lag": _filtered,
    "sensor_drift": _warming,
    "sensor_quantization": _uneven_steps,
    "sensor_saturation": _clipped,
}
MOST = {  # amounts beyond which a form is no longer what it stands for; 12 elsewhere
    "hysteresis": 0.9,
    "sensor_hysteresis": 0.5,
    "sensor_relaxation": 0.6,
    "sensor_quantization": 0.1,
    "resonance": 1.0,
    "gain_drift": 0.8,
    "gain_nonlinearity": 0.9,
    "sensor_nonlinearity": 0.6,
}
STAGE = {name: "regulator" if i < 7 else "actuator" if i < 16 else "sensor" for i, name in enumerate(MAKE)}
