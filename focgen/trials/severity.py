"""How strong an effect is, and whether these logs can show it.

*Gap*: root mean square over all samples of the session, at the output of the effect's own stage and without
noise, of the rig with the effect minus the same rig without it, as a share of that signal's span. The
amplitude is found by bisection so that the gap is the severity's: low 3 %, mid 8 %, high 20 %, or the form's
largest.

*Surviving gap*: what is left of it, in the logged signals, once the nominal parameters of the rig have been
refitted: the projection off their sensitivities. Those of the actuator (T, alpha, gain or num and den,
offset, the zero of an integrating one's drive) move freely, gain and times of regulator and sensor by three
times their uncertainty. Every column may be out of step by half a sample, and read half a per cent of its
span more or less from one experiment to the next, as loggers and gauges are. Each signal is weighted by its
noise. *Visible*: in at least one logged signal the surviving gap is 0.3 of the noise or more, both root mean
square.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.rig.corners import EXACT, moved
from focgen.rig.rig import UNITY, Actuator, LinearActuator, Relative, Rig
from focgen.rig.stages import LEAVES
from focgen.trials.forms import Drawn
from focgen.trials.machine import Machine, Session, Setting

SEVERITIES = {"low": 0.03, "mid": 0.08, "high": 0.20}
VISIBLE = 0.3
_USUAL = 3.0  # times the uncertainty of what was given: as far off is no fault
_OUT_OF_STEP = 0.5  # of a sample: what a logger leaves open
_ZERO = 0.005  # of a span: what the zero of a gauge differs by from one experiment to the next
_BELOW = 0.99  # an order that can be moved either way and stays below 1


@dataclass(frozen=True, eq=False)
class Trial:
    """What the rig goes through: commands on the grid of step ``h`` s, and the session's clock at each."""

    commands: Sequence[Array]
    clocks: Sequence[float]
    h: float

    def signals(self, rig: Rig, settings: Sequence[Setting] = ()) -> dict[str, Array]:
        """Noise-free pressure, curvature and output (N,) of all experiments, one after the other."""
        session = Session(Machine(rig, tuple(settings)), self.h)
        traces = [session.run(command, clock) for command, clock in zip(self.commands, self.clocks)]
        found = {
            name: np.concatenate([getattr(t, name) for t in traces])
            for name in ("pressure", "curvature", "output")
        }
        found["output"] = session.read(found["output"])
        return found


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def calibrate(drawn: Drawn, rig: Any, trial: Any, target: float) -> tuple[Setting, float]:
    """The setting whose gap is ``target`` (share of the span), or the form's largest; and the gap it has."""
    name = LEAVES[drawn.stage]
    without = trial.signals(rig)[name]
    span = float(np.ptp(without))

    def gap(a: float) -> float:
        return rms(trial.signals(rig, [drawn.at(a)])[name] - without) / span

    low, high = np.log(drawn.form.low), np.log(drawn.form.high)
    best = drawn.form.high, gap(drawn.form.high)
    if best[1] <= target:
        return drawn.at(best[0]), best[1]
    for _ in range(14):
        a = float(np.exp(0.5 * (low + high)))
        now = gap(a)
        low, high = (np.log(a), high) if now < target else (low, np.log(a))
        best = min(best, (a, now), key=lambda pair: abs(pair[1] - target))
        if abs(now / target - 1.0) < 0.02:
            break
    return drawn.at(best[0]), best[1]


def surviving(rig: Rig, trial: Trial, gap: Mapping[str, Array], noise: dict[str, float]) -> dict[str, float]:
    """Root mean square of what a refit of the nominal parameters leaves of ``gap``, signal by signal, over
    its noise.

    ``gap`` and ``noise`` (rms) carry the logged signals only.
    """
    base = trial.signals(rig)
    ways: list[tuple[dict[str, Array], float]] = [
        ({n: (trial.signals(other)[n] - base[n]) / step for n in gap}, most)
        for other, step, most in (*((*move, np.inf) for move in moved_rigs(rig)), *_scaled_rigs(rig))
    ]
    ways += _logged_otherwise({n: base[n] for n in gap}, trial, rig.sample_time)
    columns = np.stack([_stacked(way, noise) for way, _ in ways], axis=1)
    target = _stacked(gap, noise)
    rest = target - _refitted(columns, np.array([most for _, most in ways]), target)
    return {name: rms(part) for name, part in zip(gap, np.split(rest, len(gap)))}


