"""Controllers and scenarios to test with: the seed's, and random ones of every kind that can be realised."""

from __future__ import annotations

import numpy as np

from focgen.control.controller import Controller, ControllerRanges, GainSchedule
from focgen.fractional.transfer import TransferFunction
from focgen.plan.scenario import Reset, Scenario, Track


def seed_controller(length: int = 1000, **changes) -> Controller:
    """Eq. (6) of the paper, its gain from eq. (7) on nine breakpoints."""
    pressure = np.linspace(0.05, 0.25, 9)
    gains = (85.66 * pressure + 6.692) / (0.0015 + 0.345 * pressure)
    given = dict(
        name="spba",
        sample_time=0.01,
        transfer=TransferFunction([(1.32, 0.6), (1.0, 0.0)]),
        gain=GainSchedule(tuple(pressure.tolist()), tuple(gains.tolist())),
        integrator=True,
        ranges=ControllerRanges((0.0, 0.02), (0.0, 0.02), (0.0, 10.0), (0.0, 0.25)),
        length=length,
    )
    return Controller(**{**given, **changes})


def simple(transfer: TransferFunction, **changes) -> Controller:
    """A controller with unit gain, ranges of ±1 and no integrator."""
    given = dict(
        name="simple",
        sample_time=0.01,
        transfer=transfer,
        gain=1.0,
        integrator=False,
        ranges=ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0)),
        length=64,
    )
    return Controller(**{**given, **changes})


# ---------------------------------------------------------------------------------- random controllers


def _model_inverse(rng, h):
    return TransferFunction([(h ** rng.uniform(-0.2, 1.0), rng.uniform(0.1, 0.95)), (1.0, 0.0)])


def _fopid(rng, h):
    terms = [(rng.normal(), 0.0), (rng.normal() * 2.0, -rng.uniform(0.05, 1.0))]
    return TransferFunction([*terms, (rng.normal() * h**0.5, rng.uniform(0.1, 1.5))])


def _fopd(rng, h):
    return TransferFunction([(rng.normal(), 0.0), (rng.normal() * h**0.5, rng.uniform(0.1, 1.9))])


def _pid(rng, h):
    return TransferFunction([(rng.uniform(0.5, 5.0), 0.0), (rng.uniform(0.0, 9.0), -1.0), (10.0 * h, 1.0)])


def _lead(rng, h):
    order, fast = rng.uniform(0.1, 1.0, 2), h ** rng.uniform(0.3, 0.9)
    return TransferFunction(
        [(fast * rng.uniform(2, 20), order[0]), (1.0, 0.0)], [(fast, order[1]), (1.0, 0.0)]
    )


def _half(rng, h):
    return TransferFunction([(1.0, 0.5)], [(h ** rng.uniform(0.1, 0.8), 0.7), (1.0, 0.0)])


def _second_order(rng, h):
    a, b = h ** rng.uniform(0.4, 1.0, 2)
    return TransferFunction(
        [(1.0, 0.0)], [(a, rng.uniform(1.0, 1.9)), (b, rng.uniform(0.2, 0.9)), (1.0, 0.0)]
    )


def _lag(rng, h):
    return TransferFunction([(1.0, 0.0)], [(h * rng.uniform(0.5, 50.0), 1.0), (1.0, 0.0)])


def _oscillator(rng, h):
    time = h * rng.uniform(2.0, 20.0)
    den = [(time**2, 2.0), (rng.uniform(0.3, 2.0) * time, 1.0), (1.0, 0.0)]
    return TransferFunction([(time, 1.0), (1.0, 0.0)], den)


def _integrating(rng, h):
    low = rng.uniform(0.2, 1.0)
    return TransferFunction(
        [(1.0, 0.0), (h**0.3, 0.4)], [(h ** rng.uniform(0.3, 0.8), low + 0.7), (1.0, low)]
    )


_KINDS = (_model_inverse, _fopid, _fopd, _pid, _lead, _half, _second_order, _lag, _oscillator, _integrating)


