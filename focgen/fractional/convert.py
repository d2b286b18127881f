"""To and from scipy.signal and python-control, which know whole orders only; and frequency responses, which
hold for any order."""

from __future__ import annotations

import math
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import signal

from focgen.arrays import Array
from focgen.errors import MissingExtra
from focgen.fractional.transfer import Polynomial, Term, TransferFunction

if TYPE_CHECKING:
    import control

_AROUND = 100.0  # times the corners: how far a picture reaches where no frequencies are given
_POINTS = 400  # of a picture


def to_scipy(transfer: TransferFunction) -> signal.TransferFunction:
    """Return it as scipy.signal.TransferFunction, which divides by the leading coefficient.

    Raises ValueError naming an order that is not whole.
    """
    return signal.TransferFunction(*_dense(transfer))


def from_scipy(system: Any) -> TransferFunction:
    """Return a continuous scipy.signal system (any form: lti, zpk, state space) with one input and output.

    Raises ValueError for a discrete one, one with several inputs or outputs, or what is no such system.
    """
    if not isinstance(system, (signal.lti, signal.dlti)):
        raise ValueError(f"{type(system).__name__} is no system of scipy.signal; make one with signal.lti")
    if getattr(system, "dt", None) is not None:
        raise ValueError(f"the system is discrete, with dt = {system.dt}; a continuous one is needed")
    if isinstance(system, signal.StateSpace):
        outputs, inputs = system.D.shape
        _check_single(inputs, outputs)
        num, den = signal.ss2tf(system.A, system.B, system.C, system.D)
        return TransferFunction(_terms(num[0]), _terms(den))
    form = system.to_tf()
    if np.ndim(form.num) > 1:
        _check_single(1, len(form.num))
    return TransferFunction(_terms(form.num), _terms(form.den))


def to_control(transfer: TransferFunction) -> control.TransferFunction:
    """Return it as control.TransferFunction, coefficient for coefficient.

    Raises ValueError naming an order that is not whole, MissingExtra without python-control.
    """
    return _control().TransferFunction(*_dense(transfer))


def from_control(system: Any) -> TransferFunction:
    """Return a continuous python-control system (transfer function or state space), one input and output.

    Raises ValueError for a discrete one, one with several inputs or outputs, or frequency data, which have no
    coefficients; MissingExtra without python-control.
    """
    library = _control()
    if not isinstance(system, (library.TransferFunction, library.StateSpace)):
        kind = type(system).__name__
        raise ValueError(f"{kind} has no coefficients; a transfer function or a state space is needed")
    if system.isdtime(strict=True):
        raise ValueError(f"the system is discrete, with dt = {system.dt}; a continuous one is needed")
    _check_single(system.ninputs, system.noutputs)
    form = library.tf(system)
    return TransferFunction(_terms(form.num[0][0]), _terms(form.den[0][0]))


def to_frd(transfer: TransferFunction, omega: ArrayLike | None = None, delay: float = 0.0) -> Any:
    """Return the frequency response as control.FrequencyResponseData, exact for any real orders.

    ``omega`` (n,): rising frequencies > 0 in rad/s (default: two decades around the corners). ``delay``: a
    dead time in s, e^(−jωL). python-control draws it (``bode_plot``, ``nyquist_plot``, ``nichols_plot``) and
    connects it with its own systems. Raises ValueError for frequencies or a delay that cannot be used,
    MissingExtra without python-control.
    """
    places = corners(transfer) if omega is None else np.atleast_1d(np.asarray(omega, dtype=float))
    rising = places.ndim == 1 and len(places) and np.all(np.diff(places, prepend=0.0) > 0.0)
    if not rising or math.isinf(places[-1]):
        raise ValueError("the frequencies are not one row of rising numbers above 0 rad/s")
    if not 0.0 <= delay < math.inf:
        raise ValueError(f"the delay is {delay} s, it must be 0 s or more")
    values = transfer.frequency_response(places) * np.exp(-1j * places * delay)
    return _control().FrequencyResponseData(values, places, name="fractional")


def corners(transfer: TransferFunction) -> Array:
    """Frequencies (400,) in rad/s that show it all: two decades beyond where any two of its terms balance."""
    balances = [
        abs(high.coefficient / low.coefficient) ** (1.0 / (low.order - high.order))
        for terms in (transfer.num, transfer.den)
        for high, low in combinations(terms, 2)
    ] or [1.0]
    return np.geomspace(min(balances) / _AROUND, max(balances) * _AROUND, _POINTS)


def bode(transfer: TransferFunction, omega: ArrayLike | None = None, delay: float = 0.0, **how: Any) -> Any:
    """Draw the Bode plot with ``control.bode_plot``, and return what that returns; ``how`` goes to it.

    ``omega`` and ``delay`` as for :func:`to_frd`, which says what is raised (ValueError, MissingExtra).
    """
    return _control().bode_plot(to_frd(transfer, omega, delay), **how)


def nyquist(
    transfer: TransferFunction, omega: ArrayLike | None = None, delay: float = 0.0, **how: Any
) -> Any:
    """Draw the Nyquist plot with ``control.nyquist_plot``, and return what that returns; ``how`` goes to it.

    ``omega`` and ``delay`` as for :func:`to_frd`, which says what is raised (ValueError, MissingExtra).
    """
    return _control().nyquist_plot(to_frd(transfer, omega, delay), **how)


def _control() -> Any:
    try:
        import control
    except ImportError:
        raise MissingExtra.of("python-control", "control", "conversion to and from python-control") from None
    return control


def _check_single(inputs: int, outputs: int) -> None:
    if (inputs, outputs) != (1, 1):
        raise ValueError(f"the system has {inputs} inputs and {outputs} outputs; one of each is needed")


def _terms(dense: ArrayLike) -> Polynomial:
    return tuple(Term(float(c), float(o)) for o, c in enumerate(reversed(np.atleast_1d(dense))))


def _dense(transfer: TransferFunction) -> tuple[Array, Array]:
    """Return numerator and denominator, highest power first; negative orders are multiplied away."""
    for order in transfer.orders:
        if not order.is_integer():
            raise ValueError(
                f"order {order:g} is not a whole number, in {transfer}; its frequency response is to_frd(…)"
            )
    lowest = min(0.0, *transfer.orders) if transfer.orders else 0.0
    return _row(transfer.num, lowest), _row(transfer.den, lowest)


def _row(terms: Polynomial, lowest: float) -> Array:
    if not terms:
        return np.zeros(1)
    top = terms[0].order
    row = np.zeros(int(top - lowest) + 1)
    row[[int(top - t.order) for t in terms]] = [t.coefficient for t in terms]
    return row
