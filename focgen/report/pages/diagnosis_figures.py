"""The figures of a diagnosis: errors by stage, rivals, what signals leave, what the gap is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter

import numpy as np

from focgen.arrays import Array
from focgen.diagnosis.belief.standing import tied_within
from focgen.diagnosis.drawn import Drawn, Mean, Rivals, Trace, sweeps
from focgen.diagnosis.model import Diagnosis
from focgen.report.figures import Axis, Bars, Figure, Line, Panel, Rule
from focgen.report.page import TableOf
from focgen.report.pages.parts import number
from focgen.report.style import with_unit

_GAP = 0.02  # of the session: between experiments that follow each other at once
_MOST_RIVALS = 8
_TIED = tied_within()  # standard deviations
_STATES = (
    ("as_given", "as given", "measured"),
    ("refitted", "refitted", "bad"),
    ("explained", "with the effects", "good"),
)
_OVER = {"level": "level", "rate": "rate", "time": "the session's time"}


def diagnosis_figures(
    found: Diagnosis, drawn: Drawn | None, units: Mapping[str, str]
) -> dict[str, tuple[Figure, ...]]:
    """The figures of the parts ``where``, ``which`` and ``far`` of a page; ``units`` by a signal's role.

    Where ``drawn`` is None, no signals were kept: what the gap is made of is then the only figure.
    """
    far = (_waterfall(found),)
    if drawn is None:
        return {"where": (), "which": (), "far": far}
    which = (
        *tuple(_behind(rivals) for rivals in drawn.rivals if len(rivals.effects) > 1),
        _means(drawn, units),
    )
    loops = _loops(drawn, units)
    signals = (_session(drawn, units), *((loops,) if loops else ()))
    return {"where": (_ladder(drawn),), "which": which, "far": (*far, *signals)}


def _ladder(drawn: Drawn) -> Figure:
    names = tuple(f"{s.entry} → {s.exit}" for s in drawn.segments)
    at = np.arange(len(names))
    bars = tuple(
        Bars(
            label,
            at + 0.27 * (i - 1),
            np.array([getattr(s, key) for s in drawn.segments]),
            colour,
            width=0.25,
            names=names,
        )
        for i, (key, label, colour) in enumerate(_STATES)
    )
    rows = tuple(
        (n, *(number(getattr(s, key)) for key, _, _ in _STATES)) for n, s in zip(names, drawn.segments)
    )
    return Figure(
        "The error of each stage on its own measured input",
        "Root-mean-square error between two logged signals, in percent of the range of the second. A stage "
        "that is as the model says leaves noise only.",
        f"Bars: the error of {', '.join(names)}, as given, refitted, and with the effects found.",
        (
            Panel(
                Axis("from one logged signal to the next", places=names),
                Axis("error (% of range)", from_zero=True),
                bars,
            ),
        ),
        TableOf(("stage", *(label for _, label, _ in _STATES)), rows, "Error, % of the signal's range"),
    )


def _behind(rivals: Rivals) -> Figure:
    shown = list(zip(rivals.effects, rivals.separations))[:_MOST_RIVALS][::-1]
    names = tuple(name for name, _ in shown)
    tied = np.array([value < _TIED for _, value in shown])
    values, at = np.array([value for _, value in shown]), np.arange(len(shown))
    bars = tuple(
        Bars(
            label,
            at[which],
            values[which],
            colour,
            names=tuple(np.array(names)[which]),
            across=True,
            width=0.7,
        )
        for label, which, colour in (("tied with the best", tied, "good"), ("behind", ~tied, "measured"))
        if which.any()
    )
    panel = Panel(
        Axis(
            "standard deviations behind the best", from_zero=True, high=max(4.0, 1.08 * float(values.max()))
        ),
        Axis("", places=names),
        (*bars, Rule(_TIED, "limit", upright=True)),
        height=90 + 30 * len(shown),
    )
    return Figure(
        f"What else might be {rivals.found}",
        "How far the evidence for every other effect is behind. Left of the line "
        "are those that may be the cause as well, by these logs.",
        f"Bars: standard deviations by which {', '.join(names[::-1])} are behind {rivals.found}.",
        (panel,),
        TableOf(
            ("effect", "σ behind"),
            tuple((n, number(v)) for n, v in shown[::-1]),
            "Standard deviations behind the best",
        ),
        linked=False,
    )


def _means(drawn: Drawn, units: Mapping[str, str]) -> Figure:
    """What the worst segment leaves, on average, over the input's level and rate and over time."""
    entry, exit = drawn.worst
    unit = units.get(entry, "")
    labels = {
        "level": with_unit(entry, unit),
        "rate": f"rate of {entry} ({unit or 1}/s)",
        "time": "the session's time (s)",
    }
    y = Axis(with_unit("mean error", units.get(exit, "")))
    panels = tuple(
        Panel(
            Axis(labels[over]),
            y,
            (*(_mean(m) for m in drawn.means if m.over == over), Rule(0.0)),
            f"Over {_OVER[over]}",
            240,
        )
        for over in _OVER
    )
    rows = tuple(
        (
            f"{_said(m.of)}, over {_OVER[m.over]}{'' if m.way == 'any' else ', ' + m.way}",
            number(_least(m.mean)),
            number(_most(m.mean)),
        )
        for m in drawn.means
    )
    return Figure(
        f"What {entry} → {exit} leaves",
        "The mean of what the model leaves, over the input's level, its rate, and time. Where the curves "
        "for a rising and a falling input stand apart, the error depends on the direction; with the "
        "effects, all should lie at zero.",
        f"Curves: mean error of {exit} over the level, the rate and the time of {entry}, refitted and with "
        "the effects.",
        panels,
        TableOf(("curve", "smallest", "largest"), rows, f"Mean error of {exit}"),
        linked=False,
    )


