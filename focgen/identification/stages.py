"""Regulator and sensor identified from their own signals, as rational stages with a dead time.

The regulator runs from ``command``, held between samples unless the rig or the data say otherwise, to
``pressure``; the sensor from ``curvature``, straight between samples, to ``output``. One stage is fitted to
all experiments, each with an offset of its own, and with an initial state where it does not begin at rest. Of
the shapes tried the simplest that explains the data is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from focgen.arrays import Array
from focgen.errors import FitError, check_choice
from focgen.fractional.transfer import TransferFunction
from focgen.identification.bent import driving
from focgen.identification.between_samples import Tried, at_rest, is_far_likelier, likeliest_way, ways_of
from focgen.identification.digits import told_value
from focgen.identification.directions import UpDown, fit_directions
from focgen.identification.rational import LATEST, Record, parts
from focgen.identification.shapes import (
    Fitted,
    ShapeFit,
    choose,
    clearly_better,
    delay_seconds,
    fit_shapes,
    refit,
)
from focgen.identification.stage_notes import notes_of
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig

_SIGNALS = {"regulator": ("command", "pressure"), "sensor": ("curvature", "output")}
_FEWEST = 30  # samples
_FAR = 10.0  # of Schwarz's criterion: a fit that is so far ahead is the likelier one
_MOST = 50_000  # samples that the shapes are compared on
_SHOWS = 8  # samples that show whether a log begins at rest
_EARLY = 2.0  # samples that a command which rests between jumps may be ahead of its row: a row may have what
# was sent, and what was read as the next one came. Another command shows no such thing apart from a lag
_MOVES = 10.0  # times its noise: a signal that moves by more has answered to a step


@dataclass(frozen=True, eq=False)
class StageFit:
    """A stage as identified.

    ``stage`` is "regulator" or "sensor", ``transfer`` and ``delay`` (s) what the rig takes. ``shape`` is one
    of "gain", "1p", "2p", "2p1z", each with "+delay" or "+lead" where there is one. ``parameters`` maps gain,
    T or T1 and T2 or wn and damping, zero, and delay, or the lead of a command that was early, to (value,
    half 95 % interval), times in s, wn in rad/s.
    ``gain_relative`` and ``time_relative`` are half 95 % intervals relative to the values. ``between``: what
    its input does between samples, None where that is not to be told. ``fits``: every shape
    that was tried. ``up_down``: time constants of the two directions, None where they are not both seen.
    ``measured`` and ``simulated`` (n,) of each of the experiments called ``names``, every ``step`` s.
    """

    stage: str
    transfer: TransferFunction
    delay: float
    shape: str
    parameters: dict[str, tuple[float, float]]
    gain_relative: float
    time_relative: float
    between: Between | None
    gof: float
    fits: tuple[ShapeFit, ...]
    up_down: UpDown | None
    names: tuple[str, ...]
    measured: tuple[Array, ...]
    simulated: tuple[Array, ...]
    step: float
    notes: tuple[str, ...]

    def leaves_less_than(self, other: StageFit) -> bool:
        """Whether it is far likelier than an ``other`` fit to the same readings."""
        mine, theirs = (min(shape.bic for shape in fit.fits) for fit in (self, other))
        return mine < theirs - _FAR

    @property
    def traces(self) -> list[tuple[Array, Array, Array]]:
        """Time (s), measured and simulated signal of each experiment, all (n,)."""
        pairs = zip(self.measured, self.simulated)
        return [(np.arange(len(y)) * self.step, y, made) for y, made in pairs]


def identify_stage(
    experiments: Sequence[Experiment], stage: str, between: Between | None = None, ahead: Rig | None = None
) -> StageFit:
    """Fit a regulator (command → pressure) or a sensor (curvature → output) to all experiments that log both.

    ``between``: what the command does between its samples, None where the data are to show it. ``ahead``: the
    rig that makes the curvature, where that is known: it tells how a sensor is driven between readings.
    Raises FitError where the logs do not determine the stage.
    """
    check_choice("--stages", stage, _SIGNALS, FitError)
    used = _usable(experiments, stage)
    step = used[0].sample_time
    ways, made = _ways(used, stage, between), cache(lambda way: [_record(e, stage, way, ahead) for e in used])
    _check(made(ways[0]), stage)
    rests = at_rest([e[_SIGNALS[stage][0]] for e in used])
    way = likeliest_way(ways, lambda way: _tried(made(way), step, way), rests)
    records, fits = made(way.between), way.fit
    short = choose(fits)
    up_down, short = fit_directions(fits, short, step)
    chosen = refit(short, records, step) if sum(map(len, records)) > _MOST else short
    _check_known(chosen, fits, stage)
    chosen = _as_unsure(chosen, way.rival or ())
    return StageFit(
        stage=stage,
        transfer=transfer_of(chosen.report.parameters),
        delay=max(delay_seconds(chosen, step), 0.0),
        shape=_led(chosen.report).shape,
        parameters=_led(chosen.report).parameters,
        gain_relative=chosen.half["gain"],
        time_relative=_time_relative(chosen),
        between=way.known,
        gof=chosen.report.gof,
        fits=tuple(_led(f.report) for f in fits),
        up_down=up_down,
        names=tuple(e.name for e in used),
        measured=tuple(r.measured for r in chosen.problem.records),
        simulated=tuple(chosen.solved.models(chosen.solved.rows)),
        step=step,
        notes=notes_of(stage, [e.name for e in experiments], chosen, fits, up_down, step),
    )


def _led(of: ShapeFit) -> ShapeFit:
    """A shape with its dead time of less than 0 as what it is: no rig answers ahead of its command."""
    delay, half = of.parameters.get("delay", (0.0, 0.0))
    if delay >= 0.0:
        return of
    others = {name: pair for name, pair in of.parameters.items() if name != "delay"}
    shape = of.shape.replace("+delay", "+lead")
    return replace(of, shape=shape, parameters=others | {"lead": (-delay, half)})


def transfer_of(parameters: dict[str, tuple[float, float]]) -> TransferFunction:
    """The transfer function of a shape's parameters, as many digits as hold: (T s + 1) or a leading s²."""
    value = {name: told_value(*pair) for name, pair in parameters.items()}
    if "T" in value:
        den = [(value["T"], 1.0), (1.0, 0.0)]
    elif "wn" in value:
        den = [(1.0, 2.0), (2.0 * value["damping"] * value["wn"], 1.0), (value["wn"] ** 2, 0.0)]
    elif "T1" in value:
        rates = 1.0 / value["T1"], 1.0 / value["T2"]
        den = [(1.0, 2.0), (sum(rates), 1.0), (rates[0] * rates[1], 0.0)]
    else:
        den = [(1.0, 0.0)]
    scale = value["gain"] * den[-1][0]
    zero = [(scale * value["zero"], 1.0)] if "zero" in value else []
    num, den = ([(told_value(c, 0.0), order) for c, order in terms] for terms in ([*zero, (scale, 0.0)], den))
    return TransferFunction(num, den)


