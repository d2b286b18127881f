"""Where a rig goes round in loops: its model beside a play of the drive, where that is most of what it lacks.

A loop of dry friction or of a fabric is late by as much however slowly the input moves; T and α are late by
less. A fit that is not told of the loop makes T several times too long for it. Or it ends at a T of 10⁵,
where no number of it can be told.
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

_SEARCHED = 20_000  # samples that loops are tried on, of all experiments together
_WIDTHS = np.geomspace(0.01, 0.64, 7)  # half widths that are tried, of the input's reach,
_FINER = 8  # and as many between the neighbours of the best,
_PROMISING = 2.0  # unless that leaves more than so many times what would be enough
_HOPELESS = 1e3  # what is left where there is no fit, as a share of the signals
_MOST = 0.25  # of the mean square that a model with numbers leaves: beside a loop that is most of it,
_HALVED = 0.5  # and of what one without numbers leaves,
_FOLLOWS = 0.05  # and of the fitted signals': what is left beside it, at most
_ZONE = 0.5  # and of what is left behind a dead zone instead


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


def fitted(excitations: list[Excitation], delay: bool) -> Fitted:
    """The fit to the experiments: by itself, or beside a loop where it lacks one, or has no numbers without.

    Raises FitError where it has none either way.
    """
    alone: Fitted | None = None
    try:
        alone = Fitted(excitations, fit_fractional(excitations, delay))
        check_determined(excitations, alone.fit)
    except FitError:
        enough = _FOLLOWS if alone is None else min(_FOLLOWS, _HALVED * alone.left)
        beside = _beside_a_loop(excitations, delay, enough)
        if beside is None:
            raise
        return beside
    if misfit_of(excitations, alone.fit) is None:
        return alone
    beside = _beside_a_loop(excitations, delay, min(_FOLLOWS, _MOST * alone.left))
    return alone if beside is None else replace(beside, alone=alone.fit)


def again(found: Fitted, excitations: list[Excitation], delay: bool) -> Fitted | None:
    """The same with its experiments made ready in another way; None where that has no numbers."""
    try:
        fit = fit_fractional(excitations, delay)
        check_determined(excitations, fit)
    except FitError:
        return None
    return replace(found, excitations=excitations, fit=fit)


def loop_told(found: Fitted) -> tuple[str, ...]:
    """What the loop is, and that the rig has none."""
    if not found.width:
        return ()
    without = "have no numbers"
    if found.alone is not None:
        without = f"would be {found.alone.T:.3g}, {found.alone.alpha:.3g} and another K(p), and follow less"
    role = found.excitations[0].input_role
    said = (
        f"most of what the model lacks is a loop, as of friction or backlash. T, alpha and K(p) are those "
        f"beside a play of the {role} of {found.width:.3g} to either side, and so are those of each "
        f"experiment; without it they {without}. The rig that is written has no loop: `focgen diagnose` "
        f"names what makes it, and writes the rig with it"
    )
    return (said,)


def _beside_a_loop(excitations: Sequence[Excitation], delay: bool, enough: float) -> Fitted | None:
    """The fit beside the loop that leaves least; None where that is more than ``enough``, it has no numbers,
    or a dead zone will do nearly as well."""
    width, _ = _closest(excitations, delay, Excitation.behind, enough)
    if width is None:
        return None
    try:
        behind = [x.behind(width) for x in excitations]
        found = Fitted(behind, fit_fractional(behind, delay), width)
        check_determined(behind, found.fit)
    except FitError:
        return None
    surely = found.left <= enough and found.left <= _ZONE * _behind_a_zone(excitations, delay)
    return found if surely else None


def _behind_a_zone(excitations: Sequence[Excitation], delay: bool) -> float:
    """What is left behind the dead zone that leaves least: few turns of the input may show no more."""
    return _closest(excitations, delay, Excitation.beyond, _FOLLOWS)[1]


def _closest(
    excitations: Sequence[Excitation],
    delay: bool,
    behind: Callable[[Excitation, float], Excitation],
    enough: float,
) -> tuple[float | None, float]:
    """The width of what the input goes through ``behind`` which the least is left, and what that is; no width
    where it is the widest that is tried, or leaves far more than ``enough``. Pasts are left to the fit that
    follows: they take longest."""
    begun = [x.beginning(_SEARCHED // len(excitations)) for x in excitations]

    def left(width: float) -> float:
        try:
            ready = [behind(x, float(width)) for x in begun]
            return Fitted(ready, fit_fractional(ready, delay, [None] * len(ready))).left
        except FitError:
            return _HOPELESS

    widths = _WIDTHS * max(float(np.ptp(x.pressure)) for x in begun)
    tried = [left(width) for width in widths]
    best = int(np.argmin(tried))
    if best == len(widths) - 1 or tried[best] > _PROMISING * enough:
        return None, tried[best]
    between = widths[max(best - 1, 0)], widths[best + 1]
    found = minimize_scalar(left, bounds=between, method="bounded", options={"maxiter": _FINER})
    return float(found.x), float(found.fun)
