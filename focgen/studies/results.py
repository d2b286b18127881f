"""What a study of the memory varies, and what it finds."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.control.controller import Controller
from focgen.rig.rig import Rig
from focgen.shown import Shown

INPUTS = ("step", "ramp", "sine", "noise")


@dataclass(frozen=True)
class Variant:
    """One way to run the controller.

    ``memory``: "short" with ``length`` past samples, "exponential" with a ``tolerance`` up to ``horizon``
    samples, or "infinite" (the ideal in float64, every past sample). ``sample_time`` in s. With the
    ``operator`` "continuous" the exponential memory follows (jω)^α over ``band`` (rad/s), without a horizon.
    """

    memory: str
    arithmetic: str
    sample_time: float
    length: int | None = None
    tolerance: float | None = None
    horizon: int | None = None
    operator: str = "gl"
    band: tuple[float, float] | None = None

    @property
    def label(self) -> str:
        """What people call it."""
        if self.memory == "short":
            return f"L = {self.length}"
        return f"ε = {self.tolerance:g}" if self.memory == "exponential" else "infinite memory"


@dataclass(frozen=True)
class Band:
    """The frequencies ``low`` … ``high`` (rad/s) that matter to the loop, and ``why`` they do.

    ``crossover_low`` and ``crossover_high``: the loop's slowest and fastest crossover, None without a rig.
    """

    low: float
    high: float
    why: str
    crossover_low: float | None = None
    crossover_high: float | None = None


@dataclass(frozen=True)
class Setup:
    """What all variants share.

    ``samples``: how long the open-loop inputs last, at the controller's own sample time; other sample times
    cover the same seconds. ``setpoints``: outputs that the closed loop steps to from rest. ``target``: the
    core that cycles are counted on, or None.
    """

    controller: Controller
    rig: Rig | None
    band: Band
    samples: int
    setpoints: tuple[float, ...]
    target: str | None = None


@dataclass(frozen=True)
class Loop:
    """The closed loop stepped from rest to every set point.

    ``settling_s``: mean over the set points, into ±5 % for good; None where one does not settle.
    ``overshoot_pct``: the largest. ``iae``: mean over the set points of ∫|error| dt relative to the step, in
    s. ``margin_deg``, ``gain_margin_db``, ``delay_margin_s``: the smallest over the operating points; None
    where nothing is crossed. ``stable`` by Nyquist's criterion at every one of them.
    """

    settling_s: float | None
    overshoot_pct: float | None
    iae: float | None
    margin_deg: float | None
    gain_margin_db: float | None
    delay_margin_s: float | None
    stable: bool


@dataclass(frozen=True)
class Row:
    """What one variant does and costs. None where it could not be found; ``note`` says why.

    ``error``: of the memory operator alone (each fractional power in turn, the worst), the largest over a
    step, a ramp, a sine and noise of its largest error relative to the largest exact output, against infinite
    memory; ``errors`` has them by input. ``bound``: what that error provably cannot exceed. ``error_ahead``:
    the same of the whole controller's signal ahead of its integrator. ``error_s``: of the memory operator
    alone against s^α itself, the largest |H/(jω)^α − 1| over the band.
    ``dc_bias``: what the controller's transfer function yields for a constant, less what it should, relative
    to what it should; ``operator_bias``: Γ(L+1−α)/(Γ(1−α)L!), what D^α with step 1 yields for 1, largest over
    the powers.
    ``phase_error_deg``, ``magnitude_error_db``: largest over the band, against infinite memory at the same
    sample time; ``phase_from_rad_s``: from this frequency to the band's end the phase stays within 2°.
    ``settling_s`` … ``stable``: see :class:`Loop`.
    ``states``: exponentials in all. ``multiplies``: multiplications of the operator in one step.
    ``ram_bytes``: the state; ``table_bytes``: constant tables; ``flash_bytes``: code and tables, compiled
    for ``compiled_for``; on a target also ``stack_bytes``, and ``instructions`` and ``cycles`` of a step.
    """

    memory: str
    arithmetic: str
    sample_time: float
    length: int | None
    tolerance: float | None
    horizon: int | None
    states: int | None = None
    error: float | None = None
    errors: dict[str, float] | None = None
    bound: float | None = None
    error_ahead: float | None = None
    error_s: float | None = None
    dc_bias: float | None = None
    operator_bias: float | None = None
    phase_error_deg: float | None = None
    magnitude_error_db: float | None = None
    phase_from_rad_s: float | None = None
    settling_s: float | None = None
    overshoot_pct: float | None = None
    iae: float | None = None
    margin_deg: float | None = None
    gain_margin_db: float | None = None
    delay_margin_s: float | None = None
    stable: bool | None = None
    multiplies: int | None = None
    ram_bytes: int | None = None
    table_bytes: int | None = None
    flash_bytes: int | None = None
    compiled_for: str | None = None
    stack_bytes: int | None = None
    instructions: float | None = None
    cycles: float | None = None
    note: str | None = None
    operator: str = "gl"
    band: tuple[float, float] | None = None

    @property
    def variant(self) -> Variant:
        """What was measured."""
        of = (self.memory, self.arithmetic, self.sample_time, self.length, self.tolerance, self.horizon)
        return Variant(*of, self.operator, self.band)


@dataclass(frozen=True)
class Curves:
    """What the pictures draw of a variant, None where it was not found.

    ``time`` (s) and ``output`` of the step to ``reference``; ``omega`` (rad/s), ``phase_deg`` and
    ``magnitude_db``: the errors over frequency.
    """

    omega: tuple[float, ...] = ()
    phase_deg: tuple[float, ...] = ()
    magnitude_db: tuple[float, ...] = ()
    time: tuple[float, ...] = ()
    output: tuple[float, ...] = ()
    reference: float | None = None


@dataclass(frozen=True)
class Ideal:
    """Infinite memory in float64 at ``sample_time``: the loop that the rows are compared with.

    ``sampling_phase_deg``, ``sampling_magnitude_db``: what sampling alone costs at the upper end of the band,
    against the continuous controller.
    """

    sample_time: float
    sampling_phase_deg: float
    sampling_magnitude_db: float
    loop: Loop | None


@dataclass(frozen=True)
class PlantRow:
    """The plant 1/(T s^α + 1) simulated with this memory in its denominator; a step of 1, which it ends at.

    ``rest``: where it ends instead, for ever. ``errors``: output less the exact one, by seconds after the
    step. ``output``: at ``Plant.time``.
    """

    memory: str
    length: int | None
    states: int | None
    rest: float
    errors: dict[str, float]
    output: tuple[float, ...]


@dataclass(frozen=True)
class Plant:
    """Short memory where it hurts: in the denominator, over hours. ``transfer`` as text, normalised to end at
    1; ``time`` (s) and ``exact`` draw its step response.
    """

    transfer: str
    sample_time: float
    time: tuple[float, ...]
    exact: tuple[float, ...]
    rows: tuple[PlantRow, ...]


@dataclass(frozen=True, repr=False)
class Study(Shown):
    """All that was found. ``recommendation``: one sentence, and one on the operator; ``notes``: what has to
    be said about it. ``operators``: the memories of both operators that were compared, "gl" first.

    ``rig``: the name of the rig that closed the loop, None where there was none. ``pareto``: for each cost
    (the name of a column of the rows) the indices of the rows, at the controller's own sample time, that no
    other row beats in both cost and ``error``, cheapest first. ``curves`` belong to ``rows`` one by one,
    ``ideal_curves`` to ``ideal``.
    """

    controller: Controller
    rig: str | None
    band: Band
    setpoints: tuple[float, ...]
    samples: int
    rows: tuple[Row, ...]
    ideal: tuple[Ideal, ...]
    plant: Plant | None
    pareto: dict[str, tuple[int, ...]]
    recommendation: str
    notes: tuple[str, ...]
    curves: tuple[Curves, ...]
    ideal_curves: tuple[Curves, ...]
    operators: tuple[Row, ...] = ()
