"""The chain as a list of steps that signals pass through: nominal stages and effects, each at its slot."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import lags, linear, solved
from focgen.rig import plant as plants
from focgen.rig.ahead import in_step, longer, takes_time
from focgen.rig.begun import from_there, past_of, with_past
from focgen.rig.changeable import IN_STEPS
from focgen.rig.courses import sharpened
from focgen.rig.delay import centred, delayed
from focgen.rig.dynamics import FREE, SAME, STEADY, UNCHANGED, Dynamics, Lever
from focgen.rig.effects import EQUATIONS, Run
from focgen.rig.finer import at_samples, finer, parts_of
from focgen.rig.lever import levered
from focgen.rig.modes import respond
from focgen.rig.placed import EARLY, LAST, LATE, Placed
from focgen.rig.rig import UNITY, Actuator, LinearActuator, Rig
from focgen.rig.stages import STAGES
from focgen.rig.steps import Step, chamber_step, fed_step, linear_step, uneven_step
from focgen.rig.weak import can_be_solved, solved_weak, weakened


@dataclass(frozen=True)
class _Way:
    """What a signal runs through, ``first`` to ``last`` stage, what it does from one sample to the next where
    it enters, and what is told of it: as of :meth:`Chain.run`."""

    first: str
    last: str
    between: Between | bool
    tap: dict[str, Array] | None
    left: list[dict[str, float]] | None


@dataclass
class Chain:
    """A rig with effects, made to be run again and again with few things changed.

    What a step did lately is remembered by its input and parameters, so that only what comes after a changed
    one is run: twice at most, by its place. A ``probe`` runs on what others remember and leaves nothing.
    Effects that the rig is known to have come ahead of those ``placed``.
    """

    rig: Rig
    placed: tuple[Placed, ...] = ()
    remember: dict[Hashable, list[tuple[Hashable, Array, Array]]] | None = None
    probe: bool = False

    def __post_init__(self) -> None:
        if self.rig.known:
            self.placed = (*self.rig.known, *self.placed)

    def run(
        self,
        x: Array,
        first: str,
        last: str,
        run: Run,
        between: Between | bool = Between.STRAIGHT,
        tap: dict[str, Array] | None = None,
        left: list[dict[str, float]] | None = None,
    ) -> Array:
        """What leaves stage ``last`` when ``x`` (n,) enters stage ``first``.

        ``between``: what the input does from one sample to the next. ``tap`` receives what leaves each stage,
        ``left`` what outlives the session, one for each of ``placed``.
        """
        if left is not None:
            left[:] = [{} for _ in self.placed]
        return self._through(x, run, _Way(first, last, between, tap, left))

    def _through(self, x: Array, run: Run, way: _Way) -> Array:
        if run.begins:
            return self._begun(x, run, way)
        if self.rig.lead and way.between == Between.HELD and way.first == "regulator":
            return self._ahead(x, run, way)
        parts = parts_of(self.rig, way.first, way.last, run.h) if way.between == Between.HELD else 1
        if parts > 1:
            x = self._once("parts", parts, x, lambda x, run: np.repeat(x, parts), run)
            return at_samples(self._in_turn(x, finer(run, parts), way), way.tap, parts)
        return self._in_turn(x, run, way)

    def _begun(self, x: Array, run: Run, way: _Way) -> Array:
        """With what was before each experiment put ahead of it, and cut off again."""
        x = self._once("past", run.begins, x, with_past, run)
        long, kept = past_of(run)
        y = self._through(x, long, way)
        if way.tap is not None:
            way.tap.update({stage: made[kept] for stage, made in way.tap.items()})
        found: Array = y[kept]
        return found

    def _ahead(self, x: Array, run: Run, way: _Way) -> Array:
        """Of a command that was sent ahead of its rows."""
        rig, count, at_once = in_step(self.rig, way.first, way.last, run.h)
        chain = Chain(replace(rig, known=()), self.placed, self.remember, self.probe)
        if not count:
            return chain._through(x, run, way)
        long = longer(run, count)
        x = self._once("longer", count, x, lambda x, run: x[long.rows], run)
        made = chain._through(x, long.run, way)
        if way.tap is not None:
            kept = {stage: np.maximum(long.kept - at_once.get(stage, 0), 0) for stage in way.tap}
            way.tap.update({stage: way.tap[stage][rows] for stage, rows in kept.items()})
        found: Array = made[long.kept]
        return found

    def _in_turn(self, x: Array, run: Run, way: _Way) -> Array:
        """One stage after the other, at the run's own samples."""
        begin, end = STAGES.index(way.first), STAGES.index(way.last)
        keeps = {p.stage for p in self.placed if p.remembers and p.slot in EQUATIONS.values()}
        before, behind = run, run.held(x) if run.lasts else run
        between = way.between
        for stage in STAGES[begin : end + 1]:
            for number, (key, act, placed) in enumerate(self.steps(stage, between)):
                remembers = placed is not None and placed.remembers
                own = before if remembers else run
                if way.left is not None and placed is not None:
                    way.left[_index(self.placed, placed)] = placed.leaves(x, own)
                x = self._once((stage, number), (key, _stands(placed, own)), x, act, own)
                if remembers or (placed is None and stage in keeps):
                    run = behind
            if run.stands and stage == self.rig.integrator:
                x, run = self._once("stood", run.stands, x, from_there, run), run.stood
                before = behind = run
            if stage == "actuator" and self._offset:
                lying = behind.lying(x, self._offset)
                behind, run = lying, lying if run is behind else run.lying(x, self._offset)
            if way.tap is not None:
                way.tap[stage] = x
            if between != Between.STRAIGHT and takes_time(self.rig, stage):
                between = Between.STRAIGHT
        return x

    @property
    def _offset(self) -> float:
        """Where the actuator rests."""
        return 0.0 if self.rig.actuator is None else self.rig.actuator.offset

    def _once(
        self, place: Hashable, key: Hashable, x: Array, act: Callable[[Array, Run], Array], run: Run
    ) -> Array:
        if self.remember is None:
            return act(x, run)
        kept = self.remember.setdefault(place, [])
        for old_key, old_x, y in kept:
            if old_x is x and old_key == key:
                return y
        y = act(x, run)
        if not self.probe:
            kept.insert(0, (key, x, y))
            del kept[2:]
        return y

    def steps(self, stage: str, between: Between | bool) -> list[Step]:
        """What a signal passes in a stage, in order; ``between``: what it does from one sample to the
        next."""
        here = [p for p in self.placed if p.stage == stage]
        if any(p.form.leads and p.slot in EARLY for p in here):
            between = Between.STRAIGHT  # what was held is smooth behind a lag
        steps = [_effect(p) for p in here if p.slot in EARLY]
        steps += self._core(stage, here, between)
        steps += [_effect(p) for p in here if p.slot in LATE]
        if stage == "actuator" and (offset := self._offset):
            steps.append((("offset", offset), lambda x, run: x + offset, None))
        steps += [_effect(p) for p in here if p.slot in LAST]
        if stage == "sensor" and (zero := self.rig.zero):
            steps.append((("offset", zero), lambda x, run: x + zero, None))
        return steps

    def _core(self, stage: str, here: Sequence[Placed], between: Between | bool) -> list[Step]:
        delay = getattr(self.rig.delays, stage)
        if stage == "actuator":
            return _actuator(self.rig.actuator, here, between, delay)
        transfer, dynamics = getattr(self.rig, stage), _dynamics(here)
        if dynamics.pace != STEADY:
            return [uneven_step(transfer, dynamics.pace, between, delay)]
        fed = [fed_step(transfer, dynamics.supply)] if np.isfinite(dynamics.supply) else []
        if dynamics.changed - {"supply"}:
            return [*fed, chamber_step(transfer, dynamics, between, delay)]
        return fed if transfer == UNITY and not delay else [*fed, linear_step(transfer, between, delay)]