def _logged_otherwise(
    signals: Mapping[str, Array], trial: Trial, Ts: float
) -> Iterator[tuple[dict[str, Array], float]]:
    """What a column a sample late, and another zero of a gauge in one experiment, change of the ``signals``
    (n,), and how many times that they may do so."""
    ends = np.cumsum([len(command) for command in trial.commands])
    for name, values in signals.items():
        bare = {other: np.zeros_like(values) for other in signals}
        parts = np.split(values, ends[:-1])
        late = np.concatenate([-np.gradient(part, trial.h) * Ts for part in parts])
        yield bare | {name: late}, _OUT_OF_STEP
        for end, part in zip(ends, parts):
            zero = np.zeros_like(values)
            zero[end - len(part) : end] = np.ptp(values)
            yield bare | {name: zero}, _ZERO


def _refitted(columns: Array, most: Array, target: Array) -> Array:
    """What of ``columns`` (n, k), each ``most`` (k,) times at most, up or down, is closest to ``target``."""
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    basis, upper = np.linalg.qr(columns / size)
    times = lsq_linear(upper, basis.T @ target, (-most * size, most * size), tol=1e-12).x
    made: Array = basis @ (upper @ times)
    return made


def _stacked(signals: Mapping[str, Array], noise: dict[str, float]) -> Array:
    return np.concatenate([signals[name] / noise[name] for name in signals])


def below_one(rig: Rig) -> Rig:
    """The rig with an order below 1, where the generator's scheme holds and the order can be moved either
    way."""
    if not isinstance(rig.actuator, Actuator) or rig.actuator.alpha <= _BELOW:
        return rig
    return replace(rig, actuator=replace(rig.actuator, alpha=_BELOW))


def moved_rigs(rig: Rig) -> Iterator[tuple[Rig, float]]:
    """The rig with each of its nominal parameters moved a little, and by how much."""
    actuator, small = rig.actuator, 1e-3
    if actuator is None:
        return
    if isinstance(actuator, Actuator):
        yield replace(rig, actuator=replace(actuator, T=actuator.T * (1 + small))), small
        yield replace(rig, actuator=replace(actuator, alpha=actuator.alpha + small)), small
        for i, g in enumerate(actuator.gain):
            gain = [*actuator.gain[:i], g * (1 + small), *actuator.gain[i + 1 :]]
            yield replace(rig, actuator=replace(actuator, gain=tuple(gain))), small
    else:
        for other in _moved_linear(actuator, small):
            yield replace(rig, actuator=other), small
        if actuator.integrates:
            yield replace(rig, actuator=replace(actuator, bias=actuator.bias + 1.0)), 1.0
    yield replace(rig, actuator=replace(actuator, offset=actuator.offset + 1.0)), 1.0


def _scaled_rigs(rig: Rig) -> Iterator[tuple[Rig, float, float]]:
    """The rig with gain or times of regulator or sensor a little larger, by how much, and by how much they
    may be without being a fault."""
    small = 1e-3
    for stage in ("regulator", "sensor"):
        known = getattr(rig.uncertainty, stage)
        for off, most in ((Relative(small, 0.0), known.gain), (Relative(0.0, small), known.time)):
            if getattr(rig, stage) != UNITY and most > 0.0:
                yield moved(rig, replace(EXACT, **{stage: off})), small, _USUAL * most


def _moved_linear(actuator: LinearActuator, small: float) -> Iterator[LinearActuator]:
    transfer = actuator.dynamics
    for part in ("num", "den"):
        terms = getattr(transfer, part)
        for i, t in enumerate(terms):
            if part == "den" and t.order == 0.0:
                continue
            changed = [*terms[:i], (t.coefficient * (1 + small), t.order), *terms[i + 1 :]]
            sides = {"num": transfer.num, "den": transfer.den, part: changed}
            yield replace(actuator, dynamics=TransferFunction(sides["num"], sides["den"]))
