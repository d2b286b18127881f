"""Phase and magnitude errors over the band that matters to the loop."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Complex
from focgen.control.controller import Controller
from focgen.control.equilibrium import derived_ranges, holding
from focgen.loop.frequency import any_schedule, sampled_response
from focgen.loop.frozen import frozen_loop, frozen_margins
from focgen.plan.plan import Plan
from focgen.plan.response import designed_response, running_gain, running_response
from focgen.rig.rig import Rig
from focgen.studies.results import Band

PHASE = 2.0  # degrees
_BELOW, _ABOVE = 10.0, 10.0  # how far the band reaches beyond the slowest and the fastest crossover
_POINTS = 241
_WITHOUT = (1e-3, 0.1)  # of the Nyquist frequency, where no rig tells the band


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Errors at ``omega`` (rad/s, inside the band), phase in degrees and magnitude in dB; all (points,)."""

    omega: Array
    phase_deg: Array
    magnitude_db: Array

    @property
    def good_from(self) -> float | None:
        """From here to the band's end the phase error stays within 2°; None where not even there, rad/s."""
        bad = np.flatnonzero(np.abs(self.phase_deg) > PHASE)
        if not len(bad):
            return float(self.omega[0])
        return float(self.omega[bad[-1] + 1]) if bad[-1] + 1 < len(self.omega) else None


def band_of(controller: Controller, rig: Rig | None, setpoints: tuple[float, ...]) -> Band:
    """From a tenth of the slowest crossover of the loop to ten times its fastest, at most Nyquist.

    The crossovers are those of the frozen loops at the set points: below the slowest the loop's own
    correction takes over, above the fastest it no longer acts.
    """
    nyquist = math.pi / controller.sample_time
    found = [] if rig is None else _crossovers(controller, rig, setpoints)
    if not found:
        low, high = (share * nyquist for share in _WITHOUT)
        return Band(low, high, "three decades up to a tenth of the Nyquist frequency, no loop being known")
    low, high = min(found), max(found)
    why = f"a tenth of the slowest crossover ({low:.3g} rad/s) to ten times the fastest ({high:.3g} rad/s)"
    return Band(low / _BELOW, min(high * _ABOVE, 0.9 * nyquist), why, low, high)


def _crossovers(controller: Controller, rig: Rig, setpoints: tuple[float, ...]) -> list[float]:
    ranges, _ = derived_ranges(rig)
    pressures = dict.fromkeys(holding(rig, y, ranges).pressure for y in setpoints)
    margins = [frozen_margins(frozen_loop(rig, controller, p), controller.sample_time) for p in pressures]
    return [m.crossover_rad_s for m in margins if math.isfinite(m.crossover_rad_s)]


def omegas(band: Band, sample_time: float) -> Array:
    """The frequencies that are looked at, up to Nyquist, rad/s, shape (points,)."""
    return np.geomspace(band.low, min(band.high, 0.999 * math.pi / sample_time), _POINTS)


def memory_spectrum(controller: Controller, plan: Plan, band: Band) -> Spectrum:
    """The plan's response against infinite memory at the same sample time."""
    omega, at = omegas(band, controller.sample_time), any_schedule(controller)
    running = running_response(plan, omega, at) / running_gain(plan, at)
    exact = sampled_response(controller, omega)
    half = 0.5 * controller.sample_time if controller.integrator else 1.0
    return _errors(omega, running * half / exact)


def sampling_spectrum(controller: Controller, band: Band) -> Spectrum:
    """Infinite memory at the sample time against the continuous controller."""
    omega, at = omegas(band, controller.sample_time), any_schedule(controller)
    exact = designed_response(controller, omega, at) / controller.gain_at(at)
    return _errors(omega, sampled_response(controller, omega) / exact)


def _errors(omega: Array, ratio: Complex) -> Spectrum:
    return Spectrum(omega, np.degrees(np.angle(ratio)), 20.0 * np.log10(np.abs(ratio)))
