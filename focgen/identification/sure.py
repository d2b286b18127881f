"""How sure a fit is: whether it determines anything, and what the rig says of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.form import foretold, levelled
from focgen.identification.fractional import FractionalFit
from focgen.identification.stages import StageFit
from focgen.logs.between import noise_level
from focgen.rig.rig import Relative, Uncertainty

HARDLY = 10.0  # times a parameter: an interval wider than this has no number
_NOTHING = 1.0  # of a parameter: half an interval that says nothing
_LEAST = 0.01  # of a parameter: no rig is known better from one session
_DIGITS = 3
_MISFIT = 3.0  # times the noise of the readings: what is left is more than noise
_LEFT = 0.05  # of the spread: what is left below is of no concern
_TAKEN_UP = 2.0  # times what a stage's drive foretells of the rest: what its numbers took up of an effect
_OUTWEIGHS = 2.0  # times the noise: three quarters of what is left are the model's own misfit

_RECORD = {
    "T": "hold a step, and its release, for ten times the response time",
    "alpha": "hold a step, and its release, for ten times the response time",
    "K": "let the input move: steps to several levels and back to 0",
}


def check_determined(excitations: Sequence[Excitation], fit: FractionalFit) -> None:
    """Raise FitError where an interval is as wide as its parameter."""
    worst = max(relative_halves(excitations, fit).items(), key=lambda item: item[1])
    if not worst[1] < _NOTHING:
        names = ", ".join(x.name for x in excitations)
        what = f"these logs determine {worst[0]} to ±{worst[1]:.0%} only"
        what = what if worst[1] < HARDLY else f"these logs do not determine {worst[0]}"
        remedy = "leave --delay out, or " if fit.half["delay"] else ""
        if misfit := misfit_of(excitations, fit):
            what += f", and the best model leaves {times_text(misfit)} the noise of the readings"
            remedy += "look at the columns, and keep with --from and --to what follows this input alone"
        else:
            remedy += _RECORD[worst[0]]
        raise FitError(names, f"{what}: there is no model to write", remedy)


def has_numbers(fit: FractionalFit) -> bool:
    """Whether the log bounds K, T and α at all. A search may also end far out, where only K/T is seen, with
    an interval without a bound."""
    found = (("gain", fit.gain), ("T", fit.T), ("alpha", fit.alpha))
    return all(np.all(fit.half[name] <= HARDLY * np.abs(np.asarray(value))) for name, value in found)


def misfit_of(excitations: Sequence[Excitation], fit: FractionalFit) -> float | None:
    """How many times the noise of the readings a fit leaves; None where that is little."""
    worst = _times_noise(excitations, fit, _LEFT)
    return worst if worst > _MISFIT else None


def _times_noise(excitations: Sequence[Excitation], fit: FractionalFit, concern: float = 0.0) -> float:
    """How many times its noise the usual experiment is left with; those with less than ``concern`` of their
    spread are not asked."""
    ratios = []
    for x, made in zip(excitations, fit.simulated):
        left, noise = float(np.std(x.measured - made)), noise_level(x.measured)
        if left > concern * x.spread and noise > 0.0:
            ratios.append(left / noise)
    return float(np.median(ratios)) if ratios else 0.0


def times_text(ratio: float) -> str:
    """A ratio in words: "4.5 times", "96 times"."""
    return f"{ratio:.{1 if ratio < 10.0 else 0}f} times"


def relative_halves(excitations: Sequence[Excitation], fit: FractionalFit) -> dict[str, float]:
    """Half 95 % intervals of T, alpha and K at the largest level, over their values."""
    level = float(max((x.loaded for x in excitations), key=abs))
    powers = level ** np.arange(len(fit.gain))
    K = float(powers @ fit.gain)
    scale = np.max(np.asarray(fit.half["gain"]) / np.sqrt(np.maximum(np.diag(fit.gain_covariance), 1e-300)))
    spread = max(float(powers @ fit.gain_covariance @ powers), 0.0)
    half_K = float(scale * np.sqrt(spread)) if np.isfinite(scale) else np.inf
    return {
        "T": float(fit.half["T"]) / abs(fit.T),
        "alpha": float(fit.half["alpha"]) / abs(fit.alpha),
        "K": half_K / abs(K) if K else np.inf,
    }


def actuator_uncertainty(excitations: Sequence[Excitation], fit: FractionalFit, compromise: bool) -> Relative:
    """How well the actuator is known, for the rig's ``[uncertainty]``; ``compromise``: see below.

    An interval says how well this model is determined, not how far it is from the rig. Where the model's own
    misfit outweighs the noise, the numbers are a compromise, and known no better than a rig's usually are.
    """
    half = relative_halves(excitations, fit)
    known = Relative(_told(half["K"]), _told(half["T"]), _told(half["alpha"]))
    if not compromise:
        return known
    usual = Uncertainty().actuator
    return Relative(max(known.gain, usual.gain), max(known.time, usual.time), max(known.alpha, usual.alpha))


def is_compromise(excitations: Sequence[Excitation], fit: FractionalFit) -> bool:
    """Whether what the model cannot follow outweighs the noise of the readings."""
    return _times_noise(excitations, fit) > _OUTWEIGHS


def with_stages(known: Uncertainty, found: dict[str, StageFit]) -> Uncertainty:
    """The uncertainty with regulator and sensor as identified."""
    return replace(known, **{name: _stage_uncertainty(f) for name, f in found.items()})


def _stage_uncertainty(fit: StageFit) -> Relative:
    """How well a stage is known: no better than twice what its drive foretells of what is left, for a fit
    takes up of an effect whatever its numbers can. Noise of a colour, or steps of a converter, are not
    foretold."""
    left = [_foretold_of(measured, made) for measured, made in zip(fit.measured, fit.simulated)]
    least = _told(_TAKEN_UP * float(np.median(left)))
    return Relative(max(_told(fit.gain_relative), least), max(_told(fit.time_relative), least))


def _foretold_of(measured: Array, made: Array) -> float:
    """The root mean square that a curve of what a fit has ``made`` (n,), and one of each way that it goes,
    foretell of what that leaves, as a share of the signal's spread."""
    spread = float(np.std(measured))
    if not spread > 0.0 or not np.ptp(made) > 0.0:
        return 0.0
    place, way = made / float(np.max(np.abs(made))), np.gradient(made)
    columns = [place, place**2, place**3, np.maximum(way, 0.0), np.minimum(way, 0.0), np.sign(way)]
    left = levelled(measured - made)
    share = foretold(np.stack([levelled(c) for c in columns], axis=1), left)
    return float(np.sqrt(share) * np.std(left)) / spread


def _told(relative: float) -> float:
    return float(f"{max(relative, _LEAST):.{_DIGITS - 1}g}")