def _usable(experiments: Sequence[Experiment], stage: str) -> list[Experiment]:
    source, target = _SIGNALS[stage]
    both = [e for e in experiments if source in e and target in e]
    if not both:
        remedy = f"log them, and name their columns in [signals], or leave {stage} out of --stages"
        raise FitError(stage, f"no log has both {source} and {target}", remedy)
    long = [e for e in both if len(e) >= _FEWEST]
    if not long:
        longest = max(map(len, both))
        raise FitError(stage, f"the longest log has {longest} samples", f"give at least {_FEWEST}")
    steps = {e.sample_time for e in long}
    if max(steps) > min(steps) * (1.0 + 1e-6):
        what = f"the logs are sampled every {min(steps):g} and every {max(steps):g} s"
        raise FitError(stage, what, "identify them one sample time at a time")
    return long


def _tried(records: Sequence[Record], step: float, way: Between) -> Tried[list[Fitted]]:
    """Every shape, fitted to a drive that runs so, and what the one to be taken leaves."""
    fits = fit_shapes(parts(records, _MOST), step)
    short = choose(fits)
    return Tried(way, fits, short.solved.left, short.shape.parameters)


def _as_unsure(chosen: Fitted, others: Sequence[Fitted]) -> Fitted:
    """A fit whose intervals reach to the numbers of the same shape among the ``others``, which are those of a
    command that runs in another way between its samples: where that does not show, a lag is known to half a
    sample."""
    other = next((f for f in others if f.shape == chosen.shape), None)
    if other is None or is_far_likelier(*(Tried(Between.HELD, f, f.solved.left) for f in (chosen, other))):
        return chosen
    there = other.report.parameters
    wide = {
        name: (value, half + abs(value - there[name][0]) if name in there else half)
        for name, (value, half) in chosen.report.parameters.items()
    }
    return replace(chosen, report=replace(chosen.report, parameters=wide))


