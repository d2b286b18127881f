"""How fast a rig is, whether it comes to rest, and whether it runs away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.errors import RigError
from focgen.fractional.decomposition import dense
from focgen.fractional.poles import first_sheet_zeros
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.rig import LinearActuator, Rig

_GROWN = 25.0  # time constants that a pole may grow for: beyond, what it makes is no signal of a rig


def response_time(rig: Rig, h: float, record: float) -> float:
    """When the nominal chain's response to a step passes 63 % of its value at a third of the record, in s; of
    a rig that integrates, when its rate does, for its response never settles; of one that lets no constant
    through, when its integral does, for its response comes back to 0."""
    count = int(min(max(record / h / 3, 20), 20_000))
    span = max(record / 3 / count, h)
    run = Run.of([count + 1], [0.0], span)
    y = Chain(rig).run(np.r_[0.0, np.ones(count)], "regulator", "sensor", run)
    y = y - y[0]
    count = _integrations(rig)
    y = np.diff(y, count) if count >= 0 else _summed(y, -count)
    passed = np.abs(y) >= 0.63 * abs(y[-1])
    return float(np.clip(span * max(int(np.argmax(passed)), 1), 3 * h, record / 3))


def with_loops(rig: Rig, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The logs of a rig of gains above 0, open where a command that answers a reading would show no
    controller: of a rig that answers at once against what it comes to, or comes to nothing, the reading
    answers the command like that."""
    run = Run.of([3], [0.0], logs[0].sample_time)
    y = Chain(rig).run(np.r_[0.0, 1.0, 1.0], "regulator", "sensor", run)
    if _integrations(rig) >= 0 and y[2] >= y[0]:
        return tuple(logs)
    return tuple(replace(log, open_loop=True) for log in logs)


def integrations(rig: Rig) -> int:
    """How often the rig integrates its input: 0 where a constant one brings it to rest, at 0 or elsewhere."""
    return max(_integrations(rig), 0)


def _summed(y: Array, count: int) -> Array:
    for _ in range(count):
        y = np.cumsum(y)
    return y


def _integrations(rig: Rig) -> int:
    """The same; below 0 of a rig that differentiates, as one whose sensor lets no constant through."""
    stages = [rig.regulator, rig.sensor]
    if isinstance(rig.actuator, LinearActuator):
        stages.append(rig.actuator.dynamics)
    return sum(int(min(t.order for t in s.den)) - int(min(t.order for t in s.num)) for s in stages)


def longest(logs: Sequence[Experiment]) -> float:
    """How long the longest of the logs takes, s."""
    return max(len(log) * log.sample_time for log in logs)


def check_bounded(rig: Rig, seconds: float) -> None:
    """Raises RigError where a stage of the nominal rig grows by itself, by more than e²⁵ in so many
    ``seconds``: run for so long it would leave all numbers. And where its poles cannot be located."""
    stages = {"regulator": rig.regulator, "sensor": rig.sensor}
    if isinstance(rig.actuator, LinearActuator):
        stages["actuator"] = rig.actuator.dynamics
    for name, transfer in stages.items():
        where = f"{rig.name} [{name}]"
        try:
            rate = _growth(transfer)
        except ArithmeticError as reason:
            remedy = "check the coefficients and orders of its den"
            raise RigError(where, f"its poles cannot be located: {reason}", remedy) from None
        if rate * seconds > _GROWN:
            what = f"grows by itself, by a factor of e every {1.0 / rate:.3g} s"
            raise RigError(where, what, "check the signs and orders of its den")


def _growth(transfer: TransferFunction) -> float:
    """The largest real part of a pole, 1/s; 0 where there is none. Raises ArithmeticError where the poles
    cannot be located."""
    whole = transfer.is_integer
    poles = np.roots(dense(transfer.den)) if whole else first_sheet_zeros(transfer.den, 0.5 * np.pi)
    return max((float(pole.real) for pole in poles), default=0.0)
