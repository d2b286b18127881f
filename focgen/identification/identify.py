"""``identify``: from the logs of a rig to its fractional model, compared with integer-order ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from focgen.errors import FitError
from focgen.identification.caveats import warnings_of
from focgen.identification.excitation import Excitation, possible_rests, prepare
from focgen.identification.fractional import FractionalFit, fit_fractional
from focgen.identification.integer import fit_integer_models
from focgen.identification.kernel import step_means, step_responses
from focgen.identification.line import distinct_levels, fit_line
from focgen.identification.model import ExperimentFit, Identification, Pooled, Unseen
from focgen.identification.quality import bic, effective_samples, gof
from focgen.identification.reach import seen_ranges
from focgen.logs.experiment import Experiment
from focgen.logs.read import read_logs
from focgen.output import check_apart, write_file
from focgen.progress import track
from focgen.rig.files import read_rig, rig_text
from focgen.rig.model import Actuator, LinearActuator, Rig

_STEADY = 0.1  # of the step: nearer to its level than this, the input is at it
_STEEPEST = 5  # degree of K(p); beyond it a polynomial through a few levels means nothing
_CLEAR = 1.5  # half 95 % intervals, beyond which an offset is there (one in 300 by chance)
_NO_OFFSET = 1e-3  # of the measured reach: an offset below this is none
_STAY = 0.15  # of the experiment: a step's input stays at its level at least so long


def identify(
    logs: Sequence[str | Path] | Sequence[Experiment],
    rig: Rig | str | Path,
    out: str | Path | None = None,
    first: float | None = None,
    last: float | None = None,
    gain_degree: int = 1,
    unseen: Sequence[str | Path] | Sequence[Experiment] = (),
) -> Identification:
    """Fit K/(T s^α + 1) to each experiment, pool T and α, and draw K(p) through the gains; eq. (3) to (5).

    ``logs`` are paths or experiments of one session, ``first`` and ``last`` (s within each experiment) cut
    them, ``gain_degree`` is the degree of K(p); with fewer levels than that needs, a lower one is taken and
    said. The new rig is written to ``out``. The input is the measured pressure where logged, else the command
    through the regulator; fitted is the curvature where logged, else the output through the sensor.
    ``unseen`` are logs that the identified rig is shown against, but not fitted to.

    Raises LogError, RigError or FitError, and InputError where ``out`` is one of the inputs; nothing is
    written then.
    """
    _check_degree(gain_degree)
    given = (*logs, rig, *unseen)
    if out is not None:
        check_apart([out], given)
    nominal = rig if isinstance(rig, Rig) else read_rig(rig)
    experiments = _read(logs, nominal, first, last)
    others = _read(unseen, nominal, None, None) if unseen else ()
    excitations = [_prepared(e, nominal, gain_degree + 1) for e in experiments]
    fits = tuple(_fit(x) for x in track(excitations, "fitting experiment"))
    pooled, notes = _pooled(_steps(excitations, fits), gain_degree)
    ranges, told = seen_ranges(nominal.ranges, experiments)
    found = replace(
        nominal, actuator=Actuator(pooled.T, pooled.alpha, pooled.gain), ranges=ranges, effects=()
    )
    pooled = replace(pooled, simulated={x.name: _through_rig(x, found.actuator) for x in excitations})
    told = notes + _notes(excitations, fits, nominal) + told
    result = _compared(excitations, fits, pooled, found, told, _shown(others, found))
    if out is not None:
        write_file(out, rig_text(found), given)
    return result


def _check_degree(degree: int) -> None:
    if not 0 <= degree <= _STEEPEST:
        remedy = f"give 0 to {_STEEPEST}; 1 is the line of eq. (5)"
        raise FitError("--gain-degree", f"is {degree}", remedy)


def _read(logs, rig: Rig, first, last) -> tuple[Experiment, ...]:
    if logs and all(isinstance(log, Experiment) for log in logs):
        return tuple(log.between(first, last) for log in logs)
    limits = {role: span for role, span in vars(rig.ranges).items() if span is not None}
    return read_logs(logs, rig.signals, rig.sample_time, first, last, limits)


def _prepared(experiment: Experiment, rig: Rig, powers: int) -> Excitation:
    """The experiment at rest before its first sample in the way that fits better."""
    candidates = [prepare(experiment, rig, powers, before) for before in possible_rests(experiment)]
    if len(candidates) == 1:
        return candidates[0]
    return min(candidates, key=lambda x: -gof(x.measured, fit_fractional([x]).simulated[0]))


def _fit(x: Excitation) -> ExperimentFit:
    fit = fit_fractional([x])
    half = {"K": float(fit.half["K"][0]), "T": fit.half["T"], "alpha": fit.half["alpha"]}
    found = {"K": float(fit.K[0]), "T": fit.T, "alpha": fit.alpha}
    return ExperimentFit(
        name=x.name,
        **found,
        offset=float(fit.offset[0]),
        level=x.loaded,
        ci95={key: (found[key] - half[key], found[key] + half[key]) for key in found},
        gof=gof(x.measured, fit.simulated[0]),
        fitted=x.fitted_role,
        driven_by=x.input_role,
        time=np.arange(len(x)) * x.step,
        pressure=x.pressure,
        measured=x.measured,
        simulated=fit.simulated[0],
        integer=fit_integer_models(x, _needs_offset(x, fit)),
        step=is_step(x),
    )


def _steps(excitations: list[Excitation], fits: tuple[ExperimentFit, ...]) -> list[Excitation]:
    steps = [x for x, fit in zip(excitations, fits, strict=True) if fit.step]
    if not steps:
        raise FitError(
            "logs", "none is a step of the input", "add step logs; K(p), T and alpha come from them"
        )
    return steps


def _needs_offset(x: Excitation, fit: FractionalFit) -> bool:
    """Whether integer-order models are given an offset: not where no rest is on record and none is seen.

    There it would only let a slow model jump at the step.
    """
    seen = _CLEAR * fit.half["offset"][0] + _NO_OFFSET * np.ptp(x.measured)
    return x.rest_shown or bool(abs(fit.offset[0]) > seen)


def is_step(x: Excitation) -> bool:
    """Whether the input stays at its level for a good part of the time without a break."""
    there = np.abs(x.pressure - x.level) <= _STEADY * abs(x.level - x.before)
    ends = np.flatnonzero(~np.concatenate([[False], there, [False]]))
    return bool(np.diff(ends).max() - 1 >= _STAY * len(x))


def _pooled(steps: list[Excitation], degree: int) -> tuple[Pooled, tuple[str, ...]]:
    fit = fit_fractional(steps)
    ends = np.array([x.ends for x in steps])
    degree, notes = _feasible_degree(ends, degree)
    line = fit_line(ends, fit.K, fit.K_covariance, degree)
    span = lambda value, half: (float(value - half), float(value + half))  # noqa: E731
    ci95 = {
        "T": span(fit.T, fit.half["T"]),
        "alpha": span(fit.alpha, fit.half["alpha"]),
        "gain": tuple(map(span, line.gain, line.half)),
    }
    return Pooled(
        fit.T,
        fit.alpha,
        line.gain,
        line.r2,
        ci95,
        tuple(fit.K.tolist()),
        tuple(map(span, fit.K, fit.half["K"])),
        {},
    ), notes


def _feasible_degree(ends: np.ndarray, degree: int) -> tuple[int, tuple[str, ...]]:
    possible = min(degree, distinct_levels(ends) - 1)
    if possible == degree:
        return degree, ()
    return possible, (
        f"{possible + 1} distinct level{'s' * (possible > 0)}: K(p) of degree {possible}, not {degree}",
    )


def _shown(experiments: Sequence[Experiment], rig: Rig) -> tuple[Unseen, ...]:
    """Logs beside what the identified rig makes of their input."""
    made = [_prepared(e, rig, len(rig.actuator.gain)) for e in experiments]
    answers = [_through_rig(x, rig.actuator) for x in made]
    return tuple(
        Unseen(x.name, x.pressure, x.measured, y, gof(x.measured, y), not is_step(x))
        for x, y in zip(made, answers)
    )


def _through_rig(x: Excitation, actuator: Actuator) -> np.ndarray:
    """The pooled rig's answer, with K(p) p as its drive and the offset that fits best."""
    log_tau, held = np.log(actuator.T) / actuator.alpha, x.hold == "zero"
    steps = step_responses(log_tau, actuator.alpha, x.step, len(x)) if held or x.jumps else None
    means = None if held else step_means(log_tau, actuator.alpha, x.step, len(x))
    response = np.tensordot(actuator.gain, x.respond(steps, means)[0, : len(actuator.gain)], 1)
    return response + np.mean(x.measured - response)


