"""The forms of every effect in the generator's own physics.

A form maps an amplitude ``a``, found by bisection, onto the parameters of its C function; everything else about
it is drawn once a case. No formula here is one of the library's simulator.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from focgen.trials.machine import Setting


@dataclass(frozen=True)
class Spans:
    """The nominal swing of each signal in this rig's units; ``atmosphere`` in units of pressure; times in s."""

    command: float
    pressure: float
    drive: float
    curvature: float
    output: float
    atmosphere: float
    session: float


Amplitude = Callable[[float], tuple[float, ...]]


@dataclass(frozen=True)
class Form:
    """``name`` in C; ``low`` and ``high`` bound the amplitude; ``draw`` fixes the rest; ``memory`` what it needs."""

    name: str
    low: float
    high: float
    draw: Callable[[np.random.Generator, Spans], Amplitude]
    memory: Callable[[np.random.Generator], tuple] | None = None


@dataclass(frozen=True)
class Drawn:
    """A form with everything but its amplitude fixed."""

    effect: str
    stage: str
    form: Form
    amplitude: Amplitude
    memory: tuple | None

    def at(self, a: float) -> Setting:
        """The setting of amplitude ``a``."""
        return Setting(self.form.name, tuple(float(x) for x in self.amplitude(a)), self.memory)


def _sign(rng) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _wander(rng) -> list[float]:
    """Five half waves whose slow part dominates."""
    waves = rng.normal(size=5)
    waves[0] = np.sign(waves[0]) * max(abs(waves[0]), 0.6)
    return list(waves)


def _delay(rng, s):
    return lambda a: (a,)


def _ladder(rng, s):
    return lambda a: (a / 6.0,)


def _second_order(rng, s):
    damping = rng.uniform(1.0, 1.6)
    return lambda a: (2.0 * damping / a, damping)


def _exhaust(rng, s):
    way = -1.0 if rng.random() < 0.25 else 1.0
    near = rng.uniform(0.03, 0.1)
    return lambda a: (0.6 / a, s.pressure, near * s.pressure, s.atmosphere, way, 1.5 * s.pressure)


def _spool(rng, s):
    kinetic, lag = rng.uniform(0.4, 0.7), rng.uniform(0.01, 0.03)
    return lambda a: (a * s.command, kinetic * a * s.command, lag)


def _stick_band(rng, s):
    jump = rng.uniform(0.2, 0.8)
    return lambda a: (a * s.command, jump * a * s.command)


def _tank(rng, s):
    drain, refill = rng.uniform(0.05, 0.25), rng.uniform(0.5, 3.0)
    return lambda a: (s.pressure * (1.0 - 0.7 * a), drain, refill)


def _soft_supply(rng, s):
    knee = rng.uniform(0.01, 0.03)
    return lambda a: (s.pressure * (1.0 - 0.7 * a), knee * s.pressure)


def _leak(rng, s):
    lag = rng.uniform(0.03, 0.2)
    return lambda a: (a, lag, s.pressure, s.atmosphere)


def _preisach(rng, s):
    width, level = rng.uniform(1.3, 1.9), rng.uniform(-0.15, 0.3)
    return lambda a: (a, width, level, s.drive)


def _duhem(rng, s):
    steep, power = rng.uniform(4.0, 10.0), rng.uniform(1.2, 1.8)
    return lambda a: (a, s.drive, steep, power)


def _eyring(rng, s):
    tau, stress = rng.uniform(30.0, 90.0), rng.uniform(0.25, 0.5)
    return lambda a: (a, tau, stress * s.drive)


def _roxburgh(rng, s):
    floor, slope = rng.uniform(0.08, 0.2), rng.uniform(0.1, 0.3)
    return lambda a: (a, s.drive, floor, slope)


def _worked(rng, s):
    strokes = rng.uniform(3.0, 12.0)
    return lambda a: (a, s.drive, strokes)


def _warm_gain(rng, s):
    tau, sign = rng.uniform(0.3, 2.0) * s.session, _sign(rng)
    return lambda a: (sign * a, tau)


def _wander_gain(rng, s):
    waves, length = _wander(rng), rng.uniform(1.0, 1.6) * s.session
    return lambda a: (a, length, *waves)


def _viscosity(rng, s):
    blend = rng.uniform(0.01, 0.04)
    return lambda a: (a, blend * s.drive)


def _locking(rng, s):
    sharp = rng.uniform(2.5, 6.0)
    return lambda a: (s.drive / a, sharp)


def _balloon(rng, s):
    middle, width, sign = rng.uniform(0.35, 0.65), rng.uniform(0.15, 0.3), _sign(rng)
    limit = 0.8 * width if sign < 0 else 1.0         # the curve must keep rising
    return lambda a: (sign * min(a, limit), s.drive, middle, width)



def _preload(rng, s):
    bend = rng.uniform(0.2, 0.8)
    return lambda a: (a * s.drive, bend * a * s.drive)


