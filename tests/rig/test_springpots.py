"""Equations of real orders against their Laplace transforms, inverted.

Red when what is quicker than samples show is lost from a transfer function of real orders, when a mass beside
a springpot is run as one beside a dashpot, or when such a mass, which no lag does as, counts as a lag.
"""

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain, Placed
from focgen.rig.linear import run as linear
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals
from tests.rig.test_simulator import ramp_response

H = 0.02
FORM = form_of("resonance", "mass")


def rising(count=400):
    """A step that takes one sample to rise, and its session."""
    return np.r_[0.0, np.ones(count)], Run.of([count + 1], [0.0], H)


def apart(made, transform):
    """How far responses (n,) to that step are from exact ones: as it has risen, and from then to the last."""
    off = [abs(made[k] - ramp_response(transform, k * H, H, degree=72)) for k in (1, 2, 5, 20, 100, 400)]
    return off[0], max(off[1:])


LONG = [(0.5, 0.4), (1.05, 0.91), (1.05, 0.99), (0.5, 0.9999), (1.05, 1.02), (0.5, 1.4)]
ORDERS = [(0.3, 0.7), (1.05, 0.78), (1.05, 0.95), (1.05, 1.1)]
ORDERS += [pytest.param(*order, marks=pytest.mark.long) for order in LONG]


@pytest.mark.parametrize("T, alpha", ORDERS)
@pytest.mark.parametrize(
    "period", [0.1, 2.25, *(pytest.param(p, marks=pytest.mark.long) for p in (0.002, 0.3))]
)
def test_a_mass_beside_a_springpot(T, alpha, period):
    x, run = rising()
    placed = (Placed("resonance", FORM, "actuator", (period,)),)
    of = TransferFunction([(2.0, 0.0)], [(T, alpha), (1.0, 0.0)])
    mass = (period / (2.0 * np.pi)) ** 2
    for actuator in (Actuator(T, alpha, (2.0,)), LinearActuator(of)):
        made = Chain(Rig("r", H, Signals("c", "y"), actuator), placed).run(x, "regulator", "sensor", run)
        first, later = apart(made, lambda s: 2.0 / (mass * s**2 + T * s**alpha + 1.0))
        near = abs(alpha - 1.0) < 0.08  # as beside a dashpot, whose response runs in lines
        assert max(first, later) < 1e-2 if near else first < 2e-3 and later < 1e-4


@pytest.mark.parametrize("T, alpha", [(0.3, 0.7), (1.05, 0.78), (0.5, 0.4)])
def test_real_orders_pass_what_is_quicker_than_samples_at_once(T, alpha):
    """A lag beside a mode that is far quicker, and one that is as large at once as its numerator says."""
    x, run = rising()
    den = [(T, alpha), (1.0, 0.0)]
    swift = TransferFunction([(1.0, 0.0)], [(1e-12, 2.0), *den])
    jumps = TransferFunction([(3.0 * T, alpha), (1.0, 0.0)], den)
    for transfer in (swift, jumps):
        made = linear(transfer, x, run.rest, H, run.duration)
        first, later = apart(made, lambda s: _at(transfer.num, s) / _at(transfer.den, s))
        assert first < 2e-3 and later < 1e-5


def _at(terms, s):
    return sum(t.coefficient * s**t.order for t in terms)


@pytest.mark.parametrize(
    "period, alpha, itself", [(2.25, 0.78, True), (2.25, 1.0, False), (12.0, 1.0, True), (0.5, 1.0, False)]
)
def test_a_mass_that_creeps_is_a_lag_beside_a_dashpot_only(period, alpha, itself):
    den = TransferFunction([(1.0, 0.0)], [(1.05, alpha), (1.0, 0.0)]).den
    assert FORM.itself((period,), den) == itself
