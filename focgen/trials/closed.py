"""Closed-loop cases: a fractional controller of the generator's own drives the rig, with or without a fault
of its own.

The controller in the case folder is the ideal one: transfer function by Grünwald–Letnikov on its stated
length, gain schedule, trapezoidal integrator. What ran may have had a shorter memory, fixed-point arithmetic,
a late or lost sample, or an actuator that could not follow. Reference and measurement are logged as the
controller saw them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.arrays import Array, Bytes, Numbers
from focgen.control.controller import Controller, ControllerRanges, GainSchedule
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import Actuator, Rig
from focgen.trials.forms import Spans
from focgen.trials.machine import Session, Trace
from focgen.trials.recording import Recorder, coloured, quantised

# severity -> memory length; bits; jitter / Ts; share lost; share of the used output that is left
_SHORT = {"low": 500, "mid": 150, "high": 40}
_BITS = {"low": 14, "mid": 12, "high": 10}
_JITTER = {"low": 0.06, "mid": 0.12, "high": 0.22}
_LOST = {"low": 0.005, "mid": 0.02, "high": 0.06}
_LEFT = {"low": 0.94, "mid": 0.85, "high": 0.7}
CONTROLLER_EFFECTS = ("short_memory", "fixed_point", "sample_jitter", "missed_samples", "output_saturation")

Played = tuple[Trace, Bytes, Array, Array, Array]
"""The trace on the fine grid, flags, the output's noise, and the output and pressure that were seen."""


@dataclass(frozen=True)
class Fault:
    """What is wrong with the running controller: its ``effect`` (or None), ``form`` and parameters."""

    effect: str | None = None
    form: str = ""
    length: int | None = None
    bits: int = 0
    jitter: float = 0.0
    lost: float = 0.0
    burst: float = 1.0
    limit: float | None = None
    told: bool = False


def draw_controller(rig: Rig, spans: Spans, rng: np.random.Generator) -> Controller:
    """The paper's controller for this rig; its gain is scheduled where the pressure is logged."""
    actuator = rig.actuator
    if not isinstance(actuator, Actuator):
        raise TypeError("the paper's controller is of a fractional actuator")
    speed, dc = rng.uniform(0.5, 0.9), float(rig.regulator.dc_gain)
    points = tuple(np.linspace(0.0, spans.pressure, 6)) if rig.signals.pressure else None
    slope = [
        sum((i + 1) * g * p**i for i, g in enumerate(actuator.gain))
        for p in points or (0.7 * spans.pressure,)
    ]
    gains = tuple(float(speed / (k * dc)) for k in slope)
    reach = (0.0, 1.3 * spans.output)
    return Controller(
        name="loop",
        sample_time=rig.sample_time,
        integrator=True,
        length=4000,
        arithmetic="f64",
        transfer=TransferFunction([(actuator.T, actuator.alpha), (1.0, 0.0)]),
        gain=GainSchedule(points, gains) if points else gains[0],
        ranges=ControllerRanges(
            reach, reach, (0.0, 1.3 * spans.command), (0.0, 1.3 * spans.pressure) if points else None
        ),
    )


def draw_unknown(rig: Rig, spans: Spans, rng: np.random.Generator) -> Controller:
    """A controller of somebody else's: PI or PID, sluggish to lively, the same at every level."""
    actuator = rig.actuator
    if not isinstance(actuator, Actuator):
        raise TypeError("a lag is of a fractional actuator")
    lag = actuator.T ** (1.0 / actuator.alpha) * rng.uniform(0.3, 1.0)
    gain = float(rng.uniform(0.3, 1.5)) * spans.command / spans.output / lag
    num = [(lag, 1.0), (1.0, 0.0)] + (
        [(0.25 * lag * rng.uniform(0.03, 0.1), 2.0)] if rng.random() < 0.3 else []
    )
    reach = (0.0, 1.3 * spans.output)
    return Controller(
        name="theirs",
        sample_time=rig.sample_time,
        integrator=True,
        length=2,
        arithmetic="f64",
        transfer=TransferFunction(num),
        gain=gain,
        ranges=ControllerRanges(reach, reach, (0.0, 1.3 * spans.command), None),
    )


def draw_fault(effect: str | None, severity: str, used: float, rng: np.random.Generator) -> Fault:
    """A controller fault of one of two forms; ``used`` is the largest output of the faultless loop."""
    first = bool(rng.random() < 0.5)
    if effect == "short_memory":
        return Fault(effect, "truncated", length=_SHORT[severity])
    if effect == "fixed_point":
        return Fault(effect, "coarse words", bits=_BITS[severity])
    if effect == "sample_jitter":
        return Fault(effect, "gaussian" if first else "late", jitter=_JITTER[severity])
    if effect == "missed_samples":
        return Fault(
            effect, "single" if first else "bursts", lost=_LOST[severity], burst=1.0 if first else 5.0
        )
    if effect == "output_saturation":
        return Fault(effect, "told" if first else "wound up", limit=_LEFT[severity] * used, told=first)
    return Fault()


