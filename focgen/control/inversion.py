"""The inverse of the rig's actuator times an integrator, eq. (6), for any actuator that can be inverted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.errors import DesignError
from focgen.fractional.poles import first_sheet_zeros
from focgen.fractional.transfer import Polynomial, Term, TransferFunction, polynomial
from focgen.rig.rig import Actuator, LinearActuator, Rig

FILTER_RATIO = 10.0  # corner of the roll-off over the crossover: it costs about 6° a filter order there
_HALF_PLANE = 0.5 * math.pi
_AXIS = 1e-6  # rad


@dataclass(frozen=True)
class Inversion:
    """C(s) = K_o / K(p) · ``transfer`` · (1/s where ``integrator``).

    ``gain`` are the coefficients of K(p) (one where K is constant). ``filter_time`` is the time constant
    (s) of the roll-off that keeps the controller's gain from growing with frequency, 0 where none is
    needed.
    """

    transfer: TransferFunction
    gain: tuple[float, ...]
    integrator: bool
    filter_time: float = 0.0
    notes: tuple[str, ...] = ()

    def K(self, pressure: Any) -> Any:
        """K(p), any shape."""
        return np.polynomial.polynomial.polyval(pressure, self.gain)

    @property
    def scheduled(self) -> bool:
        """Whether K depends on the pressure."""
        return len(self.gain) > 1 and any(self.gain[1:])


def invert(rig: Rig, crossover: float) -> Inversion:
    """Invert the actuator of ``rig`` for a loop of about ``crossover`` rad/s.

    Raises DesignError for a rig without an actuator, and for one whose inverse would be unstable or could not
    hold a set point.
    """
    actuator = rig.actuator
    if actuator is None:
        raise DesignError(
            rig.name,
            "has no [actuator], so there is nothing to invert",
            "identify it (focgen identify), or give [actuator] num = [[1.0, 0.0]]",
        )
    for stage in ("regulator", "sensor"):
        _check_static(rig, stage)
    if isinstance(actuator, Actuator):
        inverse = TransferFunction([(actuator.T, actuator.alpha), (1.0, 0.0)])
        return _rolled_off(Inversion(inverse, actuator.gain, True), crossover)
    return _rolled_off(_linear_inverse(rig.name, actuator), crossover)


def _check_static(rig: Rig, stage: str) -> None:
    gain = getattr(rig, stage).dc_gain
    if not math.isfinite(gain) or gain == 0.0:
        raise DesignError(
            f"{rig.name} [{stage}]",
            f"has the static gain {gain:g}, so the loop could not hold a set point",
            f"give a {stage} with a finite static gain, or write controller.toml by hand",
        )


def _linear_inverse(name: str, actuator: LinearActuator) -> Inversion:
    where, transfer = f"{name} [actuator]", actuator.dynamics
    if not transfer.num:
        raise DesignError(where, "is zero", "give num at least one term")
    _refuse_right_half(
        where,
        transfer.num,
        "has a zero at {place} rad/s: its inverse is unstable (non-minimum phase)",
        "move that factor to [regulator] or [sensor], which are not inverted",
    )
    _refuse_right_half(
        where,
        transfer.den,
        "has a pole at {place} rad/s: cancelling what is unstable only hides it",
        "stabilise it first, or write controller.toml by hand",
    )
    kind = transfer.den[-1].order - transfer.num[-1].order
    gain = transfer.num[-1].coefficient / transfer.den[-1].coefficient
    if kind < 0.0 or kind > 1.0:
        what = "cannot hold a set point (its static gain is 0)" if kind < 0 else "integrates more than once"
        raise DesignError(where, what, "an inverse does not serve here: write controller.toml by hand")
    if kind == 1.0:  # its own integrator closes the loop; another would cancel against the inverse's s
        inverse = _quotient(transfer.den, _shifted(transfer.num, 1.0), gain)
        note = "the actuator integrates by itself: the controller carries no second integrator"
        return Inversion(inverse, (gain,), False, notes=(note,))
    return Inversion(_quotient(transfer.den, transfer.num, gain), (gain,), True)


def _quotient(num: Polynomial, den: Polynomial, gain: float) -> TransferFunction:
    """Return gain · num/den with common powers of s divided out and the lowest coefficient of ``den`` 1."""
    unit, common = den[-1].coefficient, min(num[-1].order, den[-1].order)
    return TransferFunction(
        [(gain * c / unit, o - common) for c, o in num], [(c / unit, o - common) for c, o in den]
    )


def _shifted(terms: Polynomial, by: float) -> Polynomial:
    return polynomial((term.coefficient, term.order + by) for term in terms)


def _refuse_right_half(where: str, terms: Polynomial, what: str, remedy: str) -> None:
    low = terms[-1].order
    try:
        found = first_sheet_zeros(tuple(Term(c, o - low) for c, o in terms), _HALF_PLANE + 0.05)
    except ArithmeticError as reason:
        raise DesignError(where, f"cannot be inverted ({reason})", "check its num and den") from None
    right = found[np.abs(np.angle(found)) <= _HALF_PLANE + _AXIS]
    if len(right):
        place = max(right, key=lambda root: root.real)
        shown = f"{place.real:.3g}" + (f" ± {abs(place.imag):.3g}j" if place.imag else "")
        raise DesignError(where, what.format(place=shown), remedy)


def _rolled_off(inversion: Inversion, crossover: float) -> Inversion:
    """Add first-order lags until the whole controller's gain falls or stays level at high frequency."""
    transfer = inversion.transfer
    excess = transfer.num[0].order - transfer.den[0].order - (1.0 if inversion.integrator else 0.0)
    lags = math.ceil(excess - 1e-9)
    if lags < 1:
        return inversion
    time = float(f"{1.0 / (FILTER_RATIO * crossover):.6g}")  # of a searched crossover six digits are certain
    lag = TransferFunction([(1.0, 0.0)], [(time, 1.0), (1.0, 0.0)])
    filtered = transfer
    for _ in range(lags):
        filtered = filtered * lag
    power = "" if lags == 1 else f"^{lags}"
    note = f"a roll-off 1/({time:.4g} s + 1){power} keeps the controller's gain from growing"
    return Inversion(filtered, inversion.gain, inversion.integrator, time, (*inversion.notes, note))
