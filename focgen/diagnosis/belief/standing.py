"""Which families may stand in the place of one: their probabilities, and the least set that holds most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import expit

from focgen.diagnosis.numbers import NUMBERS

_SURE = 500.0  # nats: more is no surer
_SAME = 1e-3  # nats: forms whose odds are as close answer alike


def tied_within() -> float:
    """Standard deviations within which the second of two families is in the set."""
    none = max(1.0 - NUMBERS.held - NUMBERS.elsewhere, 1e-12)
    return float(np.sqrt(2.0 * np.log(NUMBERS.held / none)))


def behind(odds: float, best: float) -> float:
    """Log odds as standard deviations behind the best, of a Gaussian that is as unlikely; negative ahead."""
    return float(np.copysign(np.sqrt(2.0 * abs(best - odds)), best - odds))


def nominal_off(change: float, static: bool, form: float = 0.0) -> float:
    """Log odds that a nominal chain is off by itself, over an effect that changes the output by ``change``,
    as a share of the noise's root mean square; ``static``: a curve. ``form``: by what the rig's file says
    that the form of its equations is off, likewise.

    The chain of a rig was fitted to its logs until what was left could not be seen. So it may be off by part
    of the noise, and many samples show that clearly though nothing is wrong with the rig. That is mostly the
    curve: in other ways it is off by a third as much. The odds are no higher than an effect is rare: of one
    that changes nothing no log tells anything, and the chain is off by so little or it is not.

    A linear equation of another form makes no curve. All else it may look like, where it is off by as much:
    no log tells which of the two it is, and neither is the likelier.
    """
    alike = NUMBERS.bent if static else NUMBERS.bent / 3.0
    by_noise, by_form = (
        4.0 * float(np.log(max(of, 1e-12)) - np.log(max(change, 1e-12))) for of in (alike, form)
    )
    return min(max(by_noise, -np.inf if static else min(by_form, 0.0)), -float(np.log(NUMBERS.rare)))


def sureness(odds: float) -> float:
    """The probability that these log odds are."""
    return float(expit(odds))


def holds(odds: float) -> bool:
    """Whether what has these log odds over all else holds, by itself, what a set is to hold."""
    return odds > float(np.log(NUMBERS.held) - np.log1p(-NUMBERS.held))


def any_of(odds: Sequence[float]) -> float:
    """Log odds of a family that may take any of several forms, from those of each.

    How it is doubted must not hang on which of them fits best: a curve of two values that fits a little
    worse than one of five may be the likelier, and a family is the likelier the more of its forms will do.
    Forms that come to the same, as a limit of one sign and of both where the signal has one, are one.
    """
    found: list[float] = []
    for nats in sorted(odds, reverse=True):
        if not found or found[-1] - nats > _SAME:
            found.append(nats)
    return float(np.logaddexp.reduce(found))


def probabilities(odds: Sequence[float], instead: Sequence[float] = ()) -> np.ndarray:
    """Of every family (k,), from their log odds over the effect not being there at all; they sum to less than
    one, for it may not be, or be none of them, or be what has the log odds ``instead`` (k,) over each."""
    nats = np.clip(odds, -_SURE, _SURE)
    other = np.max(nats + instead) if len(instead) else -np.inf
    none = np.logaddexp.reduce([0.0, other, *nats])
    made: np.ndarray = (1.0 - NUMBERS.elsewhere) * np.exp(nats - none)
    return made


def least_set(sure: np.ndarray) -> np.ndarray:
    """The places of the fewest families that hold :attr:`~focgen.diagnosis.numbers.Numbers.held` of what
    all may hold together, the likeliest first."""
    order = np.argsort(-sure, kind="stable")
    held = np.cumsum(sure[order]) / max(float(np.sum(sure)), 1e-300)
    asked = NUMBERS.held / (1.0 - NUMBERS.elsewhere)
    return order[: int(np.searchsorted(held, min(asked, 1.0) - 1e-12)) + 1]
