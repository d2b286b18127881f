"""A spring that yields without memory, or an outflow by the root, is a bent gain, and nothing beside it.

And rubber softens in its own spring, and is stiff again beyond the strains it has seen.

Red when the hysteretic spring, which may lose its loop in a fit, is named for what has none, or a seat for a
root's steepness at 0; when softened rubber keeps an eighth of the gap.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run, form_of
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed
from focgen.rig.rig import LinearActuator, Rig, Signals

H, FULL = 0.2, 10.0  # s, largest level
TWO_TANKS = TransferFunction([(1.9, 0.0)], [(11.0, 2.0), (7.3, 1.0), (1.0, 0.0)])
TANKS = Rig("tanks", H, Signals("t", "h", "u"), LinearActuator(TWO_TANKS))
LEVELS = (3.0, 0.0, 1.5, 5.0, 2.2, 5.5, 1.0, 4.0, 0.0)


def outflow(level: float) -> float:
    """Half through a pipe of laminar flow, half through an orifice."""
    return 0.5 * max(level, 0.0) + 0.5 * float(np.sqrt(max(level, 0.0) * FULL))


def filled(pump: np.ndarray) -> np.ndarray:
    """The level (n,) of the second of two tanks in series, steps of a tenth of a sample."""
    first, second, levels = 0.0, 0.0, []
    for u in pump:
        levels.append(second)
        for _ in range(10):
            between = outflow(first)
            second += H / 10.0 / 3.0 * (between - outflow(second))
            first += H / 10.0 / 4.0 * (2.0 * u - between)
    return np.array(levels)


def session() -> list[Experiment]:
    """Steps and a slow sine of the pump."""
    rng, t = np.random.default_rng(5), np.arange(640) * H
    steps = np.r_[np.zeros(10), np.repeat(LEVELS, 70)]
    pumps = {"steps": steps, "sine": 2.5 - 2.5 * np.cos(0.2 * t)}
    logs = []
    for i, (name, pump) in enumerate(pumps.items()):
        seen = filled(pump) + 0.05 * rng.normal(size=640)
        logs.append(replace(Experiment(name, H, {"command": pump, "output": seen}), start=150.0 * i))
    return logs


@pytest.mark.long
def test_an_orifice_that_drains_a_tank_is_a_bent_gain():
    found = diagnose(TANKS, session())
    assert [c.candidates[0].effect for c in found.causes] == ["gain_nonlinearity"]
    assert found.shrink is not None and found.shrink > 0.8


@pytest.mark.parametrize("seed, laminar", [(1, 0.1), pytest.param(2, 0.4, marks=pytest.mark.long)])
def test_a_tank_of_one_lag_that_drains_by_the_root_has_no_dead_zone(seed, laminar):
    """3 dh/dt = 2 u - outflow; the seat of a preloaded spring would hold it at 0 as the root does."""
    rng, logs = np.random.default_rng(seed), []
    steps, t = np.r_[np.zeros(10), np.repeat(LEVELS, 70)], np.arange(640) * H
    for i, pump in enumerate((steps, 2.5 - 2.5 * np.cos(0.2 * t))):
        level, seen = 0.0, []
        for u in pump:
            seen.append(level)
            for _ in range(10):
                out = laminar * level + (1.0 - laminar) * float(np.sqrt(max(level, 0.0) * FULL))
                level += H / 30.0 * (2.0 * u - out)
        roles = {"command": pump, "output": np.array(seen) + 0.05 * rng.normal(size=640)}
        logs.append(replace(Experiment(str(i), H, roles), start=150.0 * i))
    lag = LinearActuator(TransferFunction([(1.9, 0.0)], [(3.2, 1.0), (1.0, 0.0)]))
    found = diagnose(Rig("tank", H, TANKS.signals, lag), logs)
    assert [c.candidates[0].effect for c in found.causes] == ["gain_nonlinearity"]
    assert found.shrink is not None and found.shrink > 0.9


def pulled(load: np.ndarray, sample: float) -> np.ndarray:
    """T y' + stiffness y = 2 load. The stiffness is less by the distance of the energy from the largest one
    there was, by an error function, and whole beyond (Ogden and Roxburgh, 1999)."""
    y, most, found = 0.0, 0.0, []
    for u in load:
        found.append(y)
        for _ in range(10):
            most = max(most, y * y)
            y += sample / 10.0 / 0.5 * (2.0 * u - (1.0 - 0.35 * erf((most - y * y) / 9.0)) * y)
    return np.array(found)


@pytest.mark.long
@pytest.mark.parametrize("seed", (1, 2))
def test_rubber_that_is_stiff_again_beyond_what_it_has_seen_is_softening(seed):
    sample, rng = 0.05, np.random.default_rng(seed)
    steps = np.r_[np.zeros(10), np.repeat((0.8, 0.0, 1.5, 0.8, 2.4, 0.8, 1.5, 0.0, 2.4, 0.4, 0.0), 60)]
    triangle = 1.2 * (1.0 - np.cos(0.3 * sample * np.arange(900)))
    logs, made = [], np.split(pulled(np.r_[steps, triangle], sample), [len(steps)])
    for i, (load, y) in enumerate(zip((steps, triangle), made)):
        roles = {"command": load, "output": y + 0.02 * rng.normal(size=len(y))}
        logs.append(Experiment(str(i), sample, roles, start=i * len(steps) * sample))
    lag = LinearActuator(TransferFunction([(2.08, 0.0)], [(0.53, 1.0), (1.0, 0.0)]))
    found = diagnose(Rig("rubber", sample, TANKS.signals, lag), logs)
    assert [c.candidates[0].effect for c in found.causes] == ["softening"]
    assert found.shrink is not None and found.shrink > 0.9


def test_it_is_the_hysteretic_spring_without_its_loop():
    run = Run.of([400], [0.0], H)
    push = np.r_[np.linspace(0.0, 8.0, 200), np.linspace(8.0, 0.0, 200)]

    def bent(effect: str, form: str, *values: float) -> np.ndarray:
        placed = Placed(effect, form_of(effect, form), "actuator", values)
        return Chain(TANKS, (placed,)).run(push, "actuator", "actuator", run)

    yielding = bent("gain_nonlinearity", "yielding", 0.7, 2.0, 1.2, 15.0)
    assert np.allclose(yielding, bent("hysteresis", "sharp_spring", 0.7, 2.0, -2.0, 1.2, 15.0))
    assert np.ptp(yielding - bent("hysteresis", "sharp_spring", 0.7, 2.0, 2.0, 1.2, 15.0)) > 0.3
