"""The closed loop of a rig with effects, by waveform relaxation: any effect, as it is replayed.

The effects are functions of whole signals, not of one sample and a state. So the loop is solved window by
window: with a guess of the commands in the window, the rig is replayed from rest to the window's end, the
controller is run on what it would have seen, and its commands are the next guess (E. Lelarasmee, A. E. Ruehli
and A. L. Sangiovanni-Vincentelli, IEEE Trans. CAD 1, 1982). What the rig shows at a sample depends on earlier
commands only, so every pass settles at least one more sample for good, and commands that come out as they
went in are, bit for bit, those of the loop stepped sample by sample.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.control.equilibrium import Equilibrium, actuator_of
from focgen.fractional.transfer import TransferFunction
from focgen.loop.chain import substeps
from focgen.loop.run import LoopRun, farthest
from focgen.loop.stepper import Stepper
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed
from focgen.rig.replay import placed_in, session_end
from focgen.rig.rig import Rig
from focgen.rig.stages import LEAVES
from focgen.rig.turned import turn_of

_WINDOWS = 24  # that a run is cut into: the fewer, the more passes each
_PASSES = 40  # after which a window is halved
_LEAST_PARTS = 4  # of a sample: edges and limits of an effect fall between samples


@dataclass(frozen=True, eq=False)
class Plant:
    """A rig with its effects, sampled every ``sample_time`` s, simulated in ``parts`` of a sample.

    ``clock`` (s): when the session ended that every run continues from. ``lead`` samples of rest go before
    each run, where the rig's rest is not zero.
    """

    rig: Rig
    placed: tuple[Placed, ...]
    sample_time: float
    parts: int
    clock: float
    lead: int

    @classmethod
    def of(cls, rig: Rig, sample_time: float, start: Equilibrium, samples: int) -> Plant:
        """The plant for runs of ``samples`` samples from rest at ``start``. Raises RigError for effects that
        are unknown.
        """
        parts = max(_LEAST_PARTS, substeps(rig, sample_time))
        driven = start.command or actuator_of(rig).drive(start.pressure)  # at its offsets it is at rest
        lead = samples if driven else 0
        return cls(rig, placed_in(rig), sample_time, parts, session_end(rig), lead)

    def signals(self, command: Array, idle: float) -> dict[str, Array]:
        """Pressure, curvature and output, shape (n · parts + 1,), of the held ``command`` (n,): at the
        samples and between, up to the end of the last one; ``idle`` is the command before.
        """
        ahead = np.concatenate([np.full(self.lead, idle), command])
        count, h = len(ahead) * self.parts, self.sample_time / self.parts
        held = _delays(self.rig.regulator)
        # a stage that delays takes the staircase; where the command passes at once, the one just ended counts
        place = np.arange(count + 1) - (0 if held else 1)
        x = ahead[np.clip(place // self.parts, 0, len(ahead) - 1)]
        x[0] = x[0] if held else idle
        run = Run.of([count + 1], [self.clock], h)
        tap: dict[str, Array] = {}
        turn = turn_of(self.rig)
        x = turn.signs["command"] * x
        rig = replace(turn.rig(self.rig), lead=0.0)  # of logs, where there are none
        Chain(rig, self.placed).run(x, "regulator", "sensor", run, held, tap)
        made = turn.back.signals({LEAVES[stage]: y for stage, y in tap.items()})
        return {role: y[self.lead * self.parts :] for role, y in made.items()}


def _delays(regulator: TransferFunction) -> bool:
    return regulator.is_integer and bool(regulator.num) and regulator.num[0].order < regulator.den[0].order


def run_with_effects(
    plant: Plant,
    stepper: Stepper,
    reference: Array,
    start: Equilibrium,
    delay: int = 1,
    pressure_known: bool = True,
) -> LoopRun:
    """Close the loop from rest at ``start`` and follow ``reference``, shape (n, columns), as
    :func:`focgen.loop.run.run_loop` does. Every column continues the rig's session by itself.
    """
    loop = _Loop(plant, stepper, reference, start, delay, pressure_known)
    seen = loop.run()
    sampled = {name: values[: -plant.parts : plant.parts] for name, values in seen.items()}
    begun = np.full((1, seen["pressure"].shape[1]), start.pressure)
    peak = farthest(np.vstack([begun, seen["pressure"]]))
    return LoopRun(plant.sample_time, reference, loop.command, **sampled, peak_pressure=peak)


class _Loop:
    """Loops side by side, solved window by window."""

    def __init__(
        self, plant: Plant, stepper: Stepper, reference: Array, start: Equilibrium, delay: int, known: bool
    ) -> None:
        self.plant, self.stepper, self.reference = plant, stepper, reference
        self.start, self.delay, self.known = start, delay, known
        self.command: Array = np.full(reference.shape, start.command)
        self.waiting: Array = self.command[0]
        self.replayed: list[Any] = [None] * reference.shape[1]

    def run(self) -> dict[str, Array]:
        """The rig's signals on the fine grid, shape (n · parts + 1, columns); the commands are kept."""
        count = len(self.reference)
        begin, width = 0, max(1, -(-count // _WINDOWS))
        while begin < count:
            end = min(begin + width, count)
            self.command[begin:end] = self.waiting
            if self._settle(begin, end):
                begin = end
            else:
                width = max(1, width // 2)
        return self._signals(count)

    def _settle(self, begin: int, end: int) -> bool:
        """Repeat the window until its commands stay; False where that takes too long."""
        for _ in range(_PASSES):
            stepper = deepcopy(self.stepper)
            found, waiting = self._controlled(stepper, begin, end)
            same = np.array_equal(found, self.command[begin:end])
            self.command[begin:end] = found
            if same:
                self.stepper, self.waiting = stepper, waiting
                return True
        return False

    def _controlled(self, stepper: Stepper, begin: int, end: int) -> tuple[Array, Array]:
        """What the controller commands in the window, seeing what the present commands make of the rig, and
        what it has computed last.
        """
        seen, waiting = self._signals(end), self.waiting
        places = slice(begin * self.plant.parts, end * self.plant.parts, self.plant.parts)
        output, pressure = seen["output"][places], seen["pressure"][places]
        gain = self.plant.rig.regulator.dc_gain
        found = np.empty(output.shape)
        for k in range(end - begin):
            schedule = pressure[k] if self.known else waiting * gain
            computed = stepper.step(self.reference[begin + k], output[k], schedule)
            found[k] = computed if self.delay == 0 else waiting
            waiting = np.array(computed)
        return found, waiting

    def _signals(self, count: int) -> dict[str, Array]:
        columns = [self._replay(i, self.command[:count, i]) for i in range(self.command.shape[1])]
        return {name: np.stack([c[name] for c in columns], axis=1) for name in columns[0]}

    def _replay(self, column: int, command: Array) -> dict[str, Array]:
        """The rig's signals for one column's commands; those of the last pass are remembered."""
        last = self.replayed[column]
        if last is None or not np.array_equal(last[0], command):
            last = command.copy(), self.plant.signals(command, self.start.command)
            self.replayed[column] = last
        made: dict[str, Array] = last[1]
        return made
