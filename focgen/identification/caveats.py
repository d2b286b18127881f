"""What a set of logs cannot show, said before anybody relies on it: one sentence a kind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.arrays import Array
from focgen.identification.excitation import Excitation
from focgen.identification.fractional import FractionalFit
from focgen.identification.identification import ExperimentFit
from focgen.identification.single import is_step
from focgen.identification.sure import misfit_of, relative_halves, times_text
from focgen.identification.zero import resting
from focgen.logs.between import noise_level
from focgen.logs.notes import listed
from focgen.rig.rig import Rig

_FALL = 0.5  # of the step: the input comes nearer to 0 by at least this in a release
_WIDE = 0.3  # of a parameter: an interval wider than this says little
_ASTRAY = 0.1  # of the output's spread: so far off at rest is more than a zero that is a little off
_WORSE = 0.01  # of GOF: by so much more a rig is visibly worse than the single fits


def warnings_of(
    excitations: Sequence[Excitation],
    fit: FractionalFit,
    fits: Sequence[ExperimentFit],
    failed: Sequence[str],
    quality: dict[str, dict[str, float]],
) -> tuple[str, ...]:
    """The warnings that apply, most important first. ``failed``: experiments that have no fit of their
    own; ``quality``: of every model by experiment, nothing where the rig lacks a loop that was fitted."""
    misfit = misfit_of(excitations, fit)
    found = _rig_is_worse(fits, quality) or ([_model_short(misfit, fit)] if misfit else [])
    found += _astray(excitations, fit)
    found += _unsure(excitations, fit, misfit)
    found += _singles(fits, failed, misfit)
    if all(is_step(x) for x in excitations) and not any(_releases(x) for x in excitations):
        found.append(
            "positive steps only: whether the actuator unloads as it loads, and its hysteresis, cannot be "
            "seen; log the releases too, and a slow sine"
        )
    if _rising(excitations):
        found.append(
            "the levels rise from run to run: a gain that grows with the level cannot be told from one that "
            "grows with every load; shuffle them, or repeat the first at the end"
        )
    return tuple(found)


def effects_left_out(rig: Rig) -> tuple[str, ...]:
    """A warning where the rig has effects, which are no part of what is fitted."""
    names = [f"{effect['name']} of the {effect.get('stage', 'rig')}" for effect in rig.effects]
    if not names:
        return ()
    said = (
        f"not fitted, and not in the new rig: {listed(names)}, of the rig's file; other numbers make up for "
        f"that where they can; `focgen diagnose` refits a rig with its effects in it (refitted.toml)"
    )
    return (said,)


def _model_short(misfit: float, fit: FractionalFit) -> str:
    late = "" if fit.half.get("delay") else "a dead time (--delay), "
    return (
        f"the model leaves {times_text(misfit)} the noise of the readings: something that it does "
        f"not have, such "
        f"as {late}hysteresis, another speed of unloading, or drift; `focgen diagnose` names it"
    )


def _rig_is_worse(fits: Sequence[ExperimentFit], quality: dict[str, dict[str, float]]) -> list[str]:
    own = {f.name: quality["fom"][f.name] - quality["rig"][f.name] for f in fits} if quality else {}
    if not own or float(np.mean(list(own.values()))) <= _WORSE:
        return []
    rig, single = (float(np.mean([quality[m][name] for name in own])) for m in ("rig", "fom"))
    return [
        (
            f"the rig reaches a GOF of {rig:.3f} where every experiment by itself reaches {single:.3f}: the "
            "experiments differ by something that one K(p), T and alpha do not have. That may be hysteresis, "
            "another speed of unloading, or drift; `focgen diagnose` names it"
        )
    ]


def _astray(excitations: Sequence[Excitation], fit: FractionalFit) -> list[str]:
    """Offsets that the logs' own rests contradict: they stand in for what the model lacks."""
    off = [(x, _off_at_rest(x, made)) for x, made in zip(excitations, fit.simulated)]
    far = [(x.name, rest) for x, rest in off if abs(rest) > _ASTRAY * x.spread]
    if 2 * len(far) <= len(off):
        return []
    name, worst = max(far, key=lambda one: abs(one[1]))
    return [
        (
            f"at rest the fits are off, {name} by {abs(worst):.2g}: the offset that each experiment has to "
            "itself makes up for what the model lacks. The rig has no such offset, so `focgen replay` fits "
            "less well than this table. `focgen diagnose` names what is lacking, and --to leaves out "
            "the releases"
        )
    ]


def _off_at_rest(x: Excitation, made: Array) -> float:
    """By how much a fit (n,) misses the output while the input rests, 0 where noise explains it."""
    rest = resting(x)
    if rest < 2:
        return 0.0
    off = float(np.mean((x.measured - made)[:rest]))
    return off if abs(off) > 3.0 * noise_level(x.measured) / np.sqrt(rest) else 0.0


def _unsure(excitations: Sequence[Excitation], fit: FractionalFit, misfit: float | None) -> list[str]:
    wide = {k: h for k, h in relative_halves(excitations, fit).items() if h > _WIDE}
    if not wide:
        return []
    known = ", ".join(f"{k} to ±{h:.0%}" for k, h in wide.items())
    remedy = "the model is short of something first" if misfit else "hold steps longer, or lower the noise"
    return [f"the rig is known badly, {known}: {remedy}"]


def _singles(fits: Sequence[ExperimentFit], failed: Sequence[str], misfit: float | None) -> list[str]:
    wide = [f.name for f in fits if f.step and any(_half(f, key) > _WIDE for key in ("K", "T", "alpha"))]
    said = []
    if wide:
        remedy = "" if misfit else "; hold steps longer or lower the noise for Table I"
        own = "by itself" if len(wide) == 1 else "by themselves"
        said.append(f"{listed(wide)}: K, T or alpha known to ±{_WIDE:.0%} or worse {own}{remedy}")
    if failed:
        own = "by itself" if len(failed) == 1 else "by themselves"
        said.append(f"{listed(failed)}: K, T and alpha not determined {own}, and not in Table I")
    return said


def _rising(excitations: Sequence[Excitation]) -> bool:
    levels = np.array([x.loaded for x in excitations])
    return len(levels) > 2 and bool(np.all(np.diff(levels) > 0.0))


def _releases(x: Excitation) -> bool:
    """Whether the input comes back towards 0 in the log, for more than a single last sample."""
    size = np.abs(np.concatenate([[x.before], x.pressure]))
    fallen = np.maximum.accumulate(size) - size >= _FALL * abs(x.level - x.before)
    return bool(x.level != x.before and np.count_nonzero(fallen) > 1)


def _half(fit: ExperimentFit, key: str) -> float:
    low, high = fit.ci95[key]
    made: float = abs((high - low) / 2.0 / getattr(fit, key))
    return made
