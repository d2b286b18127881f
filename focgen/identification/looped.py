"""Where a rig goes round in loops: its model beside a play of the drive, where that is most of what it lacks.

A loop of dry friction or of a fabric is late at every pace alike. No T and α are. A fit that is not told of
the loop makes T several times too long for it, or ends far out, where 1/(T s^α) is late at every pace alike,
and only K/T is seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.fractional import FractionalFit, fit_fractional
from focgen.identification.sure import check_determined, misfit_of

_SEARCHED = 60_000  # samples that loops are tried on, of all experiments together
_WIDTHS = np.geomspace(0.01, 0.64, 10)  # half widths that are tried, of the input's reach,
_FINER = 8  # and as many between the neighbours of the best
_HOPELESS = 1e3  # what is left where there is no fit, as a share of the signals
_MOST = 0.25  # of the mean square that a model with numbers leaves: beside a loop that is most of it,
_HALVED = 0.5  # and of what one without numbers leaves,
_FOLLOWS = 0.05  # and of the fitted signals': what is left beside it, at most

Ready = Callable[[float], list[Excitation]]


@dataclass(frozen=True, eq=False)
class Fitted:
    """Experiments and the fit to them, beside a play of half ``width``, units of the input; 0 where it is by
    itself. ``alone``: that by itself, where it has one."""

    excitations: list[Excitation]
    fit: FractionalFit
    width: float = 0.0
    alone: FractionalFit | None = None

    @property
    def left(self) -> float:
        """The mean square that is left, of that of the fitted signals."""
        parts = [(x.measured - y) / x.spread for x, y in zip(self.excitations, self.fit.simulated)]
        return float(np.mean([np.var(part) for part in parts]))


def fitted(ready: Ready, delay: bool) -> Fitted:
    """The fit to the experiments that ``ready`` makes for a half width of a play: by itself, or beside a loop
    where it lacks one, or has no numbers without.

    Raises FitError where it has none either way.
    """
    alone: Fitted | None = None
    try:
        excitations = ready(0.0)
        alone = Fitted(excitations, fit_fractional(excitations, delay))
        check_determined(excitations, alone.fit)
    except FitError:
        beside = _beside_a_loop(ready, delay)
        if beside is None or (alone is not None and beside.left > _HALVED * alone.left):
            raise
        return beside
    if misfit_of(alone.excitations, alone.fit) is None:
        return alone
    beside = _beside_a_loop(ready, delay)
    if beside is None or beside.left > _MOST * alone.left:
        return alone
    return replace(beside, alone=alone.fit)


def again(found: Fitted, excitations: list[Excitation], delay: bool) -> Fitted:
    """The same with its experiments made ready in another way."""
    return replace(found, excitations=excitations, fit=fit_fractional(excitations, delay))


def loop_told(found: Fitted) -> tuple[str, ...]:
    """What the loop is, and that the rig has none."""
    if not found.width:
        return ()
    without = "have no numbers"
    if found.alone is not None:
        without = f"would be {found.alone.T:.3g}, {found.alone.alpha:.3g} and another K(p), and follow less"
    role = found.excitations[0].input_role
    said = (
        f"most of what the model lacks is a loop: T, alpha and K(p) are those beside a play of the {role} of "
        f"{found.width:.3g} to either side; without it they {without}. The rig that is written has no loop, "
        f"so `focgen replay` fits less well than this table: `focgen diagnose` names what makes it, and "
        f"writes the rig with it"
    )
    return (said,)


def _beside_a_loop(ready: Ready, delay: bool) -> Fitted | None:
    """The fit beside the loop that leaves least; None where none does, it has no numbers, or does not
    follow."""
    width = _best_width(ready, delay)
    if width is None:
        return None
    try:
        excitations = ready(width)
        found = Fitted(excitations, fit_fractional(excitations, delay), width)
        check_determined(excitations, found.fit)
    except FitError:
        return None
    return found if found.left <= _FOLLOWS else None


def _best_width(ready: Ready, delay: bool) -> float | None:
    """The half width beside which the least is left, None where that is the widest that is tried. Pasts are
    left to the fit that follows: they take longest."""

    def left(width: float) -> float:
        try:
            begun = [x.beginning(_SEARCHED // len(excitations)) for x in ready(float(width))]
            return Fitted(begun, fit_fractional(begun, delay, [None] * len(begun))).left
        except FitError:
            return _HOPELESS

    excitations = ready(0.0)
    widths = _WIDTHS * _reach(excitations)
    best = int(np.argmin([left(width) for width in widths]))
    if best == len(widths) - 1:
        return None
    between = widths[max(best - 1, 0)], widths[best + 1]
    found = minimize_scalar(left, bounds=between, method="bounded", options={"maxiter": _FINER})
    return float(found.x)


def _reach(excitations: Sequence[Excitation]) -> float:
    """How far the input goes."""
    return max(float(np.ptp(x.pressure)) for x in excitations)
