"""A generated controller as a Python object: its C, and one state."""

from __future__ import annotations

from enum import IntFlag
from pathlib import Path
from typing import Any, Literal, NoReturn, Self, overload

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Numbers
from focgen.errors import InputError
from focgen.plan.plan import FLAG_HIGH, FLAG_INPUT, FLAG_INVALID, FLAG_LOW, FLAG_SCHEDULE, Format, Plan
from focgen.plan.scenario import Params
from focgen.plan.tuning import REFUSED_GAIN, REFUSED_HIGH, REFUSED_LOW
from focgen.running.machine import Machine
from focgen.running.signals import Counts, Physical

_REFUSED = {REFUSED_GAIN: "gain", REFUSED_LOW: "u_min", REFUSED_HIGH: "u_max"}


class Flags(IntFlag):
    """What a step says of itself, the bits of NAME_flags."""

    HIGH = FLAG_HIGH
    LOW = FLAG_LOW
    SCHEDULE = FLAG_SCHEDULE
    INPUT = FLAG_INPUT
    INVALID = FLAG_INVALID


class LoadedController:
    """One controller, as :func:`focgen.load` gives it: each has a state of its own and starts after init.

    In the units of controller.toml, or in counts with ``raw``. Bit for bit what the C does on any processor.
    Errors of a call are InputErrors that name the argument; no call that raises one changes the state.

    ``plan`` describes what is computed, ``path`` is the folder, ``differences`` what has been edited in it.
    """

    def __init__(
        self, plan: Plan, machine: Machine, path: Path, raw: bool, differences: tuple[str, ...] = ()
    ) -> None:
        self.plan, self.path, self.raw, self.differences = plan, path, raw, differences
        self._machine, self._state = machine, machine.state()
        self._signals = Counts() if raw else Physical()

    @property
    def name(self) -> str:
        """The controller's name in C."""
        return self.plan.name

    @property
    def sample_time(self) -> float:
        """Seconds between two steps."""
        return self.plan.sample_time

    @property
    def scheduled(self) -> bool:
        """Whether ``step`` and ``run`` take a scheduling signal."""
        return self.plan.schedule is not None

    @property
    def flags(self) -> Flags:
        """Of the latest step; none after init and reset."""
        return Flags(self._machine.flags(self._state))

    def init(self) -> None:
        """Start at rest: no error so far, the output at 0 or the end nearest to it."""
        self._machine.init(self._state)

    def reset(self, ref: float, meas: float, u0: float) -> None:
        """Start without a bump: the error has been ref − meas for ever, and the output is at ``u0``."""
        plan = self.plan
        given = self._one("ref", ref, plan.error), self._one("meas", meas, plan.error)
        self._machine.reset(self._state, *given, self._one("u0", u0, plan.output))

    def track(self, u: float) -> None:
        """The plant has got ``u`` instead of the output: go on from there."""
        self._machine.track(self._state, self._one("u", u, self.plan.output))

    def step(self, ref: float, meas: float) -> float:
        """One sample; the output."""
        return self._step(ref, meas)

    @overload
    def run(self, ref: ArrayLike, meas: ArrayLike, *, with_flags: Literal[False] = False) -> Numbers: ...

    @overload
    def run(
        self, ref: ArrayLike, meas: ArrayLike, *, with_flags: Literal[True]
    ) -> tuple[Numbers, Numbers]: ...

    def run(self, ref: ArrayLike, meas: ArrayLike, *, with_flags: bool = False) -> Any:
        """A step for each sample, from the present state on; the outputs, shape (samples,).

        A single number stands for one that does not change. ``with_flags`` returns (outputs, flags).
        """
        return self._run((("ref", ref), ("meas", meas)), with_flags)

    @property
    def tunable(self) -> bool:
        """Whether it has ``default``, ``check`` and ``tune``: it was generated with --tunable."""
        return self.plan.tuning is not None

    def default(self) -> Params:
        """The parameters that controller.toml describes: factors of 1, the widest limits."""
        self._check_tunable("default")
        made, plan = self._machine.params(), self.plan
        gain = tuple(self._signals.back(count, plan.box.factor) for count in made.gain)
        ends = (self._signals.back(end, plan.output) for end in (made.u_min, made.u_max))
        return Params(gain, *ends)

    def check(self, params: Params) -> int:
        """What NAME_check says: 0 inside the box that everything is proved for; else the sum of 1 for a gain,
        2 for ``u_min``, 4 for ``u_max``.
        """
        given = self._params("check", params)
        return self._machine.check(given)

    def tune(self, params: Params) -> None:
        """Go on with other parameters from the next step: a factor on each gain of the schedule, and the
        limits of the output; ``dataclasses.replace(controller.default(), u_max=6.0)`` changes one.

        Raises InputError, and changes nothing, where ``check`` refuses them.
        """
        given = self._params("tune", params)
        refused = self._machine.tune(self._state, given)
        if refused:
            names = [name for bit, name in _REFUSED.items() if refused & bit]
            what = f"{' and '.join(names)} of {params} outside the box of [tunable]"
            raise InputError(f"{self.name}: tune", what, "give what check(params) says 0 to")

    def new(self) -> Self:
        """Another controller of the same C, after init."""
        return type(self)(self.plan, self._machine, self.path, self.raw, self.differences)

    def copy(self) -> Self:
        """Another controller that stands where this one does."""
        made = self.new()
        made._state = self._machine.state(self._machine.content(self._state))
        return made

    def counts(self) -> Self:
        """Another controller of the same C, after init, in counts."""
        return type(self)(self.plan, self._machine, self.path, True, self.differences)

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self.copy()

    def __reduce__(self) -> NoReturn:
        raise TypeError("compiled C cannot be pickled: load the folder in each process")

    def __repr__(self) -> str:
        plan, units = self.plan, self.plan.controller.units
        memory = f"{plan.states} modes" if plan.exponential else f"{plan.length} past samples"
        signals = "counts" if self.raw else f"{units.measurement or '1'} -> {units.output or '1'}"
        edited = ", edited" if self.differences else ""
        kind = f"{plan.arithmetic}, {memory}, {plan.sample_time:g} s"
        return f"<{type(self).__name__} {plan.name}: {kind}, {signals}{edited}>"

    # ----------------------------------------------------------------------------------------- the calls

    def _check_tunable(self, call: str) -> None:
        if not self.tunable:
            raise InputError(f"{self.name}: {call}", "has no parameters", "generate it with --tunable")

    def _params(self, call: str, given: Params) -> Any:
        """NAME_params of what was given."""
        self._check_tunable(call)
        if not isinstance(given, Params):
            raise InputError(f"{self.name}: params", f"is {given!r}", "change what default() gives")
        box, count = self.plan.box, len(self.plan.box.nominal)
        several: Any = given.gain
        if not isinstance(several, (tuple, list)) and not (
            isinstance(several, np.ndarray) and several.ndim == 1
        ):
            what = f"is of the type {type(several).__name__}"
            raise InputError(f"{self.name}: gain", what, "give a tuple of a factor for each gain")
        factors = tuple(self._one("gain", factor, box.factor) for factor in several)
        if len(factors) != count:
            what, remedy = f"has {len(factors)} factors for {count} gains", "give one for each gain"
            raise InputError(f"{self.name}: gain", what, remedy)
        ends = (self._one(name, getattr(given, name), self.plan.output) for name in ("u_min", "u_max"))
        return self._machine.params(Params(factors, *ends))

    def _one(self, name: str, value: Any, form: Format) -> int | float:
        return self._signals.one(f"{self.plan.name}: {name}", value, form)

    def _step(self, ref: float, meas: float, *sched: int | float) -> float:
        error = self.plan.error
        given = self._one("ref", ref, error), self._one("meas", meas, error)
        u: float = self._signals.back(self._machine.step(self._state, *given, *sched), self.plan.output)
        return u

    def _run(self, inputs: tuple[tuple[str, ArrayLike], ...], with_flags: bool) -> Any:
        u, flags = self._machine.loop(self._state, self._rows(inputs))
        outputs = self._signals.back(u, self.plan.output)
        return (outputs, flags) if with_flags else outputs

    def _rows(self, inputs: tuple[tuple[str, ArrayLike], ...]) -> list[Numbers]:
        """Raw inputs of one length."""
        forms = dict(ref=self.plan.error, meas=self.plan.error)
        if self.plan.schedule:
            forms["sched"] = self.plan.schedule.signal
        rows = [self._signals.many(f"{self.name}: {name}", values, forms[name]) for name, values in inputs]
        try:
            return [np.ascontiguousarray(row) for row in np.broadcast_arrays(*rows, np.empty(1, bool))[:-1]]
        except ValueError:
            sizes = ", ".join(f"{name} {row.size}" for (name, _), row in zip(inputs, rows))
            what = f"the inputs have different lengths: {sizes}"
            raise InputError(self.name, what, "give one value for each sample") from None


class ScheduledController(LoadedController):
    """One whose gain is scheduled: ``step`` and ``run`` take the scheduling signal, too."""

    def step(self, ref: float, meas: float, sched: float) -> float:  # type: ignore[override]
        """One sample; the output."""
        schedule: Any = self.plan.schedule
        return self._step(ref, meas, self._one("sched", sched, schedule.signal))

    def run(  # type: ignore[override]
        self, ref: ArrayLike, meas: ArrayLike, sched: ArrayLike, *, with_flags: bool = False
    ) -> Any:
        """A step for each sample, from the present state on; the outputs, shape (samples,).

        A single number stands for one that does not change. ``with_flags`` returns (outputs, flags).
        """
        return self._run((("ref", ref), ("meas", meas), ("sched", sched)), with_flags)