def _ways(experiments: Sequence[Experiment], stage: str, given: Between | None) -> tuple[Between, ...]:
    """What the stage's input may do between its samples: a curvature runs straight, a command as
    :func:`ways_of` has it. Here a smooth one counts as straight."""
    if stage == "sensor":
        return (Between.STRAIGHT,)
    ways = ways_of(given, [e["command"] for e in experiments])
    return tuple(way for way in ways if way != Between.SMOOTH) or (Between.STRAIGHT,)


def _record(experiment: Experiment, stage: str, between: Between, ahead: Rig | None) -> Record:
    hold = "zero" if between == Between.HELD else "linear"
    drive, measured = (np.asarray(experiment[role], float) for role in _SIGNALS[stage])
    drive = driving(experiment, ahead) if stage == "sensor" else drive
    rests = stage == "regulator" and np.ptp(drive) == 0.0 and bool(drive[0]) and _answers(measured)
    moves = not (rests or _still(drive, measured))
    drive = drive if rests else drive - drive[0]
    early = _EARLY * (between == Between.HELD and at_rest([drive]))
    return Record(experiment.name, drive, measured, hold, bool(rests), moves, stage == "sensor", early)


def _still(drive: Array, measured: Array) -> bool:
    """Whether a log begins at rest: the measured signal stays where it is until the input first changes.

    An input that is not 0 at first may have stepped there just before: then longer than any dead time.
    """
    changed = int(np.argmax(drive != drive[0])) or len(drive)
    if changed < (LATEST * len(drive) if drive[0] else _SHOWS):
        return False
    before = measured[:changed]
    noise = float(np.median(np.abs(np.diff(before))))
    return float(np.ptp(before)) <= _MOVES * noise + 1e-3 * float(np.ptp(measured))


def _answers(measured: Array) -> bool:
    """Whether a signal ends elsewhere than it begins: it still answers to a step before its first sample."""
    noise = float(np.median(np.abs(np.diff(measured)))) + 1e-9 * float(np.ptp(measured))
    end = measured[-max(len(measured) // 4, 1) :]
    return abs(float(np.median(end)) - float(np.median(measured[:3]))) > _MOVES * noise


def _check(records: Sequence[Record], stage: str) -> None:
    source, target = _SIGNALS[stage]
    if not any(np.any(r.drive) for r in records):
        what = f"the {source} never changes, so neither gain nor dynamics can be seen"
        raise FitError(stage, what, f"log steps of the {source}, up and down, each held until it settles")
    if not any(np.ptp(r.measured) for r in records):
        raise FitError(stage, f"the {target} never changes", f"check the column of the {target}")


def _check_known(chosen: Fitted, fits: Sequence[Fitted], stage: str) -> None:
    """Raise FitError where the gain's interval reaches 0, in the shape taken or in one that is far better."""
    source, target = _SIGNALS[stage]
    better = [f for f in fits if f.gain_unknown and not f.report.refused and clearly_better(f, chosen)]
    if not chosen.gain_unknown and not better:
        return
    gain, half = (better[0] if better else chosen).report.parameters["gain"]
    wide = f"±{half / abs(gain):.0%}" if gain and np.isfinite(half) else "not at all"
    what = f"the gain from {source} to {target} is known to {wide} only"
    remedy = f"log larger steps of the {source}, up and down, each held until the {target} has settled"
    raise FitError(stage, what, remedy)


def _time_relative(chosen: Fitted) -> float:
    """Of one factor of time: of the time constant, of wn, or of the sum of both time constants."""
    found = chosen.report.parameters
    if "T1" in found:
        (slow, wide), (fast, narrow) = found["T1"], found["T2"]
        return (wide + narrow) / (slow + fast)
    return next((chosen.half[name] for name in ("T", "wn") if name in found), 0.0)