def ticks(count: int, every: int, fault: Fault, rng: np.random.Generator) -> Bytes:
    """When the controller runs, as flags on the fine grid (count,): every ``every`` steps, late or lost now
    and then.
    """
    due = np.arange(0, count, every)
    if fault.jitter:
        spread = fault.jitter * every
        late = rng.normal(0.0, spread, len(due)) if fault.form == "gaussian" else _late(len(due), spread, rng)
        due[1:] += np.clip(np.round(late[1:]), -every // 2 + 1, every // 2 - 1).astype(int)
    if fault.lost:
        due = due[_kept(len(due), fault, rng)]
    flags = np.zeros(count, np.uint8)
    flags[due[due < count]] = 1
    return flags


def _late(count: int, spread: float, rng: np.random.Generator) -> Array:
    """Interrupts delay one sample in five, none is early."""
    return np.where(rng.random(count) < 0.2, rng.exponential(2.3 * spread, count), 0.0)


def _kept(count: int, fault: Fault, rng: np.random.Generator) -> Array:
    kept = np.ones(count, bool)
    for start in np.flatnonzero(rng.random(count) < fault.lost / fault.burst):
        kept[max(start, 1) : start + rng.geometric(1.0 / fault.burst)] = False
    kept[0] = True
    return kept


class Loop:
    """A controller, ideal or with a fault, as the C knows it."""

    def __init__(self, session: Session, controller: Controller, fault: Fault, spans: Spans) -> None:
        self.session, self.controller, self.fault, self.spans = session, controller, fault, spans

    def fresh(self, ideal: bool = False) -> tuple[Any, tuple[Array, Array]]:
        """A controller at rest; returns it with the arrays that it points to."""
        fault = Fault() if ideal else self.fault
        c, k = self.controller, self.session.ffi.new("controller *")
        length = fault.length or c.length
        weights, errors = gl_weights(c.transfer, length, c.sample_time), np.zeros(length + 1)
        k.length, k.Ts, (k.low, k.high) = length, c.sample_time, c.ranges.output
        k.applied_low, k.applied_high = k.low, fault.limit or k.high
        k.told = int(fault.told)
        points, gains = c.schedule.breakpoints if c.scheduled else (0.0,), c.gains
        k.points = len(points)
        k.breakpoint[0 : len(points)], k.gain[0 : len(points)] = list(points), list(gains)
        if fault.bits:
            k.coefficient_lsb = np.abs(weights).max() * 2.0**-fault.bits
            k.signal_lsb = 1.3 * self.spans.output * 2.0**-fault.bits
            k.output_lsb = 1.3 * self.spans.command * 2.0**-fault.bits
        k.weights, k.errors = self.session.pointer(weights), self.session.pointer(errors)
        return k, (weights, errors)

    def run(
        self, reference: Array, every: int, clock: float, recorder: Recorder, rng: np.random.Generator
    ) -> Played:
        """One experiment: the trace on the fine grid, the flags, the output's noise, and what the controller
        saw of output and pressure, all (n,)."""
        count, session = len(reference), self.session
        flags = ticks(count, every, self.fault, rng)
        noise = [
            _at(flags, coloured(rng, int(flags.sum()), recorder.noise.get(n, 0.0)))
            for n in ("output", "pressure")
        ]
        k, _held = self.fresh()
        out = [np.zeros(count) for _ in range(6)]
        arrays: tuple[Numbers, ...] = (reference, flags, *noise, *out)
        ports = [session.pointer(a) for a in arrays]
        session.blocks(
            count, clock, lambda first, stop: session.lib.close_loop(session.chain, k, first, stop, *ports)
        )
        u, p, z, y, seen_y, seen_p = out
        return Trace(session.h, clock, u, p, z, y), flags, noise[0], seen_y, seen_p

    def ideal_output(self, error: Array, pressure: Array) -> Array:
        """What the ideal controller gives for what was seen, sample by sample."""
        k, _held = self.fresh(ideal=True)
        error, pressure = (np.ascontiguousarray(a, float) for a in (error, pressure))
        u = np.zeros(len(error))
        ports = [self.session.pointer(a) for a in (error, pressure, u)]
        self.session.lib.run_controller(k, *ports, len(error))
        return u


def gl_weights(transfer: TransferFunction, length: int, Ts: float) -> Array:
    """Weights (length + 1,) of the past samples for a transfer function without a denominator."""
    total = np.zeros(length + 1)
    for term in transfer.num:
        weight = np.ones(length + 1)
        for j in range(1, length + 1):
            weight[j] = weight[j - 1] * (j - 1 - term.order) / j
        total += term.coefficient * Ts**-term.order * weight
    return total


def _at(flags: Bytes, values: Array) -> Array:
    spread = np.zeros(len(flags))
    spread[flags == 1] = values
    return spread


def logged(
    trace: Trace,
    flags: Bytes,
    noise_y: Array,
    seen_y: Array,
    seen_p: Array,
    reference: Array,
    recorder: Recorder,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """The log of one closed-loop experiment by role: one row for each sample that the controller took."""
    at = np.flatnonzero(flags)
    curvature = trace.curvature[at] + coloured(rng, len(at), recorder.noise["curvature"])
    return {
        "time": at * trace.h + (trace.clock if recorder.absolute else 0.0),
        "command": trace.command[at],
        "reference": reference[at],
        "pressure": seen_p[at],
        "curvature": quantised(curvature, recorder.lsb["curvature"]),
        "output": seen_y[at],
        "noise": noise_y[at],
    }