def _compared(excitations, fits, pooled: Pooled, rig: Rig, notes, shown) -> Identification:
    models = {"fom": {f.name: f.simulated for f in fits}}
    counts = {"fom": 3}
    for i, fit in enumerate(fits[0].integer):
        models[f"iom_{fit.name}"] = {f.name: f.integer[i].simulated for f in fits}
        counts[f"iom_{fit.name}"] = fit.parameters
    models["rig"] = pooled.simulated
    measured = {f.name: f.measured for f in fits}
    quality = {
        model: _with_mean({n: gof(measured[n], y) for n, y in runs.items()}) for model, runs in models.items()
    }
    effective = {f.name: effective_samples(f.measured - f.simulated) for f in fits}
    criterion = {
        model: _with_mean(
            {n: bic(measured[n], models[model][n], counts[model] + 1, effective[n]) for n in measured}
        )
        for model in counts
    }
    return Identification(fits, pooled, rig, quality, criterion, warnings_of(excitations, fits), notes, shown)


def _with_mean(values: dict[str, float]) -> dict[str, float]:
    return {**values, "mean": float(np.mean(list(values.values())))}


def _notes(excitations, fits, nominal: Rig) -> tuple[str, ...]:
    said = [f"{x.name}: {note}" for x in excitations for note in x.notes]
    said += [
        f"{f.name}: begins with the step, and shows no offset: integer-order models have none"
        for x, f in zip(excitations, fits)
        if not x.rest_shown and not any(m.offset for m in f.integer)
    ]
    said += [
        f"{f.name}: not a step; fitted by itself, left out of T, alpha and K(p)" for f in fits if not f.step
    ]
    said += [
        f"{x.name}: a step from {x.ends[0]:.3g} to {x.ends[1]:.3g}; its K is the mean slope of K(p) p on it"
        for x, f in zip(excitations, fits, strict=True)
        if f.step and x.between
    ]
    if isinstance(nominal.actuator, LinearActuator):
        said.append(
            "the rig's actuator was a transfer function; the identified one is K(p) p through "
            "1/(T s^alpha + 1)"
        )
    sources = {(f.driven_by, f.fitted) for f in fits}
    inputs = {"pressure": "measured pressure", "command": "command through the regulator"}
    outputs = {"curvature": "curvature", "output": "output through the sensor"}
    said += [
        f"driven by the {inputs[driven]}, fitted to the {outputs[fitted]}"
        for driven, fitted in sorted(sources)
    ]
    return tuple(said)
