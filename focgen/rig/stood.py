"""Where a stage that integrates stood as each experiment began: an axis, or the volume in a pump's bladder.

It has no equilibrium that an input's past could tell: it stays where it was left. Its first samples show
where.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import Begin
from focgen.logs.between import white_level
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run
from focgen.rig.engine import Chain, between_of
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, LinearActuator, Rig
from focgen.rig.stages import ENTERS, LEAVES, STAGES

_FIRST = 5  # samples that show it, at least
_APART = 5.0  # standard errors by which the first samples are off from 0
_ROUNDING = 1e-6  # of a signal's reach: less is no gauge's noise,
_REAL = 1e-9  # of a root: an imaginary part of rounding
_SECANTS = 8
_UNKNOWN = 0.003  # and so much is then taken for it


def standing(rig: Rig, log: Experiment, placed: Sequence[Placed], note: str) -> Experiment:
    """The experiment with where the first stage that integrates stood, and a ``note`` where that was not at
    0: by the first signal behind it, while neither that nor what the rig with what is ``placed`` makes from 0
    on has moved beyond the noise. What moves from the first sample on is to be further off than it goes
    meanwhile, for a dead time leaves as much."""
    role = _behind(rig, log)
    off, still = _off(rig, log, placed, role) if role else (0.0, 0)
    place = _place(rig, role, off) if role and off else 0.0
    if place and role and (placed or rig.known):
        place = _closer(rig, log, placed, role, place, still)
    begins = dict(log.begins)
    if role == "curvature":
        begins.pop(role, None)
    if place and role in ENTERS and "command" not in begins:
        begins.setdefault(role, Begin((place,)))
    told = place or any(not begin.known for begin in begins.values())
    notes = tuple(n for n in log.notes if n != note)
    return replace(log, stands=place, begins=begins, notes=(*notes, note) if told else notes)


def _behind(rig: Rig, log: Experiment) -> str | None:
    """The first signal of the log behind the stage that integrates, where what enters that is in it, too."""
    others = [getattr(rig, stage) for stage in ("regulator", "sensor") if stage != rig.integrator]
    if rig.integrator == "regulator" and isinstance(rig.actuator, LinearActuator):
        others.append(rig.actuator.dynamics)
    if rig.integrator is None or not all(np.isfinite(of.dc_gain) for of in others):
        return None  # where two stages add up, nothing tells the first
    stages = STAGES[STAGES.index(rig.integrator) :]
    ahead = [role for role, stage in ENTERS.items() if STAGES.index(stage) <= STAGES.index(rig.integrator)]
    if not any(role in log for role in ahead):
        return None
    return next((LEAVES[stage] for stage in stages if LEAVES[stage] in log), None)


def _closer(
    rig: Rig, log: Experiment, placed: Sequence[Placed], role: str, place: float, still: int
) -> float:
    """What leaves the stage that integrates where the rig with what is ``placed``, which may bend what is
    made of it, comes to the first samples: a few steps along the secant from there."""
    y = np.asarray(log[role], float)[log.read(role)][:still]

    def off(at: float) -> float:
        return float(np.median(y - _made(rig, log, placed, role, at)[:still]))

    before, at, off_before, off_at = 0.0, place, off(0.0), off(place)
    for _ in range(_SECANTS):
        if off_at in (0.0, off_before) or not np.isfinite(off_at):
            break
        step = off_at * (at - before) / (off_before - off_at)
        before, at, off_before = at, at + float(np.clip(step, -0.5 * abs(place), 0.5 * abs(place))), off_at
        off_at = off(at)
    return at if abs(off_at) < abs(off(place)) else place


def _made(rig: Rig, log: Experiment, placed: Sequence[Placed], role: str, stands: float = 0.0) -> Array:
    """What the rig makes of a signal, at its readings, where it stood there as the log began."""
    entry = "command" if "command" in log else "pressure"
    run = Run.of([len(log)], [log.start], log.sample_time, [log.before(entry)], stands=[stands])
    chain = Chain(rig, tuple(placed))
    last = next(stage for stage in STAGES if LEAVES[stage] == role)
    made = chain.run(np.asarray(log[entry], float), ENTERS[entry], last, run, between_of(rig, entry))
    return made[log.read(role)]


def _off(rig: Rig, log: Experiment, placed: Sequence[Placed], role: str) -> tuple[float, int]:
    """How far a signal is off at first from what the rig makes from 0 on, 0 where that does not show, and how
    many samples say so."""
    if len(log) < 2 * _FIRST:
        return 0.0, 0
    made, y = _made(rig, log, placed, role), np.asarray(log[role], float)[log.read(role)]
    if len(y) < 2 * _FIRST:
        return 0.0, 0
    off = y - made
    noise = white_level(off)
    if white_level(y) < _ROUNDING * float(np.ptp(y)):  # as of rows that a logger filled in
        noise = _UNKNOWN * float(np.ptp(y))
    still = max(min(_moves(made, noise), _moves(off, noise)), _FIRST)
    found, drifted = float(np.median(off[:still])), abs(np.mean(off[still - 2 : still]) - np.mean(off[:2]))
    unsure = _APART * noise / np.sqrt(still) + 2.0 * (np.ptp(made[: still + 2]) + drifted)
    if abs(found) > unsure:
        return found, still
    moving = still == _FIRST and rig.integrator == "regulator"
    return (_for_good(off, made), still) if moving else (0.0, still)


def _for_good(off: Array, made: Array) -> float:
    """What a signal is ``off`` (n,) by for good, beside what a gain and a dead time make of it: a pump adds
    up what it delivers without further errors, so that it may move as a log begins. 0 where that is not
    sure: what is left has as few independent errors as its correlation says."""
    known = np.stack([np.ones(len(made)), made, np.gradient(made)], axis=1)
    found, *_ = np.linalg.lstsq(known, off, rcond=None)
    left = off - known @ found
    size = float(left @ left)
    rho = float(left[1:] @ left[:-1]) / size if size else 0.0
    variance = size / len(left) * (1.0 + rho) / max(1.0 - rho, 1e-3) * np.linalg.pinv(known.T @ known)[0, 0]
    return float(found[0]) if abs(found[0]) > _APART * np.sqrt(variance) else 0.0


def _place(rig: Rig, role: str, off: float) -> float:
    """What leaves the stage that integrates where a signal behind it rests so far ``off`` from where it is at
    0; 0 where no level tells."""
    if role == "output":
        gain = rig.sensor.dc_gain
        if gain == 0.0:
            return 0.0
        off /= gain
    if rig.integrator == "actuator" or role == "pressure" or rig.actuator is None:
        return off
    if isinstance(rig.actuator, Actuator):
        return _driven(rig.actuator, off)
    gain = rig.actuator.dynamics.dc_gain
    return off / gain if gain != 0.0 else 0.0


def _driven(actuator: Actuator, off: float) -> float:
    """The pressure at which K(p) p is ``off``, the closest to 0; 0 where there is none."""
    roots = np.roots([*reversed(actuator.gain), -off])
    real = roots[np.abs(roots.imag) < _REAL * np.abs(roots)].real
    return float(real[np.argmin(np.abs(real))]) if len(real) else 0.0


def _moves(signal: Array, noise: float) -> int:
    """The first sample at which a signal (n,), in means of a few, is off from its first ones."""
    means = np.convolve(signal, np.full(_FIRST, 1.0 / _FIRST), "valid")
    moved = np.abs(means - means[0]) > 2.0 * noise
    return int(np.argmax(moved)) if moved.any() else len(signal)