def _said(of: str) -> str:
    return "refitted" if of == "refitted" else "with the effects"


def _mean(mean: Mean) -> Line:
    dash = "dashed" if mean.way == "falling" else "solid"
    way = "" if mean.way == "any" else f", {mean.way}"
    colour = "bad" if mean.of == "refitted" else "good"
    return Line(
        _said(mean.of) + way,
        mean.place,
        mean.mean,
        colour,
        dash,
        dots=4.0,
        group=_said(mean.of) + (", falling" if dash == "dashed" else ""),
    )


def _least(values: Array) -> float | None:
    return float(values.min()) if len(values) else None


def _most(values: Array) -> float | None:
    return float(values.max()) if len(values) else None


def _session(drawn: Drawn, units: Mapping[str, str]) -> Figure:
    """Input, output and error of all experiments, on the session's clock."""
    begins = _begins(drawn.traces)

    def whole(values: Callable[[Trace], Array]) -> Array:
        return np.concatenate([np.append(values(t), np.nan) for t in drawn.traces])

    clock = np.concatenate([np.append(b + t.time, np.nan) for b, t in zip(begins, drawn.traces)])
    outputs = [Line("measured", clock, whole(attrgetter("measured")), "measured", width=2.0)]
    errors = []
    for key, label, colour in _STATES[1:]:
        made = whole(attrgetter(key))
        outputs.append(Line(label, clock, made, colour, width=1.3))
        errors.append(Line(label, clock, whole(attrgetter("measured")) - made, colour, width=1.2))
    entry, time = drawn.entry, Axis("the session's time (s)")
    shown = with_unit("output", units.get("output", ""))
    panels = (
        Panel(time, Axis(shown), tuple(outputs), height=300),
        Panel(time, Axis(with_unit("error", units.get("output", ""))), (*errors, Rule(0.0)), height=190),
        Panel(
            time,
            Axis(with_unit(entry, units.get(entry, ""))),
            (Line(entry, clock, whole(lambda t: t.input), "command"),),
            height=170,
        ),
    )
    thin = (
        f" Of {drawn.samples} samples {drawn.kept} are kept, every peak among them."
        if drawn.kept < drawn.samples
        else ""
    )
    return Figure(
        "The session: measured, and simulated from the first logged input",
        f"Drag over a stretch to look at it closely; the panels move together.{thin}",
        "Curves over the session's time: the measured output and two simulations of it, their errors, and "
        f"the {entry}.",
        panels,
        TableOf(
            ("experiment", "begins at (s)", "lasts (s)", "RMS error refitted", "with the effects"),
            _rows(drawn, begins),
            "Experiments",
        ),
    )