def random_controller(seed: int, longest: int = 120) -> Controller:
    """A controller of a random kind, scale, sample time, memory and schedule; not all can be planned."""
    rng = np.random.default_rng([seed, 7])
    kind = _KINDS[seed % len(_KINDS)]
    h = float(10.0 ** rng.uniform(-4.0, 0.0))
    unit, force = 10.0 ** rng.uniform(-5.0, 5.0), 10.0 ** rng.uniform(-3.0, 3.0)
    integrator = bool(rng.random() < (0.8 if kind is _model_inverse else 0.3))
    gain, schedule = _random_gain(rng, force / unit / (h ** rng.uniform(0.0, 1.0) if integrator else 1.0))
    return Controller(
        name=f"{kind.__name__.strip('_')}_{seed}",
        sample_time=h,
        transfer=kind(rng, h),
        gain=gain,
        integrator=integrator,
        ranges=ControllerRanges(
            *(_random_range(rng, unit) for _ in "rm"), _random_range(rng, force), schedule
        ),
        length=int(rng.integers(1, longest + 1)),
    )


def _random_range(rng, unit: float) -> tuple[float, float]:
    low, high = {0: (0.0, 1.0), 1: (-1.0, 1.0), 2: (0.2, 1.0), 3: (-1.0, -0.1), 4: (-0.3, 1.0)}[
        int(rng.integers(5))
    ]
    size = unit * rng.uniform(0.5, 2.0)
    return low * size, high * size


def _random_gain(rng, size: float):
    if rng.random() < 0.4:
        return float(size * rng.normal()), None
    low, high = _random_range(rng, 10.0 ** rng.uniform(-2.0, 2.0))
    inside = np.sort(rng.uniform(low, high, int(rng.integers(2, 9))))
    stretch = rng.choice([1.0, 1.3])
    points = np.unique((inside - low) * stretch + low)
    gains = size * rng.uniform(0.2, 2.0, len(points)) * rng.choice([-1.0, 1.0])
    return GainSchedule(tuple(points.tolist()), tuple(gains.tolist())), (low, high)


# ------------------------------------------------------------------------------------------- scenarios


def random_scenario(
    controller: Controller, seed: int, lanes: int = 4, samples: int = 250, wild: bool = False
) -> Scenario:
    """Steps, noise, ramps and rests, resets and tracks, in physical units; ``wild`` leaves the ranges at
    times.
    """
    rng = np.random.default_rng([seed, 11])
    ranges, shape = controller.ranges, (lanes, samples)
    sched = _signal(rng, ranges.schedule, shape, wild) if controller.scheduled else None
    resets = tuple(
        Reset(
            lane, at, *(float(rng.uniform(*r)) for r in (ranges.reference, ranges.measurement, ranges.output))
        )
        for lane in range(lanes)
        for at in sorted(rng.choice(samples, int(rng.integers(0, 3)), replace=False).tolist())
    )
    tracks = tuple(
        Track(lane, int(rng.integers(samples)), float(rng.uniform(*ranges.output)))
        for lane in range(lanes)
        if rng.random() < 0.5
    )
    inputs = (_signal(rng, r, shape, wild) for r in (ranges.reference, ranges.measurement))
    return Scenario(*inputs, sched, resets, tracks)


def _signal(rng, reach: tuple[float, float], shape: tuple[int, int], wild: bool) -> np.ndarray:
    """In [low, high]: one kind of signal a lane; ``wild`` stretches it by a fifth."""
    low, high = reach
    rows = np.stack([_row(rng, shape[1]) for _ in range(shape[0])])
    if wild:
        rows = rows * 1.4 - 0.2
    return np.clip(low + (high - low) * rows, *(reach if not wild else (-np.inf, np.inf)))


def _row(rng, samples: int) -> np.ndarray:
    """One signal in 0 … 1."""
    kind = int(rng.integers(5))
    if kind == 0:
        return rng.uniform(0.0, 1.0, samples)
    if kind == 1:
        return np.repeat(rng.uniform(0.0, 1.0, samples), int(rng.integers(5, 60)))[:samples]
    if kind == 2:
        return rng.integers(0, 2, samples).astype(float)
    if kind == 3:
        return 0.5 + 0.5 * np.sin(np.arange(samples) * rng.uniform(0.01, 0.5))
    return np.clip(rng.uniform() + np.cumsum(rng.normal(0.0, 0.02, samples)), 0.0, 1.0)
