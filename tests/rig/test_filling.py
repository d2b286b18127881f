"""Regulators that fill and vent by an equation of their own, against the same equation in small steps.

Red when the compiled regulator departs from its equation, or what lags ahead of it is taken for the chamber.
"""

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed
from focgen.rig.rig import Rig, Signals


def throttled(rate):
    """How fast a lag of 0.4 s vents, at twice its pace and turbulent beyond 0.3."""
    return rate if rate > 0.0 else -0.3 / 0.4 * (np.sqrt(1.0 - 4.0 * 0.4 * rate / 0.3) - 1.0)


OWN = {  # p' of a regulator that is asked for u, and the pressure that it stops at
    ("valve_asymmetry", "throat", (2.0, 0.3)): (throttled, np.inf),
    ("valve_asymmetry", "speed", 0.5): (lambda gap: gap if gap > 0.0 else 0.5 * gap, np.inf),
    ("valve_asymmetry", "choked_supply", 0.6): (lambda gap: min(gap, 0.6), np.inf),
    ("valve_asymmetry", "choked_exhaust", 0.6): (lambda gap: max(gap, -0.6), np.inf),
    ("flow_limit", "choked", 0.6): (lambda gap: min(max(gap, -0.6), 0.6), np.inf),
    ("supply_saturation", "relieved", 0.9): (lambda gap: gap, 0.9),
}


def in_small_steps(own, u, h, gain, times, held, parts=25):
    """Lags of ``times`` one after another, the last of which fills and vents as ``own`` has it: Heun's steps
    of a part of a sample, whose error goes with the step's square."""
    (flow, most), (*ahead, slowest), step = OWN[own], times, h / parts

    def rates(x, driven, p):
        found = []
        for now, time in zip(driven, ahead):
            found.append((x - now) / time)
            x = now
        return found, flow((gain * x - p) / slowest)

    exact, driven, p = [], [0.0] * len(ahead), 0.0
    for before, now in zip(np.r_[0.0, u].tolist(), u.tolist()):
        for j in range(parts):
            x, y = (before if held else before + (now - before) * k / parts for k in (j, j + 1))
            first, into = rates(x, driven, p)
            there = [d + step * r for d, r in zip(driven, first)]
            second, then = rates(y, there, min(p + step * into, most))
            driven = [d + 0.5 * step * (r + q) for d, r, q in zip(driven, first, second)]
            p = min(p + 0.5 * step * (into + then), most)
        exact.append(p)
    return exact


@pytest.mark.parametrize("between", [Between.HELD, Between.STRAIGHT])
@pytest.mark.parametrize("sign", [pytest.param(1.0, marks=pytest.mark.long), -1.0])
@pytest.mark.parametrize("effect, form, value", OWN)
def test_a_regulator_fills_and_vents_by_its_own_equation(effect, form, value, sign, between):
    """T p' = u - p, with what the effect makes of it, in steps of a 25th of a sample."""
    h, T, gain = 0.05, 0.4, 0.3
    u = np.random.default_rng(3).uniform(0.0, 5.0, 41)
    k = np.arange(400) / 10.0
    u = u[k.astype(int)] if between == Between.HELD else np.interp(k, np.arange(41), u)
    lag = TransferFunction([(sign * gain, 0)], [(T, 1), (1, 0)])
    rig = Rig("valve", h, Signals("u", "p"), None, regulator=lag)
    placed = Placed(effect, form_of(effect, form), "regulator", tuple(np.ravel(value)))
    made = Chain(rig, (placed,)).run(sign * u, "regulator", "regulator", Run.of([len(u)], [0.0], h), between)
    exact = in_small_steps((effect, form, value), u, h, gain, (T,), between == Between.HELD)
    np.testing.assert_allclose(made, exact, atol=4e-3 if between == Between.STRAIGHT else 2e-4)


@pytest.mark.parametrize("between", [Between.HELD, Between.STRAIGHT])
@pytest.mark.parametrize("lags_ahead", [pytest.param((0.06,), marks=pytest.mark.long), (0.1, 0.03)])
@pytest.mark.parametrize("effect, form, value", OWN)
def test_what_fills_and_vents_is_the_slowest_lag(effect, form, value, lags_ahead, between):
    """The valve's lags, one after another, and then T p' = u - p with what the effect makes of it, in steps
    of a 25th of a sample; against what the effect changes."""
    h, gain = 0.02, 0.3
    u = np.repeat(np.random.default_rng(5).uniform(0.0, 5.0, 12), 60)
    u = u if between == Between.HELD else np.convolve(u, np.ones(8) / 8.0)[: len(u)]
    den = np.polynomial.polynomial.polyfromroots([-1.0 / T for T in (*lags_ahead, 0.4)])
    transfer = TransferFunction([(gain, 0)], [(c / den[0], n) for n, c in enumerate(den)])
    rig = Rig("valve", h, Signals("u", "p"), None, regulator=transfer)
    placed = Placed(effect, form_of(effect, form), "regulator", tuple(np.ravel(value)))
    run = Run.of([len(u)], [0.0], h)
    made, plain = (Chain(rig, p).run(u, "regulator", "regulator", run, between) for p in ((placed,), ()))
    exact = in_small_steps((effect, form, value), u, h, gain, (*lags_ahead, 0.4), between == Between.HELD)
    changed = np.sqrt(np.mean((plain - exact) ** 2))
    assert changed > 0.02
    assert np.sqrt(np.mean((made - exact) ** 2)) < 0.03 * changed