def _hertz(rng, s):
    knee = rng.uniform(0.4, 0.65)
    return lambda a: (a, knee * s.curvature, 0.2 * s.curvature)


def _foam(rng, s):
    knee = rng.uniform(0.4, 0.65)
    return lambda a: (s.curvature / a, knee * s.curvature)


def _oscillator(rng, s):
    natural, damping = 2.0 * np.pi * rng.uniform(0.6, 2.2), rng.uniform(0.04, 0.2)
    return lambda a: (a, natural, damping, s.drive)


def _bend(rng, s):
    sign = _sign(rng)
    return lambda a: (sign * a, s.curvature)


def _divider(rng, s):
    return lambda a: (a, s.curvature)


def _hang(rng, s):
    up, down = rng.uniform(0.06, 0.15), rng.uniform(0.06, 0.15)
    return lambda a: (a, s.curvature, up, down)


def _lens(rng, s):
    way = rng.uniform(0.15, 0.4)
    return lambda a: (a, s.curvature, way)


def _share(rng, s):
    return lambda a: (a,)


def _healing(rng, s):
    tau = rng.uniform(3.0, 15.0)
    return lambda a: (a, tau, s.curvature)


def _depths(rng, s):
    share = rng.uniform(0.65, 0.9)
    return lambda a: (a, share)


def _warm_offset(rng, s):
    tau, sign = rng.uniform(0.3, 1.5) * s.session, _sign(rng)
    return lambda a: (sign * a * s.output, tau)


def _wander_offset(rng, s):
    waves, length = _wander(rng), rng.uniform(1.0, 1.6) * s.session
    return lambda a: (a * s.output, length, *waves)


def _soft_rail(rng, s):
    knee = rng.uniform(0.008, 0.03)
    return lambda a: (s.output * (1.0 - 0.7 * a), knee * s.output)


def _sticky_rail(rng, s):
    lag = rng.uniform(0.05, 0.3)
    return lambda a: (s.output * (1.0 - 0.7 * a), lag)


def _lazy(rng, s):
    lazy = rng.uniform(0.05, 0.3)
    return lambda a: (a * s.output, lazy)


def _uneven(rng, s):
    uneven, phase = rng.uniform(0.03, 0.15), rng.uniform(0, 6.28)
    return lambda a: (a * s.output, uneven, phase)


def _log_memory(rng):
    return ("creep", rng.uniform(4.0, 20.0), 200.0)


def _stretched_memory(rng):
    return ("electrode", rng.uniform(2.0, 8.0), rng.uniform(0.5, 0.8))


# effect -> its stage and its forms
VOCABULARY: dict[str, tuple[str, tuple[Form, ...]]] = {
    "transport_delay": ("regulator", (Form("tube_wave", 0.01, 0.8, _delay), Form("tube_cells", 0.01, 0.8, _delay))),
    "slow_regulator": ("regulator", (Form("line_ladder", 0.02, 2.0, _ladder),
                                     Form("second_order", 0.02, 1.5, _second_order))),
    "valve_asymmetry": ("regulator", (Form("exhaust_orifice", 0.05, 8.0, _exhaust),
                                      Form("exhaust_laminar", 0.05, 4.0, lambda rng, s: lambda a: (a, s.pressure)))),
    "valve_stiction": ("regulator", (Form("spool_friction", 0.005, 0.4, _spool),
                                     Form("stick_band", 0.005, 0.4, _stick_band))),
    "flow_limit": ("regulator", (Form("flow_servo", 0.2, 12.0,
                                      lambda rng, s: lambda a: (s.pressure / a, 0.012)),
                                 Form("flow_choked", 0.2, 12.0, lambda rng, s: lambda a: (s.pressure / a, s.pressure)))),
    "supply_saturation": ("regulator", (Form("supply_soft", 0.02, 1.0, _soft_supply),
                                        Form("supply_tank", 0.02, 1.0, _tank))),
    "leak": ("regulator", (Form("leak_turbulent", 0.01, 0.5, _leak), Form("leak_laminar", 0.01, 0.5, _leak))),
    "hysteresis": ("actuator", (Form("preisach_share", 0.05, 1.0, _preisach), Form("duhem_friction", 0.01, 0.3, _duhem))),
    "creep": ("actuator", (Form("log_creep", 0.02, 1.0, _share, _log_memory), Form("eyring_creep", 0.02, 1.0, _eyring))),
    "unloading_asymmetry": ("actuator", (Form("recovery_viscosity", 0.05, 6.0, _viscosity),
                                         Form("sticky_release", 0.05, 6.0,
                                              lambda rng, s: lambda a: (a, s.curvature)))),
    "softening": ("actuator", (Form("roxburgh", 0.02, 0.8, _roxburgh), Form("worked_soft", 0.02, 0.8, _worked))),
    "gain_nonlinearity": ("actuator", (Form("locking_chain", 0.3, 4.0, _locking), Form("balloon_curve", 0.01, 0.4, _balloon))),
    "dead_zone": ("actuator", (Form("slack_hinge", 0.02, 0.45, lambda rng, s: lambda a: (a * s.drive, 0.02 * s.drive)),
                               Form("preload", 0.02, 0.45, _preload))),
    "contact": ("actuator", (Form("hertz_load", 0.03, 20.0, _hertz), Form("foam_pad", 0.2, 40.0, _foam))),
    "resonance": ("actuator", (Form("duffing_share", 0.05, 1.0, _oscillator), Form("side_mode", 0.05, 1.2, _oscillator))),
    "gain_drift": ("actuator", (Form("warming_gain", 0.01, 1.0, _warm_gain), Form("wandering_gain", 0.005, 0.6, _wander_gain))),
    "sensor_nonlinearity": ("sensor", (Form("exponential_curve", 0.03, 2.5, _bend), Form("divider_curve", 0.03, 4.0, _divider))),
    "sensor_hysteresis": ("sensor", (Form("uneven_hang", 0.01, 0.3, _hang), Form("lens_curves", 0.01, 0.3, _lens))),
    "sensor_relaxation": ("sensor", (Form("stretched_relaxation", 0.03, 1.2, _share, _stretched_memory),
                                     Form("healing_contacts", 0.03, 1.2, _healing))),
    "sensor_lag": ("sensor", (Form("bessel_filter", 0.02, 1.5, _share), Form("two_depths", 0.03, 3.0, _depths))),
    "sensor_drift": ("sensor", (Form("warming_offset", 0.01, 0.6, _warm_offset),
                                Form("wandering_offset", 0.005, 0.4, _wander_offset))),
    "sensor_quantization": ("sensor", (Form("lazy_converter", 0.01, 0.35, _lazy), Form("uneven_converter", 0.01, 0.35, _uneven))),
    "sensor_saturation": ("sensor", (Form("soft_rail", 0.02, 1.0, _soft_rail), Form("sticky_rail", 0.02, 1.0, _sticky_rail))),
}


