"""To and from scipy.signal and python-control, which know whole orders only."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import signal

from focgen.errors import MissingExtra
from focgen.fractional.transfer import Polynomial, Term, TransferFunction

if TYPE_CHECKING:
    import control


def to_scipy(transfer: TransferFunction) -> signal.TransferFunction:
    """Return it as scipy.signal.TransferFunction, which divides by the leading coefficient.

    Raises ValueError naming an order that is not whole.
    """
    return signal.TransferFunction(*_dense(transfer))


def from_scipy(system) -> TransferFunction:
    """Return a continuous scipy.signal system (any form: lti, zpk, state space) with one input and output.

    Raises ValueError for a discrete one, or one with several inputs or outputs.
    """
    if getattr(system, "dt", None) is not None:
        raise ValueError(f"the system is discrete, with dt = {system.dt}; a continuous one is needed")
    if isinstance(system, signal.StateSpace):
        outputs, inputs = system.D.shape
        if (inputs, outputs) != (1, 1):
            raise ValueError(f"the system has {inputs} inputs and {outputs} outputs; one of each is needed")
        num, den = signal.ss2tf(system.A, system.B, system.C, system.D)
        return TransferFunction(_terms(num[0]), _terms(den))
    form = system.to_tf()
    if np.ndim(form.num) > 1:
        raise ValueError(f"the system has {len(form.num)} outputs; one is needed")
    return TransferFunction(_terms(form.num), _terms(form.den))


def to_control(transfer: TransferFunction) -> control.TransferFunction:
    """Return it as control.TransferFunction, coefficient for coefficient.

    Raises ValueError naming an order that is not whole, MissingExtra without python-control.
    """
    return _control().TransferFunction(*_dense(transfer))


def from_control(system) -> TransferFunction:
    """Return a continuous python-control system (transfer function or state space), one input and output.

    Raises ValueError for a discrete one, or one with several inputs or outputs.
    """
    if system.isdtime(strict=True):
        raise ValueError(f"the system is discrete, with dt = {system.dt}; a continuous one is needed")
    if (system.ninputs, system.noutputs) != (1, 1):
        raise ValueError(
            f"the system has {system.ninputs} inputs and {system.noutputs} outputs; one of each is needed"
        )
    form = _control().tf(system)
    return TransferFunction(_terms(form.num[0][0]), _terms(form.den[0][0]))


def _control():
    try:
        import control
    except ImportError:
        raise MissingExtra.of("python-control", "control", "conversion to and from python-control") from None
    return control


def _terms(dense) -> Polynomial:
    return tuple(Term(float(c), float(o)) for o, c in enumerate(reversed(np.atleast_1d(dense))))


def _dense(transfer: TransferFunction) -> tuple[np.ndarray, np.ndarray]:
    """Return numerator and denominator, highest power first; negative orders are multiplied away."""
    for order in transfer.orders:
        if not order.is_integer():
            raise ValueError(f"order {order:g} is not a whole number, in {transfer}")
    lowest = min(0.0, *transfer.orders) if transfer.orders else 0.0
    return _row(transfer.num, lowest), _row(transfer.den, lowest)


def _row(terms: Polynomial, lowest: float) -> np.ndarray:
    if not terms:
        return np.zeros(1)
    top = terms[0].order
    row = np.zeros(int(top - lowest) + 1)
    row[[int(top - t.order) for t in terms]] = [t.coefficient for t in terms]
    return row