def between_of(rig: Rig, entry: str) -> Between:
    """What the input ``entry`` does from one sample to the next: as the rig says, else the command of a
    regulator, or one ahead of its rows, is held, as converters do, and what else there is runs in straight
    lines."""
    held = entry == "command" and (rig.regulator != UNITY or rig.lead != 0.0)
    return (Between.HELD if held else Between.STRAIGHT) if rig.between is None else rig.between


def _stands(placed: Placed | None, run: Run) -> tuple[float, ...]:
    """Where a pump stood, for an effect that acts by that: beside its signal, its result depends on it."""
    return run.stands if placed is not None and placed.form.adds_up else ()


def _effect(placed: Placed) -> Step:
    return (placed.effect, placed.form.name, placed.values), placed.act, placed


def _index(placed: Sequence[Placed], one: Placed) -> int:
    """Where the very one is: two of a chain may be equal."""
    return next(i for i, p in enumerate(placed) if p is one)


def _dynamics(here: Sequence[Placed]) -> Dynamics:
    """What effects of a stage change of its own equation."""
    dynamics = UNCHANGED
    for p in here:
        if p.slot in EQUATIONS.values():
            dynamics = p.form.act(dynamics, p.values, None)
    return dynamics


def _actuator(
    actuator: Actuator | LinearActuator | None, here: Sequence[Placed], between: Between | bool, delay: float
) -> list[Step]:
    drive = [_effect(p) for p in here if p.slot == "drive"]
    if actuator is None:
        return [*drive, linear_step(UNITY, between, delay)] if delay else drive
    weak = [p for p in here if p.slot == "spring"]
    dynamics = _dynamics(here)
    if dynamics.pace != STEADY:
        ahead = (("zero", actuator), lambda x, run: actuator.drive(x), None)
        return [ahead, *drive, uneven_step(actuator.dynamics, dynamics.pace, between, delay)]
    if (weak or dynamics.lever != SAME) and delay:  # what is late is what drives it
        return [*_actuator(actuator, here, between, 0.0), linear_step(UNITY, Between.STRAIGHT, delay)]
    lever, dynamics = dynamics.lever, dynamics.without("lever")
    if isinstance(actuator, LinearActuator):
        zero = [(("bias", actuator.bias), lambda x, run: actuator.drive(x), None)] if actuator.bias else []
        steps = _linear(actuator, dynamics, between, delay)
        steps = _yielding(steps, actuator, weak, dynamics, lever, between)
        return [*zero, *drive, *steps]
    line = (actuator.gain, lambda x, run: actuator.drive(x), None)
    steps = _swung(actuator.dynamics, dynamics, between, delay) or [
        _lag(1.0, actuator.T, actuator.alpha, dynamics, between, delay)
    ]
    return [line, *drive, *_yielding(steps, actuator, weak, dynamics, lever, between)]


