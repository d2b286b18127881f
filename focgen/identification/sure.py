"""How sure a fit is: whether it determines anything, and what the rig says of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.fractional import FractionalFit
from focgen.identification.stages import StageFit
from focgen.rig.model import Relative, Uncertainty

_NOTHING = 1.0  # of a parameter: half an interval that says nothing
_LEAST = 0.01  # of a parameter: no rig is known better from one session
_DIGITS = 3

_RECORD = {
    "T": "hold a step, and its release, for ten times the response time",
    "alpha": "hold a step, and its release, for ten times the response time",
    "K": "let the input move: steps to several levels and back to 0",
    "delay": "sample faster, or leave --delay out",
}


def check_determined(excitations: Sequence[Excitation], fit: FractionalFit) -> None:
    """Raise FitError where an interval is as wide as its parameter."""
    worst = max(relative_halves(excitations, fit).items(), key=lambda item: item[1])
    if not worst[1] < _NOTHING:
        names = ", ".join(x.name for x in excitations)
        wide = f"to ±{worst[1]:.0%}" if np.isfinite(worst[1]) else "not at all"
        what = f"these logs determine {worst[0]} {wide}, so there is no model to write"
        raise FitError(names, what, _RECORD[worst[0]])


def relative_halves(excitations: Sequence[Excitation], fit: FractionalFit) -> dict[str, float]:
    """Half 95 % intervals of T, alpha and K at the largest level, over their values."""
    level = max((x.loaded for x in excitations), key=abs)
    powers = level ** np.arange(len(fit.gain))
    K = float(powers @ fit.gain)
    scale = np.max(np.asarray(fit.half["gain"]) / np.sqrt(np.maximum(np.diag(fit.gain_covariance), 1e-300)))
    half_K = float(scale * np.sqrt(max(powers @ fit.gain_covariance @ powers, 0.0)))
    return {
        "T": float(fit.half["T"]) / abs(fit.T),
        "alpha": float(fit.half["alpha"]) / abs(fit.alpha),
        "K": half_K / abs(K) if K else np.inf,
    }


def actuator_uncertainty(excitations: Sequence[Excitation], fit: FractionalFit) -> Relative:
    """How well the actuator is known, for the rig's ``[uncertainty]``."""
    half = relative_halves(excitations, fit)
    return Relative(_told(half["K"]), _told(half["T"]), _told(half["alpha"]))


def with_stages(known: Uncertainty, found: dict[str, StageFit]) -> Uncertainty:
    """The uncertainty with regulator and sensor as identified."""
    stages = {name: Relative(_told(f.gain_relative), _told(f.time_relative)) for name, f in found.items()}
    return replace(known, **stages)


def _told(relative: float) -> float:
    return float(f"{max(relative, _LEAST):.{_DIGITS - 1}g}")
