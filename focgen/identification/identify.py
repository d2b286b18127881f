"""``identify``: from the logs of a rig to its fractional model, compared with integer-order ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arguments import checked
from focgen.custody import identified_from
from focgen.errors import FitError, LogError, check_choice
from focgen.identification.bent import turns_within
from focgen.identification.caveats import effects_left_out, warnings_of
from focgen.identification.digits import told_gain, told_value
from focgen.identification.excitation import Excitation, is_driven
from focgen.identification.fed import fed
from focgen.identification.form import lack_of_form
from focgen.identification.fractional import FractionalFit
from focgen.identification.gain import check_degree, r2_of_line
from focgen.identification.identification import ExperimentFit, Identification, Joint, Unseen
from focgen.identification.joint_fit import JointFit, joint_fit
from focgen.identification.known_actuator import answer_from_its_past
from focgen.identification.lacking import check_alike
from focgen.identification.looped import loop_told
from focgen.identification.quality import bic, effective_samples, gof
from focgen.identification.ranges import seen_ranges
from focgen.identification.ready import befores_of, prepared, running
from focgen.identification.remarks import remarks_of
from focgen.identification.single import fit_each, is_step
from focgen.identification.stage_notes import early_told
from focgen.identification.stages import StageFit, identify_stage
from focgen.identification.sure import actuator_uncertainty, is_compromise, with_stages
from focgen.identification.zero import shared_zero
from focgen.logs.experiment import Experiment
from focgen.logs.notes import listed
from focgen.logs.rates import at_one_rate
from focgen.logs.read import Logs, digest_of, each_of, read_logs
from focgen.output import check_apart, write_file
from focgen.rig.ahead import told_lead
from focgen.rig.arguments import RigLike, rig_of, rig_then_logs
from focgen.rig.files import check_replaces_rig, rig_text
from focgen.rig.plausibility import doubts
from focgen.rig.response import check_bounded, longest
from focgen.rig.rig import Actuator, Rig
from focgen.rig.stages import STAGES

Quality = dict[str, dict[str, float]]
_NOT_THIS = (
    "the regulator of the rig's file is not the one that these logs show, which the actuator is fitted "
    "behind: give --stages regulator,actuator to have it written"
)
_COMPROMISE = (
    "what the model cannot follow outweighs the noise: T, alpha and K(p) are a compromise, and known "
    "no better than [uncertainty] says, whatever their intervals"
)


@rig_then_logs
@checked
def identify(
    rig: RigLike,
    logs: Logs,
    out: str | Path | None = None,
    from_: float | None = None,
    to: float | None = None,
    gain_degree: int = 1,
    unseen: Logs = (),
    stages: Sequence[str] = ("actuator",),
    delay: bool = False,
    integer: bool = True,
) -> Identification:
    """Fit K(p) p through e^(−Ls)/(T s^α + 1), eq. (3) to (5), to all experiments at once.

    ``rig`` (its file, a dictionary like it, or a :class:`Rig`) names the columns, and has the regulator and
    the sensor that the actuator is seen through. ``logs`` (files, frames, dictionaries of arrays, or
    experiments) are one session of it; ``from_`` and ``to`` cut each experiment, s within it.
    ``gain_degree`` is the degree of K(p); where the logs show fewer levels than that needs, a lower one is
    taken and said. The new rig is written to ``out`` where given.

    The input is the measured pressure where logged, else the command through the regulator; fitted is the
    curvature where logged, else the output through the sensor. ``unseen`` are logs that the identified rig is
    shown against, but not fitted to. ``stages``: which of regulator, actuator and sensor are identified, the
    first and the last from their own signals. ``delay``: whether the actuator's dead time is fitted.
    ``integer``: whether integer-order models are fitted to each experiment for comparison.

    Raises LogError, RigError or FitError; nothing is written then.
    """
    shown, given = each_of(unseen), each_of(logs)
    inputs = (*given, rig, *shown)
    if out is not None:
        check_apart([out], inputs)
        check_replaces_rig(out)
    check_degree(gain_degree)
    if not stages:
        raise FitError("--stages", "names no stage", f"give one or more of {', '.join(STAGES)}")
    for stage in stages:
        check_choice("--stages", stage, STAGES, FitError)
    nominal = rig_of(rig)
    experiments = _read(given, nominal, from_, to)
    others = _read(shown, nominal, None, None) if shown else ()
    _check_unseen(experiments, others)
    check_bounded(replace(nominal, actuator=None), longest(experiments))
    found = {s: identify_stage(experiments, s, nominal.between) for s in stages if s != "actuator"}
    ranges, told = seen_ranges(nominal.ranges, experiments)
    new = _with_stages(replace(nominal, ranges=ranges, effects=()), found)
    if "actuator" in stages:
        by, rival = fed(experiments, new, found.get("regulator"))
        result = _behind(_actuator(experiments, others, by, rival, gain_degree, delay, integer), by, new)
    else:
        result = Identification((), None, new, {}, {}, (), ())
    result = _sensor_again(replace(result, stages=found), experiments)
    warnings = effects_left_out(nominal) + doubts(nominal, experiments) + result.warnings
    notes = remarks_of(experiments, nominal, result) + told + result.notes
    result = replace(result, warnings=warnings, notes=notes)
    if out is not None:
        options = {
            "from": from_,
            "to": to,
            "gain_degree": gain_degree,
            "stages": list(stages),
            "delay": delay,
        }
        write_file(out, rig_text(result.rig) + identified_from(inputs, out, options), inputs)
    return result


def _behind(result: Identification, ahead: Rig, rig: Rig) -> Identification:
    """What was found behind what was ``ahead``, with the regulator of the ``rig`` again."""
    found = result.rig
    if ahead is rig:
        return result
    delays = replace(found.delays, regulator=rig.delays.regulator)
    known = replace(found.uncertainty, regulator=rig.uncertainty.regulator)
    own: dict[str, Any] = {"lead": rig.lead, "between": rig.between, "regulator": rig.regulator}
    told = (_NOT_THIS,) if ahead.regulator != rig.regulator else ()
    found = replace(found, delays=delays, uncertainty=known, **own)
    return replace(result, rig=found, notes=result.notes + told)


def _sensor_again(result: Identification, experiments: Sequence[Experiment]) -> Identification:
    """With the sensor fitted anew, where its curvature turns within samples: what that does there is known
    once the actuator is."""
    rig = result.rig
    if "sensor" not in result.stages or not turns_within(rig, experiments[0].sample_time):
        return result
    try:
        again = identify_stage(experiments, "sensor", rig.between, rig)
    except FitError:
        return result
    if not again.leaves_less_than(result.stages["sensor"]):  # the actuator is then not what drives it
        return result
    found = {"sensor": again}
    return replace(result, rig=_with_stages(rig, found), stages=result.stages | found)


def _read(logs: Logs, rig: Rig, first: float | None, last: float | None) -> tuple[Experiment, ...]:
    limits = rig.ranges.stated()
    return at_one_rate(read_logs(logs, rig.signals, rig.sample_time, first, last, limits))


def _check_unseen(fitted: Sequence[Experiment], shown: Sequence[Experiment]) -> None:
    """Raise LogError where a log to show holds the samples of one that is fitted, under whatever name."""
    known = {digest_of(log): log.name for log in fitted}
    for log in shown:
        if (name := known.get(digest_of(log))) is not None:
            what = f"holds the samples of {name}, which is fitted"
            raise LogError(f"--unseen {log.name}", what, "give a log that is not among those fitted")


def _with_stages(rig: Rig, found: dict[str, StageFit]) -> Rig:
    """The rig with its regulator and sensor as identified."""
    delays = replace(rig.delays, **{name: fit.delay for name, fit in found.items()})
    lead = rig.lead
    if "regulator" in found:  # whose command shows it
        lead = told_lead(found["regulator"].parameters.get("lead", (0.0, 0.0))[0])
    transfers: dict[str, Any] = {name: fit.transfer for name, fit in found.items()}
    known = with_stages(rig.uncertainty, found)
    rig = replace(rig, delays=delays, uncertainty=known, lead=lead, **transfers)
    return running(rig, found["regulator"].between) if "regulator" in found else rig


def _actuator(
    experiments: Sequence[Experiment],
    others: Sequence[Experiment],
    rig: Rig,
    rival: Rig | None,
    degree: int,
    delay: bool,
    integer: bool,
) -> Identification:
    """The identification of the actuator; ``rig`` has the regulator and the sensor it is seen through, and
    ``rival`` another regulator that may be."""
    if rig.delays.actuator and not delay:
        rig = replace(rig, delays=replace(rig.delays, actuator=0.0))
    check_alike(experiments, rig)
    driven = [e for e in experiments if is_driven(e)]
    used = driven or experiments
    joined = joint_fit(used, rig, degree, delay, rival)
    rig, found = joined.rig, joined.found
    excitations, fit = found.excitations, found.fit
    excitations = [x.bare() for x in excitations]  # a long log's spectra are large
    fits, failed = fit_each(excitations, fit.pasts, fit.delay, integer)
    joint, compromise = _joint(excitations, fit, fits), is_compromise(excitations, fit)
    loosely = compromise or found.width > 0.0  # a play is no rig's loop to the letter
    known = replace(actuator_uncertainty(excitations, fit, loosely), form=lack_of_form(excitations, fit))
    zero, of_sensor = shared_zero(excitations, fit), excitations[0].fitted_role == "output"
    actuator = Actuator(joint.T, joint.alpha, joint.gain, 0.0 if of_sensor else zero)
    new = replace(
        rig,
        actuator=actuator,
        zero=zero if of_sensor else rig.zero,
        delays=replace(rig.delays, actuator=joint.delay),
        lead=told_lead(joined.lead) if excitations[0].input_role == "command" else rig.lead,
        uncertainty=replace(rig.uncertainty, actuator=known),
    )
    joint = _as_written(joint, joined, actuator)
    quality, criterion = _compared(excitations, fits, joint)
    shown = _shown(others, new, joined.lead)
    warnings = loop_told(found) + warnings_of(excitations, fit, fits, failed, {} if found.width else quality)
    told = early_told(joined.lead, excitations[0].step, excitations[0].fitted_role)
    told += joined.lowered + _told(experiments, excitations) + _zero_told(zero, excitations[0])
    if compromise:
        told += (_COMPROMISE,)
    return Identification(tuple(fits), joint, new, quality, criterion, warnings, told, shown)


def _as_written(joint: Joint, joined: JointFit, actuator: Actuator) -> Joint:
    """The same with what the rig that is written makes of the input: it has no loop."""
    if not joined.found.width:
        return joint
    made = {x.name: answer_from_its_past(x, actuator, joint.delay) for x in joined.plain}
    return replace(joint, play=told_value(joined.found.width, 0.0), simulated=made)


def _told(experiments: Sequence[Experiment], excitations: list[Excitation]) -> tuple[str, ...]:
    """What the experiments were taken for."""
    told, used = [], {x.name for x in excitations}
    if still := [e.name for e in experiments if e.name not in used]:
        told.append(f"{listed(still)}: not used, for the input rests throughout")
    if between := [x.name for x in excitations if is_step(x) and x.between]:
        told.append(
            f"{listed(between)}: steps between two levels; each K is the mean slope of K(p) p on its step"
        )
    if begun := [x.name for x in excitations if not x.rest_shown]:
        verb = "begins with its step" if len(begun) == 1 else "each begin with their step"
        told.append(f"{listed(begun)} {verb}: taken as at rest at 0 before")
    return tuple(told)


def _zero_told(zero: float, x: Excitation) -> tuple[str, ...]:
    if not zero:
        return ()
    stage = "sensor" if x.fitted_role == "output" else "actuator"
    held = f"where the {x.input_role} is 0 the {x.fitted_role} is {zero:g}"
    return (f"{held}, in all experiments together: written as the offset of the {stage}",)


def _joint(excitations: list[Excitation], fit: FractionalFit, fits: list[ExperimentFit]) -> Joint:
    half: dict[str, Any] = dict(fit.half)
    T, alpha = told_value(fit.T, half["T"]), told_value(fit.alpha, half["alpha"])
    gain = told_gain(fit.gain, half["gain"])
    names = [x.name for x in excitations]
    ci95: dict[str, Any] = {
        "T": _span(fit.T, half["T"]),
        "alpha": _span(fit.alpha, half["alpha"]),
        "gain": tuple(map(_span, fit.gain, half["gain"])),
    }
    if half["delay"]:
        low, high = _span(fit.delay, half["delay"])
        ci95["delay"] = max(low, 0.0), high  # nothing answers ahead of its input
    return Joint(
        T=T,
        alpha=alpha,
        delay=told_value(fit.delay, half["delay"]),
        gain=gain,
        gain_r2=r2_of_line(excitations, fits, len(gain) - 1),
        ci95=ci95,
        simulated=dict(zip(names, fit.simulated)),
        pasts={name: past for name, past in zip(names, fit.pasts) if past is not None and past.steps},
        closed_loop=fit.closed_loop,
    )


def _span(value: float, half: float) -> tuple[float, float]:
    return float(value - half), float(value + half)


def _shown(experiments: Sequence[Experiment], rig: Rig, lead: float) -> tuple[Unseen, ...]:
    """Logs beside what the identified rig makes of their input, each from the initial state that it asks
    for; ``lead``: s by which their command is ahead of its rows."""
    actuator: Any = rig.actuator
    powers = len(actuator.gain)
    made = [prepared(e, rig, powers, befores_of([e], rig, powers)[0], lead) for e in experiments]
    return tuple(
        Unseen(x.name, x.pressure, x.measured, y, gof(x.measured, y), not is_step(x))
        for x, y in ((x, answer_from_its_past(x, actuator, rig.delays.actuator)) for x in made)
    )


def _compared(
    excitations: Sequence[Excitation], fits: list[ExperimentFit], joint: Joint
) -> tuple[Quality, Quality]:
    """GOF and Schwarz's criterion of every model in every experiment."""
    measured = {x.name: x.measured for x in excitations}
    models = {"fom": {f.name: f.simulated for f in fits}}
    counts = {"fom": 3}
    for i, shape in enumerate(fits[0].integer if fits else ()):
        models[f"iom_{shape.name}"] = {f.name: f.integer[i].simulated for f in fits}
        counts[f"iom_{shape.name}"] = shape.parameters
    models["rig"] = joint.simulated
    shown = [f.name for f in fits]  # a mean is of the rows above it
    quality = {
        m: _with_mean({n: gof(measured[n], y) for n, y in runs.items()}, shown) for m, runs in models.items()
    }
    effective = {f.name: effective_samples(f.measured - f.simulated) for f in fits}
    criterion = {
        model: _with_mean(
            {n: bic(measured[n], models[model][n], counts[model] + 1, effective[n]) for n in effective}, shown
        )
        for model in counts
    }
    return quality, criterion


def _with_mean(values: dict[str, float], shown: Sequence[str]) -> dict[str, float]:
    return {**values, "mean": float(np.mean([values[name] for name in shown]))}