def _yielding(
    steps: list[Step],
    actuator: Actuator | LinearActuator,
    weak: list[Placed],
    dynamics: Dynamics,
    lever: Lever,
    between: Between | bool,
) -> list[Step]:
    """The steps of an actuator with what drives it changed where it is, and with what is weak in it: solved
    for where nothing else of its equation changes, and else by turns."""
    of, alone = actuator.dynamics, dynamics == UNCHANGED
    if weak and alone and lever == SAME and can_be_solved(weak):
        return solved_weak(of, weak, between)
    if weak:
        return weakened(steps, weak, of.dc_gain, lever)
    return _levered(of, lever, between) if alone and lever != SAME else levered(steps, lever)


def _levered(of: TransferFunction, lever: Lever, between: Between | bool) -> list[Step]:
    return [
        (
            (of, lever, between),
            lambda x, run: solved.run_levered(of, x, run.rest, run.h, run.duration, between, lever),
            None,
        )
    ]


def _linear(
    actuator: LinearActuator, dynamics: Dynamics, between: Between | bool, delay: float
) -> list[Step]:
    if dynamics == UNCHANGED:
        return [linear_step(actuator.dynamics, between, delay)]
    if dynamics.flow != FREE:
        return _choked(actuator, dynamics, between, delay)
    if swung := _swung(actuator.dynamics, dynamics, between, delay):
        return swung
    plant, changed = plants.plant_of(actuator.dynamics), dynamics.changed
    if plant is not None and (changed == {"drag"} or (plant.order == 2 and changed & IN_STEPS)):
        return [_plant(plant, dynamics, between, delay)]
    lag = linear.single_lag(actuator.dynamics)
    if not lag and changed <= {"loading", "unloading"}:
        return [_two_paced(actuator.dynamics, (dynamics.loading, dynamics.unloading), between, delay)]
    if not lag:
        return [_bent(actuator.dynamics, dynamics, between, delay)]
    gain, T, alpha = lag
    borne = replace(dynamics, drag=dynamics.drag * abs(gain), preload=dynamics.preload * abs(gain))
    return [_lag(gain, T, alpha, borne, between, delay)]


