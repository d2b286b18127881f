"""Rigs at random: the true one, and the nominal one that a case is given."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.fractional.transfer import TransferFunction
from focgen.present import present
from focgen.rig.rig import Actuator, LinearActuator, Rig, Signals


@dataclass(frozen=True)
class Units:
    """What one bar, one 1/mm and one V are in this rig's units, and their names."""

    pressure: float
    curvature: float
    command: float
    names: dict[str, str]


_PRESSURES = ((1.0, "bar"), (100.0, "kPa"), (0.1, "MPa"))
_CURVATURES = ((1.0, "per_mm"), (1000.0, "per_m"), (4000.0, "deg"))
_COMMANDS = ((1.0, "V"), (1000.0, "mV"), (10.0, "pct"))


def draw_units(rng: np.random.Generator) -> Units:
    """Units of a chain at random, the seed's own in half of the cases."""
    picks = [
        choices[0 if rng.random() < 0.5 else rng.integers(len(choices))]
        for choices in (_PRESSURES, _CURVATURES, _COMMANDS)
    ]
    names = dict(zip(("pressure", "curvature", "command"), (p[1] for p in picks)))
    return Units(picks[0][0], picks[1][0], picks[2][0], names)


def draw_chain(rng: np.random.Generator, signals: str, sample_time: float) -> tuple[Rig, float]:
    """A true chain and the command (its units) that reaches the top of its range.

    ``signals``: C logs command, pressure, curvature and output; B lacks curvature; A has command and output.
    """
    units = draw_units(rng)
    top = rng.uniform(0.15, 0.35) * units.pressure
    full = rng.uniform(0.008, 0.02) * units.curvature
    regulator, gain = draw_regulator(rng, units)
    pole = rng.uniform(6.0, 16.0)
    rig = Rig(
        name=f"rig{rng.integers(1000)}",
        sample_time=sample_time,
        signals=columns_of(units, signals),
        actuator=Actuator(
            rng.uniform(0.6, 2.2), rng.uniform(0.5, 0.8), _draw_gain(rng, top, full), _draw_offset(rng, full)
        ),
        regulator=regulator,
        sensor=TransferFunction([(pole, 0.0)], [(1.0, 1.0), (pole, 0.0)]),
    )
    return rig, top / gain


def _draw_gain(rng: np.random.Generator, top: float, full: float) -> tuple[float, ...]:
    """K(p) whose drive K(p) p reaches ``full`` at ``top``: mostly a rising line, sometimes constant."""
    if rng.random() < 0.2:
        return (full / top,)
    low = rng.uniform(0.15, 0.7)
    return (low * full / top, (1.0 - low) * full / top**2)


def _draw_offset(rng: np.random.Generator, full: float) -> float:
    """A zero that was not quite zero, in a quarter of the rigs."""
    return rng.uniform(-0.03, 0.03) * full if rng.random() < 0.25 else 0.0


def draw_regulator(rng: np.random.Generator, units: Units) -> tuple[TransferFunction, float]:
    """A regulator at random, and its gain."""
    gain = rng.uniform(0.05, 0.12) * units.pressure / units.command
    if rng.random() < 0.3:
        tau = rng.uniform(0.03, 0.08)
        return TransferFunction([(gain, 0.0)], [(tau, 1.0), (1.0, 0.0)]), gain
    natural, damping = rng.uniform(20.0, 45.0), rng.uniform(0.6, 0.95)
    den = [(1.0, 2.0), (2.0 * damping * natural, 1.0), (natural**2, 0.0)]
    return TransferFunction([(gain * natural**2, 0.0)], den), gain


def columns_of(units: Units, signals: str) -> Signals:
    """The columns that logs of ``signals`` C, B or A have, named after their units."""
    unit = units.names
    return Signals(
        time="t_s",
        command=f"u_{unit['command']}",
        pressure=f"p_{unit['pressure']}" if signals in "CB" else None,
        curvature=f"kappa_cam_{unit['curvature']}" if signals == "C" else None,
        output=f"kappa_{unit['curvature']}",
    )


def draw_linear(rng: np.random.Generator, sample_time: float) -> tuple[Rig, float]:
    """A true rig of one stage (thermal, electrical, hydraulic …), and its full command."""
    full_in, full_out = 10.0 ** rng.uniform(-1, 3), 10.0 ** rng.uniform(-2, 3)
    gain = full_out / full_in
    kind = rng.integers(3)
    actuator: Actuator | LinearActuator
    if kind == 0:
        actuator = Actuator(rng.uniform(0.5, 2.0), rng.uniform(0.55, 0.9), (gain,))
    elif kind == 1:
        tau = rng.uniform(0.4, 1.5)
        actuator = LinearActuator(TransferFunction([(gain, 0.0)], [(tau, 1.0), (1.0, 0.0)]))
    else:
        natural, damping = rng.uniform(1.5, 5.0), rng.uniform(0.6, 1.3)
        den = [(1.0, 2.0), (2.0 * damping * natural, 1.0), (natural**2, 0.0)]
        actuator = LinearActuator(TransferFunction([(gain * natural**2, 0.0)], den))
    signals = Signals(time="time", command="input", output="response")
    return Rig(f"plant{rng.integers(1000)}", sample_time, signals, actuator), full_in


def nominal_of(rig: Rig, rng: np.random.Generator, scatter: tuple[float, float]) -> Rig:
    """The rig as its owner believes it to be: nominal parameters off by ``scatter`` (low, high), either way.

    The order of the fractional stage is off by half as much; an offset, and the zero of a drive, are not
    known at all.
    """
    exact = scatter == (0.0, 0.0)
    actuator = rig.actuator
    if actuator is None:
        raise ValueError("the rig has no actuator")
    offset, bias = (actuator.offset, getattr(actuator, "bias", 0.0)) if exact else (0.0, 0.0)

    def off(value: float, share: float = 1.0) -> float:
        made: float = value * (1.0 + share * rng.uniform(*scatter) * rng.choice((-1.0, 1.0)))
        return made

    believed: Actuator | LinearActuator
    if isinstance(actuator, Actuator):
        gain = tuple(off(g) for g in actuator.gain)
        believed = Actuator(off(actuator.T), min(off(actuator.alpha, 0.5), 0.95), gain, offset)
    else:
        num = [(off(t.coefficient), t.order) for t in actuator.dynamics.num]
        den = [
            (t.coefficient if t.order == 0 else off(t.coefficient), t.order) for t in actuator.dynamics.den
        ]
        believed = LinearActuator(TransferFunction(num, den), offset, bias)
    return replace(rig, actuator=believed)


def in_time_unit(rig: Rig, unit: float) -> Rig:
    """The same rig when every second becomes ``unit`` seconds."""

    def slowed(transfer: TransferFunction) -> TransferFunction:
        return TransferFunction(
            *(
                [(t.coefficient * unit**t.order, t.order) for t in part]
                for part in (transfer.num, transfer.den)
            )
        )

    actuator = rig.actuator
    if isinstance(actuator, Actuator):
        actuator = replace(actuator, T=actuator.T * unit**actuator.alpha)
    else:
        actuator = replace(present(actuator), dynamics=slowed(present(actuator).dynamics))
    return replace(
        rig,
        sample_time=rig.sample_time * unit,
        actuator=actuator,
        regulator=slowed(rig.regulator),
        sensor=slowed(rig.sensor),
    )
