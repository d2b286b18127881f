"""``focgen study memory`` as one function."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from focgen.arguments import checked
from focgen.codegen.kernels import TARGETS
from focgen.control.controller import Controller
from focgen.control.equilibrium import derived_ranges, holding, rest
from focgen.control.files import ControllerLike, controller_from
from focgen.control.setpoints import default_setpoints
from focgen.control.units import check_one_unit
from focgen.custody import sha256_within
from focgen.errors import ControllerError, DesignError, InputError, check_choice
from focgen.fractional.transfer import TransferFunction
from focgen.replaced import check_own
from focgen.rig.arguments import RigLike, file_of, rig_of
from focgen.rig.files import read_rig
from focgen.rig.rig import Rig
from focgen.scratch import temporary_folder
from focgen.spelling import respelled
from focgen.studies.grid import Grid, grid_of
from focgen.studies.jobs import Job, read_ideal, read_plant, read_row
from focgen.studies.operator import fractional_terms
from focgen.studies.operators import Choice, chosen, compared_band, continuous_variants
from focgen.studies.plant import exact_step, plant_of, plant_times
from focgen.studies.recommend import Requirement, leanest, pareto, sentence, shortest
from focgen.studies.results import Curves, Ideal, Plant, PlantRow, Row, Setup, Study, Variant
from focgen.studies.spectrum import band_of
from focgen.studies.store import Store
from focgen.studies.sweep import Workers, sweep
from focgen.studies.write import WRITTEN, write
from focgen.textfile import LARGEST_SETTING

SUBJECTS = ("memory",)
SAMPLES = 10_000  # of the open-loop inputs


@respelled({"memories": "memory", "arithmetics": "arithmetic"})
@checked
def study(
    subject: str,
    controller: ControllerLike,
    out: str | Path | None = None,
    *,
    rig: RigLike | None = None,
    memory: Sequence[str] | None = None,
    lengths: Sequence[int] | None = None,
    tolerances: Sequence[float] | None = None,
    horizon: int | None = None,
    arithmetic: Sequence[str] | None = None,
    sample_times: Sequence[float] | None = None,
    setpoints: Sequence[float] | None = None,
    target: str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
) -> Study:
    """Study a controller's ``subject``; "memory" is the one there is: sweep memory form, length or tolerance,
    arithmetic and sample time, and write the study into the folder ``out`` where given.

    ``controller``: a :class:`Controller`, its file, or a dictionary like it. ``rig``: what closes the loop;
    by default the rig that the controller's file says it was designed from, where it is found beside it,
    unchanged. ``memory``: forms, of "short" and "exponential"; ``lengths`` in past samples; ``tolerances``
    and ``horizon`` (samples at the controller's own sample time) of the exponential form; ``sample_times`` in
    s; ``setpoints``: outputs stepped to from rest. ``target``: the core that cycles are counted on.
    ``jobs``: processes at a time (default: the cores); ``scheduler``: address of a Dask scheduler that does
    the work instead.

    What has been measured stays in ``out``/rows and is not measured again for the same inputs, so that an
    interrupted study goes on. Raises InputError for another subject, and for options that cannot be used. So
    it does where the study would take the place of somebody else's file. ControllerError and RigError are for
    the files, DesignError where a set point cannot be reached, MissingExtra where Dask is not installed.
    """
    if subject not in SUBJECTS:
        raise InputError("study", f"has no subject {subject!r}", f"choose {' or '.join(SUBJECTS)}")
    which = _fractional(controller)
    if out is not None:
        check_own(Path(out) / name for name in WRITTEN)
    if target is not None:
        check_choice("--target", target, TARGETS)
    grid = grid_of(which, memory, lengths, tolerances, horizon, arithmetic, sample_times)
    model, notes = _rig(rig, which, controller)
    if model is not None:
        check_one_unit(model, which)
    points = _setpoints(which, model, setpoints)
    if model is not None and model.effects:
        notes.append("the rig's effects are left aside: memory is studied in the loop with the nominal chain")
    setup = Setup(which, model, band_of(which, model, points), SAMPLES, points, target)
    with Workers(jobs, scheduler) as workers, _folder(out) as folder:
        found = _Sweep(setup, grid, Store(folder), workers).result(notes)
    _check_measured(found.rows, str(file_of(controller) or which.name))
    if out is not None:
        write(found, Path(out), (controller, rig, *_designed_from(which, controller)))
    return found


@contextmanager
def _folder(out: str | Path | None) -> Iterator[Path]:
    """Where answers are kept: in ``out``, or until the study ends."""
    if out is not None:
        yield Path(out)
        return
    with temporary_folder("study") as scratch:
        yield scratch


def _fractional(given: ControllerLike) -> Controller:
    """The controller. Raises ControllerError where it has no memory to study."""
    controller = controller_from(given)
    if not fractional_terms(controller):
        where = str(file_of(given) or controller.name)
        what = "has no fractional power of s, so no memory"
        raise ControllerError(where, what, "study a controller of fractional order")
    return controller


def _rig(
    given: RigLike | None, controller: Controller, source: ControllerLike
) -> tuple[Rig | None, list[str]]:
    """The rig, and what has to be said about it."""
    if given is not None:
        return rig_of(given), []
    made_from = controller.designed_from
    if made_from is None:
        return None, ["no rig is named in the controller: give --rig for the closed-loop columns"]
    places = _designed_from(controller, source)
    same = [p for p in places if sha256_within(p, LARGEST_SETTING) == made_from.sha256]
    if same:
        return read_rig(same[0]), []
    if places:
        what = f"{places[0]} has changed since the controller was designed from it"
        return None, [f"{what}: give --rig {places[0]} for the closed-loop columns with it as it is"]
    return None, [
        (
            f"{made_from.file}, which the controller was designed from, is not beside it: "
            "give --rig for the closed-loop columns"
        )
    ]


def _designed_from(controller: Controller, source: ControllerLike) -> list[Path]:
    """Where the rig that a controller was designed from may be: beside its file, and here."""
    if controller.designed_from is None:
        return []
    file = file_of(source)
    folders = [Path.cwd()] if file is None else [file.parent, Path.cwd()]
    places = (folder / controller.designed_from.file for folder in folders)
    return [place for place in places if place.is_file()]


def _setpoints(controller: Controller, rig: Rig | None, given: Sequence[float] | None) -> tuple[float, ...]:
    if rig is None:
        return ()
    ranges, _ = derived_ranges(rig)
    start = rest(rig, controller.ranges.output)
    span = rig.ranges.output or controller.ranges.reference
    points = default_setpoints(start.output, span) if given is None else tuple(map(float, given))
    if start.output in points:
        raise DesignError(
            "--setpoints", f"{start.output:g} is the rest itself", "give outputs away from rest"
        )
    for point in points:
        holding(rig, point, ranges)
    return points


_FAITHFUL = 0.03  # of the weights: what such a memory is off by is their lag, not its own error


class _Sweep:
    """The jobs of one study, and what becomes of them."""

    def __init__(self, setup: Setup, grid: Grid, store: Store, workers: Workers) -> None:
        self.setup, self.grid, self.store, self.workers = setup, grid, store, workers
        self.own = setup.controller.sample_time

    def result(self, notes: list[str]) -> Study:
        setup, controller = self.setup, self.setup.controller
        ideals = [Variant("infinite", "f64", h) for h in self.grid.sample_times]
        variants = self.grid.variants(controller)
        plant = plant_of(controller, setup.rig)
        tried = self.grid.of_the_plant(self.own) if plant is not None else []
        asked = (
            [("ideal", v) for v in ideals] + [("row", v) for v in variants] + [("plant", v) for v in tried]
        )
        answers = self._done(asked)
        perfect = [read_ideal(a) for a in answers[: len(ideals)]]
        rows = [read_row(a) for a in answers[len(ideals) : len(ideals) + len(variants)]]
        plants = tuple(read_plant(a) for a in answers[len(ideals) + len(variants) :])
        said, rows = self._recommended(rows, perfect[self.grid.sample_times.index(self._first())][0])
        choice = self._operator([row for row, _ in rows])
        every = tuple(row for row, _ in rows)
        return Study(
            controller,
            None if setup.rig is None else setup.rig.name,
            setup.band,
            setup.setpoints,
            setup.samples,
            every,
            tuple(ideal for ideal, _ in perfect),
            self._plant(plant, plants) if plant is not None else None,
            pareto(every, self._first()),
            said if choice is None else f"{said} {choice.why}",
            (
                *notes,
                *_unsettled(perfect[self.grid.sample_times.index(self._first())][0]),
                *_missing(every),
            ),
            tuple(curves for _, curves in rows),
            tuple(curves for _, curves in perfect),
            () if choice is None else choice.rows,
        )

    def _first(self) -> float:
        """The sample time that is recommended for: the controller's own where it is looked at."""
        return self.own if self.own in self.grid.sample_times else self.grid.sample_times[0]

    def _done(self, asked: list[tuple[str, Variant]]) -> list[dict[str, Any]]:
        jobs = [Job(kind, self.setup, variant) for kind, variant in asked]
        return sweep(jobs, self.store, self.workers)

    def _recommended(
        self, rows: list[tuple[Row, Curves]], ideal: Ideal
    ) -> tuple[str, list[tuple[Row, Curves]]]:
        """The sentence, and the rows with those that it took to find the shortest length."""
        h, arithmetics = self._first(), self.grid.arithmetics
        own = self.setup.controller.arithmetic
        arithmetic = own if own in arithmetics else arithmetics[0]
        requirement = Requirement(self.setup.band, ideal)
        mine = [row for row, _ in rows if row.arithmetic == arithmetic and row.sample_time == h]
        added: list[tuple[Row, Curves]] = []

        def more(length: int) -> Row:
            found = self._done([("row", self.grid.short(arithmetic, h, length))])
            added.append(read_row(found[0]))
            return added[-1][0]

        short, _ = shortest([r for r in mine if r.memory == "short"], requirement, more)
        exponential = leanest([r for r in mine if r.memory == "exponential"], requirement)
        as_run = replace(self.setup.controller, arithmetic=arithmetic, sample_time=h)
        said = sentence(
            as_run, requirement, short, exponential, set(self.grid.memories), max(self.grid.lengths)
        )
        return said, [*rows, *added]

    def _operator(self, rows: list[Row]) -> Choice | None:
        """Both operators in the loop, in the arithmetic and at the sample time that are recommended for."""
        if "exponential" not in self.grid.memories:
            return None
        h, own = self._first(), self.setup.controller.arithmetic
        arithmetic = own if own in self.grid.arithmetics else self.grid.arithmetics[0]
        mine = [r for r in rows if (r.memory, r.arithmetic, r.sample_time) == ("exponential", arithmetic, h)]
        near = [r for r in mine if r.error is not None and r.error <= _FAITHFUL]
        weights = min(near, key=lambda r: (r.ram_bytes, r.error), default=None)
        band = compared_band(self.setup.band, h)
        if weights is None or band is None:
            return None
        asked = [weights.variant, *continuous_variants(band, arithmetic, h)]
        setup = replace(self.setup, band=band)
        answers = sweep([Job("row", setup, v) for v in asked], self.store, self.workers)
        first, *fits = (read_row(answer)[0] for answer in answers)
        return chosen(first, fits)

    def _plant(self, plant: TransferFunction, rows: tuple[PlantRow, ...]) -> Plant:
        times = plant_times(self.own) * self.own
        exact = exact_step(plant, self.own)
        return Plant(str(plant), self.own, tuple(map(float, times)), tuple(map(float, exact)), rows)


def _check_measured(rows: tuple[Row, ...], where: str) -> None:
    """Raises ControllerError where there is nothing to show."""
    if all(row.error is None for row in rows):
        reasons = "; ".join(_missing(rows))
        raise ControllerError(where, f"gives nothing to study: {reasons}", "mend that, or study other forms")


def _unsettled(ideal: Ideal) -> list[str]:
    """What has to be said where not even infinite memory settles."""
    if ideal.loop is None or ideal.loop.settling_s is not None:
        return []
    how = "does not settle at every set point" if ideal.loop.stable else "is not stable"
    return [f"even with infinite memory the loop {how}: the recommendation looks at the phase alone"]


def _missing(rows: tuple[Row, ...]) -> list[str]:
    """One sentence for each reason why rows are empty."""
    reasons: dict[str, int] = {}
    for row in rows:
        if row.note:
            reasons[row.note] = reasons.get(row.note, 0) + 1
    return [f"{count} row{'s' * (count > 1)}: {note}" for note, count in reasons.items()]