def _choked(
    actuator: LinearActuator, dynamics: Dynamics, between: Between | bool, delay: float
) -> list[Step]:
    """With a highest rate: in the equation of a lag of order 1, beside other changes of that behind it."""
    others = dynamics.without("flow")
    if others.changed <= {"loading", "unloading"}:
        return [chamber_step(actuator.dynamics, dynamics, between, delay)]
    behind = chamber_step(_AT_ONCE, Dynamics(flow=dynamics.flow), Between.STRAIGHT, 0.0)
    return [*_linear(actuator, others, between, delay), behind]


def _swung(of: TransferFunction, dynamics: Dynamics, between: Between | bool, delay: float) -> list[Step]:
    """With a further mass, one more term in the equation; none without one. Where other changes are none of a
    plant's, it is run as it is, and then what the mass makes of its response."""
    if not dynamics.mass:
        return []
    light = dynamics.without("mass")
    if light == UNCHANGED or (of.is_integer and light.changed <= _OF_PLANTS):
        return _linear(LinearActuator(_heavier(of, dynamics.mass)), light, between, delay)
    swing = TransferFunction(of.den, _heavier(of, dynamics.mass).den)
    return [*_linear(LinearActuator(of), light, between, delay), linear_step(swing, Between.STRAIGHT, 0.0)]


def _heavier(of: TransferFunction, mass: float) -> TransferFunction:
    """With a ``mass`` in s² on its spring."""
    den = {t.order: t.coefficient for t in of.den}
    den[2.0] = den.get(2.0, 0.0) + mass * den[0.0]
    return TransferFunction(of.num, [(c, order) for order, c in den.items()])


def _plant(plant: plants.Plant, dynamics: Dynamics, between: Between | bool, delay: float) -> Step:
    def act(x: Array, run: Run) -> Array:
        kept = run.lasts and dynamics.keeps
        made = plants.respond(plant, x, run.rest, run.h, dynamics, between, run.rough, kept)
        return delayed(made, run.rest, run.h, delay) if delay else made

    return (plant, dynamics, between, delay), act, None


def _lag(
    gain: float, T: float, alpha: float, dynamics: Dynamics, between: Between | bool, delay: float
) -> Step:
    if dynamics.loading != 1.0:  # the compiled loops know a pace of the way up, and another's share of that
        T /= dynamics.loading**alpha
        dynamics = replace(dynamics, loading=1.0, unloading=dynamics.unloading / dynamics.loading)
    held, smooth = between == Between.HELD, between == Between.SMOOTH

    def act(x: Array, run: Run) -> Array:
        x = sharpened(np.ascontiguousarray(x, float), run.rest) if smooth else x
        return respond(gain * x, run.rest, run.h, T, alpha, run.duration, dynamics, delay, held)

    return (gain, T, alpha, dynamics, between, delay), act, None


def _bent(transfer: TransferFunction, dynamics: Dynamics, between: Between | bool, delay: float) -> Step:
    return (
        (transfer, dynamics, between, delay),
        lambda x, run: solved.run_bent(transfer, x, run.rest, run.h, between, dynamics, delay),
        None,
    )


def _two_paced(
    transfer: TransferFunction, paces: tuple[float, float], between: Between | bool, delay: float
) -> Step:
    def act(x: Array, run: Run) -> Array:
        x = centred(x, run.rest) if between == Between.HELD else x
        return lags.run_paces(transfer, x, run.rest, run.h, paces, delay)

    return (transfer, paces, between, delay), act, None


_OF_PLANTS = IN_STEPS | {"drag", "bend"}
_AT_ONCE = TransferFunction([(1.0, 0.0)], [(1e-9, 1.0), (1.0, 0.0)])
