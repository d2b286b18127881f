"""A linear lag more than nominal, shared by the families that have one."""

import math
from dataclasses import replace

from focgen.arrays import Array, Complex
from focgen.rig import kernels
from focgen.rig.dynamics import Dynamics
from focgen.rig.effects._effect import Form, Parameter, Run, Values
from focgen.rig.modes import respond

RATE = Parameter("rate", level=1, time=-1, lower=1e-3, upper=1e3, starts=(10.0, 2.0, 0.5), zero=1e3, log=True)
"""The highest rate of a signal."""

PACE = Parameter("pace", lower=1.0, upper=20.0, starts=(1.1, 2.0), zero=1.0, log=True)
"""How many times as fast as its lag a chamber is at small differences, both ways: below 1 it is slow."""

THROAT = Parameter(
    "turbulent_above", level=1, lower=0.01, upper=20.0, starts=(0.5, 0.1), zero=math.inf, log=True
)
"""The difference of pressures above which a flow is rather turbulent."""

_LAG = (Parameter("lag", time=1, lower=0.0, upper=20.0, starts=(0.02, 0.2), zero=0.0),)


def _one(x: Array, values: Values, run: Run) -> Array:
    return kernels.lag(x, run.rest, run.h, values[0], values[0])


def _two(x: Array, values: Values, run: Run) -> Array:
    return _one(_one(x, values, run), values, run)


def lag_response(tau: float, s: Complex) -> Complex:
    """1/(tau s + 1)."""
    return 1.0 / (tau * s + 1.0)


def _partial(x: Array, values: Values, run: Run) -> Array:
    share, tau = values
    return x + share * (_one(x, (tau,), run) - x)


def _partial_response(values: Values, s: Complex) -> Complex:
    share, tau = values
    return 1.0 + share * (lag_response(tau, s) - 1.0)


def _unequal(x: Array, values: Values, run: Run) -> Array:
    tau, ratio = values
    return _one(_one(x, (tau,), run), (ratio * tau,), run)


def _unequal_response(values: Values, s: Complex) -> Complex:
    tau, ratio = values
    return lag_response(tau, s) * lag_response(ratio * tau, s)


def _unequal_form(slot: str) -> Form:
    ratio = Parameter("ratio", lower=0.02, upper=1.0, starts=(0.3,), log=True)
    return Form("unequal_lags", slot, (*_LAG, ratio), _unequal, response=_unequal_response)


def _spread(x: Array, values: Values, run: Run) -> Array:
    tau, order = values
    return respond(x, run.rest, run.h, max(tau, 1e-9 * run.h) ** order, order, run.duration)


def _spread_response(values: Values, s: Complex) -> Complex:
    tau, order = values
    return 1.0 / ((tau * s) ** order + 1.0)


def _partial_form(slot: str, slowest: float) -> Form:
    share = Parameter("share", lower=0.0, upper=1.0, starts=(0.3, 0.5), zero=0.0)
    tau = Parameter("lag", time=1, lower=0.02, upper=slowest, starts=(0.2, 1.5), log=True)
    return Form("partial", slot, (share, tau), _partial, response=_partial_response)


def slower_forms(slot: str, slowest: float = 6.0) -> list[Form]:
    """Besides, two lags of which one is the longer, as of a valve and its line, and a lag of a part of the
    signal: what makes a lag of a longer one. A part ``slowest`` response times slow or more creeps."""
    return [*forms(slot), _unequal_form(slot), _partial_form(slot, slowest)]


def forms(slot: str) -> list[Form]:
    """One lag, and two equal ones, at ``slot``."""
    return [
        Form("one_lag", slot, _LAG, _one, response=lambda values, s: lag_response(values[0], s)),
        Form("two_lags", slot, _LAG, _two, response=lambda values, s: lag_response(values[0], s) ** 2),
    ]


def deep_forms(slot: str) -> list[Form]:
    """Besides, a lag of a part of the signal only, and one with its times spread (Cole and Cole, J. Chem.
    Phys. 9, 1941), as where something has to soak in."""
    order = Parameter("order", lower=0.4, upper=1.0, starts=(0.8,))
    return [
        *slower_forms(slot, slowest=20.0),
        Form("spread", slot, (*_LAG, order), _spread, response=_spread_response),
    ]


def _paces(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, unloading=x.unloading * values[0])


def _times_as_fast(name: str) -> Parameter:
    return Parameter(name, lower=0.1, upper=10.0, starts=(0.7, 1.5), zero=1.0, log=True)


def two_paced(slot: str, name: str) -> Form:
    """A stage whose own equation runs ``name`` times as fast while it falls back."""
    return Form("speed", slot, (_times_as_fast(name),), _paces)


def _rises(x: Dynamics, values: Values, run: None) -> Dynamics:
    return replace(x, loading=x.loading * values[0])


def rising(form: str, slot: str, name: str) -> Form:
    """A stage whose own equation runs ``name`` times as fast while it rises: the time that was given may be
    that of its fall."""
    return Form(form, slot, (_times_as_fast(name),), _rises)


_ONE_WAY = Parameter("lag", time=1, lower=-5.0, upper=5.0, starts=(0.2, -0.2), zero=0.0)


def _lag_one_way(x: Array, values: Values, run: Run) -> Array:
    up, down = max(-values[0], 0.0), max(values[0], 0.0)
    return kernels.lag(x, run.rest, run.h, up, down)


def one_way(name: str, slot: str, bare: bool = False) -> Form:
    """One lag more, only while the signal falls; below 0, only while it rises."""
    return Form(name, slot, (_ONE_WAY,), _lag_one_way, bare=bare)