def _begins(traces: Sequence[Trace]) -> list[float]:
    """Where each experiment begins on the page: on the session's clock, or one behind the other where several
    begin at once."""
    ends = [t.start + float(t.time[-1]) for t in traces]
    if all(later.start >= end for end, later in zip(ends, traces[1:])):
        return [t.start for t in traces]
    spare = _GAP * sum(float(t.time[-1]) for t in traces)
    begins, at = [], 0.0
    for trace in traces:
        begins.append(at)
        at += float(trace.time[-1]) + spare
    return begins


def _rows(drawn: Drawn, begins: Sequence[float]) -> tuple[tuple[str, ...], ...]:
    def rms(trace: Trace, key: str) -> str:
        return number(float(np.sqrt(np.nanmean((trace.measured - getattr(trace, key)) ** 2))))

    return tuple(
        (t.name, number(b), number(float(t.time[-1])), rms(t, "refitted"), rms(t, "explained"))
        for t, b in zip(drawn.traces, begins)
    )


def _loops(drawn: Drawn, units: Mapping[str, str]) -> Figure | None:
    """Output over input of the two sweeping experiments that the effects change most."""
    sweeping = [t for t in drawn.traces if sweeps(t.input)]
    sweeping.sort(key=lambda t: -float(np.nanmean((t.refitted - t.explained) ** 2)))
    if not sweeping:
        return None
    x = Axis(with_unit(drawn.entry, units.get(drawn.entry, "")))
    y = Axis(with_unit("output", units.get("output", "")))
    panels = tuple(
        Panel(
            x,
            y,
            (
                Line("measured", t.input, t.measured, "measured", width=2.0),
                Line("refitted", t.input, t.refitted, "bad", width=1.2),
                Line("with the effects", t.input, t.explained, "good", width=1.2),
            ),
            t.name,
            320,
        )
        for t in sweeping[:2]
    )
    names = " and ".join(t.name for t in sweeping[:2])
    return Figure(
        "Output over input",
        "The experiments that sweep and that the effects change most. A loop that the refitted model lacks "
        "and the effects follow is a memory of the rig.",
        f"Curves of the output over the {drawn.entry} in {names}: measured, refitted, with the effects.",
        panels,
        TableOf(
            ("experiment", f"{drawn.entry}, smallest", "largest", "output, smallest", "largest"),
            tuple(
                (
                    t.name,
                    *map(number, (_least(t.input), _most(t.input), _least(t.measured), _most(t.measured))),
                )
                for t in sweeping[:2]
            ),
            "What they sweep",
        ),
        linked=False,
    )


def _waterfall(found: Diagnosis) -> Figure:
    """The mean square gap: parameters, effects, unexplained, noise; the bars add up."""
    gap = found.gap
    names = ("parameters", "effects", "unexplained", "noise")
    square = np.array([gap.as_given, gap.refitted, gap.explained, gap.floor]) ** 2
    tops = 100.0 * square / max(square[0], 1e-300)
    bottoms = np.append(tops[1:], 0.0)
    bars = tuple(
        Bars(name, np.array([float(i)]), tops[[i]], colour, bottoms[[i]], names=(name,))
        for i, (name, colour) in enumerate(zip(names, ("model", "good", "bad", "measured")))
    )
    unit = f" ({gap.unit})" if gap.unit else ""
    rows = tuple(
        (name, number(rms), number(top - low))
        for name, rms, top, low in zip(
            names, (gap.as_given, gap.refitted, gap.explained, gap.floor), tops, bottoms
        )
    )
    gof = gap.gof
    return Figure(
        "What the gap is made of",
        "The mean square error of the output as given, taken apart. The goodness of fit goes from "
        f"{gof['as given']:.3f} to {gof['explained']:.3f} of a possible {gof['possible']:.3f}.",
        "Bars that add up: how much of the mean square error parameters, effects, what stays unexplained, "
        "and noise make.",
        (Panel(Axis("", places=names), Axis("mean square error (%)", from_zero=True), bars),),
        TableOf(
            ("part", f"RMS error before it is taken away{unit}", "share (%)"),
            rows,
            "Parts of the mean square error",
        ),
    )