def _seed(rng) -> float:
    return float(rng.integers(1, 2**31))


def _ripple(rng, s):
    f, seed = rng.uniform(0.4, 2.0), _seed(rng)
    return lambda a: (a * s.pressure, f, seed)


def _seam(rng, s):
    on, off, seed = rng.uniform(2, 6), rng.uniform(6, 20), _seed(rng)
    return lambda a: (a, on, off, seed)


def _swing(rng, s):
    period, phase = rng.uniform(25.0, 60.0), rng.uniform(0, 6.28)
    return lambda a: (a * s.curvature, period, phase)


def _knock(rng, s):
    natural, ring = 2 * np.pi * rng.uniform(1.0, 3.0), rng.uniform(0.4, 1.0)
    return lambda a: (a * s.curvature, 0.03 * a * s.curvature, natural, ring)


def _pick_up(rng, s):
    f, on, off, seed = rng.uniform(0.7, 4.0), rng.uniform(3, 12), rng.uniform(5, 20), _seed(rng)
    return lambda a: (a * s.output, f, on, off, seed)


def _plug(rng, s):
    on, off, seed = rng.uniform(0.3, 1.2), rng.uniform(4.0, 12.0), _seed(rng)
    return lambda a: (a * s.output, on, off, seed)


def _fold(rng, s):
    at = rng.uniform(0.3, 0.5)
    return lambda a: (a * at * s.curvature, 0.03 * s.curvature)


# name -> its stage and its form: nothing that the vocabulary has a name for
OUTSIDE: dict[str, tuple[str, tuple[Form, ...]]] = {
    "supply_ripple": ("regulator", (Form("supply_ripple", 0.005, 0.2, _ripple),)),
    "opening_seam": ("regulator", (Form("opening_seam", 0.01, 0.6, _seam),)),
    "room_swing": ("actuator", (Form("room_swing", 0.01, 0.3, _swing),)),
    "loose_joint": ("actuator", (Form("loose_joint", 0.02, 0.7, _seam),)),
    "knocking_play": ("actuator", (Form("knocking_play", 0.02, 0.8, _knock),)),
    "pick_up": ("sensor", (Form("pick_up", 0.01, 0.5, _pick_up),)),
    "loose_plug": ("sensor", (Form("loose_plug", 0.02, 0.9, _plug),)),
    "folded_reading": ("sensor", (Form("folded_reading", 0.1, 1.0, _fold),)),
}


def draw_form(effect: str, rng: np.random.Generator, spans: Spans) -> Drawn:
    """One of the effect's forms at random, all but its amplitude fixed."""
    stage, forms = (VOCABULARY.get(effect) or OUTSIDE[effect])
    form = forms[rng.integers(len(forms))]
    amplitude = form.draw(rng, spans)
    return Drawn(effect, stage, form, amplitude, form.memory(rng) if form.memory else None)
