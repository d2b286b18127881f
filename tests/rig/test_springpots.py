"""Equations of real orders against their Laplace transforms, inverted.

Red when what is quicker than samples show is lost from a transfer function of real orders, or what is slower
than the record, when one is off that integrates, has poles next to the branch cut or several pairs, when a
mass beside a springpot is run as one beside a dashpot, or when such a mass, which no lag does as, is a lag.
"""

import numpy as np
import pytest

from focgen.errors import RigError
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.kernels import BALANCED
from focgen.rig.linear import run as linear
from focgen.rig.placed import Placed
from focgen.rig.response import check_bounded
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
LONG += [(0.3, 0.7), (1.05, 0.95)]
ORDERS = [(1.05, 0.78), (1.05, 1.1), *(pytest.param(*order, marks=pytest.mark.long) for order in LONG)]


@pytest.mark.parametrize("T, alpha", ORDERS)
@pytest.mark.parametrize(
    "period", [0.1, *(pytest.param(p, marks=pytest.mark.long) for p in (0.002, 0.3, 2.25))]
)
def test_a_mass_beside_a_springpot(T, alpha, period):
    x, run = rising()
    placed = (Placed("resonance", FORM, "actuator", (period,)),)
    of = TransferFunction([(2.0, 0.0)], [(T, alpha), (1.0, 0.0)])
    mass = (period / (2.0 * np.pi)) ** 2
    for actuator in (Actuator(T, alpha, (2.0,)), LinearActuator(of)):
        made = Chain(Rig("r", H, Signals("c", "y"), actuator), placed).run(x, "regulator", "sensor", run)
        first, later = apart(made, lambda s: 2.0 / (mass * s**2 + T * s**alpha + 1.0))
        assert first < 1e-5 and later < 1e-5


@pytest.mark.parametrize(
    "T, alpha",
    [
        pytest.param(0.3, 0.7, marks=pytest.mark.long),
        (1.05, 0.78),
        pytest.param(0.5, 0.4, marks=pytest.mark.long),
    ],
)
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


STAIRS = np.repeat([0.0, *np.random.default_rng(1).uniform(0.0, 1.0, 19)], 100)
EQUATIONS = {
    "integrates by a real order": ([(1, 0)], [(1, 1.2)]),
    "nearly twice": ([(1, 0)], [(1, 1.8)]),
    "by one lower than 1": ([(1, 0)], [(1, 1.3), (1, 0.5)]),
    "once, behind a springpot": ([(1, 0)], [(1, 1.7), (1, 1)]),
    "once, and swings": ([(1, 0.4), (1, 0)], [(1, 2.6), (0.3, 1.6), (1, 0.9)]),
    "dashpot beside a springpot": ([(1, 0)], [(1, 1), (0.1, 0.5), (1, 0)]),
    "pole beyond the cut": ([(1, 0)], [(1, 1.03), (0.1, 0.5), (1, 0)]),
    "two poles next to the cut": ([(1, 0)], [(0.01, 2), (1, 1.04), (1, 0)]),
    "pole on the cut": ([(0.4, 0.5), (1, 0)], [(1, 1), (1, 0)]),
    "two poles in one place": ([(0.4, 0.5), (1, 0)], [(1, 2), (2, 1), (1, 0)]),
    "two modes": ([(1, 0)], [(4e-4, 4), (2e-3, 3.2), (0.1, 2), (0.02, 1.2), (1, 0)]),
    "slower than the record by far": ([(1, 0)], [(0.4, 1.6), (6, 0.3), (0.06, 0)]),
    "pole as slow as the record": ([(1, 0)], [(1, 1.5), (5e-4, 0.5)]),
    "cut that changes its sign": ([(1, 0)], [(0.408, 2.24), (1.253, 1.26), (0.471, 0.95)]),
    "order next to 0": ([(1, 0)], [(3.0, 0.02), (0.2, 0)]),
}


def deviation(num, den, delay=0.0):
    """The largest of a response to a staircase in lines from the exact one, over its range."""
    transfer = TransferFunction(num, den)
    run = Run.of([len(STAIRS)], [0.0], H)
    exact = Convolution(transfer, H, "linear", delay).run(STAIRS)
    made = linear(transfer, STAIRS, run.rest, H, run.duration, delay=delay)
    return float(np.max(np.abs(made - exact)) / np.ptp(exact))


@pytest.mark.parametrize("delay", [0.0, 0.3 * H])
@pytest.mark.parametrize("equation", EQUATIONS.values(), ids=EQUATIONS)
def test_an_equation_of_real_orders(equation, delay):
    """1.8 was 99 of the range off, a pole beyond the cut 0.86 of it, and the second of two modes was lost."""
    assert deviation(*equation, delay) < 1e-4


@pytest.mark.long
def test_equations_of_real_orders_at_random():
    rng, off = np.random.default_rng(7), []
    for _ in range(400):
        orders = np.unique(np.round(rng.uniform(0.2, 1.0, rng.integers(2, 5)).cumsum(), 2))
        orders -= orders[0] * rng.integers(0, 2)
        den = [(float(np.exp(rng.normal())), order) for order in orders]
        if len(den) > 1:
            off.append(deviation([(1.0, 0.0)], den))
    assert len(off) > 300 and max(off) < 1e-3 and np.median(off) < 1e-6


def test_an_input_held_for_ever_leaves_an_equation_of_real_orders_at_rest():
    """Modes slower than the record are as far as they came before it."""
    transfer = TransferFunction(*EQUATIONS["pole beyond the cut"])
    held = np.full(len(STAIRS), 0.7)
    run = Run.of([len(STAIRS)], [0.0], H)
    rest = np.where(run.rest > 0, BALANCED, 0).astype(run.rest.dtype)
    made = linear(transfer, held, rest, H, run.duration)
    assert np.max(np.abs(made - 0.7)) < 1e-9
    moved = linear(transfer, held + STAIRS, rest, H, run.duration)
    came = linear(transfer, STAIRS, run.rest, H, run.duration)
    assert np.max(np.abs(moved - 0.7 - came)) < 1e-9


def test_orders_that_no_number_holds_are_named():
    den = [(0.2, 0.0), (0.4, 0.0015), (0.9, 0.66)]
    dynamics = LinearActuator(TransferFunction([(1.0, 0.0)], den))
    with pytest.raises(RigError, match=r"r \[actuator\]: its poles cannot be located.*check the coeff"):
        check_bounded(Rig("r", H, Signals("c", "y"), dynamics), 100.0)
