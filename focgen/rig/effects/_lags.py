"""A linear lag more than nominal, shared by the families that have one."""

from focgen.rig import kernels
from focgen.rig.effects._effect import Form, Parameter

_LAG = (Parameter("lag", time=1, lower=0.0, upper=20.0, starts=(0.02, 0.2), zero=0.0),)


def _one(x, values, run):
    return kernels.lag(x, run.rest, run.h, values[0], values[0])


def _two(x, values, run):
    return _one(_one(x, values, run), values, run)


def lag_response(tau, s):
    """1/(tau s + 1)."""
    return 1.0 / (tau * s + 1.0)


def forms(slot):
    """One lag, and two equal ones, at ``slot``."""
    return [
        Form("one_lag", slot, _LAG, _one, response=lambda values, s: lag_response(values[0], s)),
        Form("two_lags", slot, _LAG, _two, response=lambda values, s: lag_response(values[0], s) ** 2),
    ]
