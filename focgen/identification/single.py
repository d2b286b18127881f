"""Every experiment fitted by itself, for Table I: K/(T s^α + 1) and integer-order models."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from focgen.errors import FitError
from focgen.identification.excitation import Excitation
from focgen.identification.fractional import FractionalFit, fit_fractional
from focgen.identification.identification import ExperimentFit
from focgen.identification.integer import IntegerFit, fit_integer_models
from focgen.identification.past import Past
from focgen.identification.quality import gof
from focgen.identification.sure import has_numbers
from focgen.logs.between import noise_level
from focgen.pools import pool
from focgen.progress import track

_STEADY = 0.1  # of the step: nearer to its level than this, the input is at it
_STAY = 0.15  # of the experiment: a step's input stays at its level at least so long
_OTHER = 0.2  # of the step: so far from both ends of it, the input is held at another level …
_HELD = 0.05  # … if for so much of the experiment …
_MOVES = 0.02  # … it moves by less than this part of the step,
_NOISE = 6.0  # or than so many standard deviations of its noise
_CLEAR = 1.5  # half 95 % intervals, beyond which an offset is there (one in 300 by chance)
_NO_OFFSET = 1e-3  # of the measured reach: an offset below this is none
_WORTH_PROCESSES = 20_000  # samples of all experiments: fewer are done before processes have started


def fit_each(
    excitations: Sequence[Excitation], pasts: Sequence[Past | None], delay: float, integer: bool
) -> tuple[list[ExperimentFit], list[str]]:
    """Fit each experiment; also the names of those that do not determine K, T and α by themselves.

    ``pasts`` and ``delay`` (s) as found from all together; ``integer``: integer-order models, too. Raises
    FitError where none of them does.
    """
    fits: list[FractionalFit | None] = []
    failed: list[str] = []
    singles = [x.with_powers(1) for x in excitations]
    for x, past in track(list(zip(singles, pasts)), "fitting experiment"):
        try:
            fit = fit_fractional([x], delay, [past])
        except FitError:
            fit = None
        found = fit if fit is not None and has_numbers(fit) else None
        fits.append(found)
        if found is None:
            failed.append(x.name)
    if len(failed) == len(fits):
        what = "none of them determines K, T and alpha by itself"
        remedy = "hold steps longer, lower the noise, or log each step as a run of its own"
        raise FitError(", ".join(failed), what, remedy)
    done = [(x, fit) for x, fit in zip(singles, fits) if fit is not None]
    models = _integer_models(done) if integer else [()] * len(done)
    return [_experiment_fit(x, fit, more) for (x, fit), more in zip(done, models)], failed


def is_step(x: Excitation) -> bool:
    """Whether the input stays at its level for a good part of the time without a break, and is held at no
    other one but the one before: a staircase is no step."""
    there = np.abs(x.pressure - x.level) <= _STEADY * abs(x.level - x.before)
    ends = np.flatnonzero(~np.concatenate([[False], there, [False]]))
    return bool(np.diff(ends).max() - 1 >= _STAY * len(x)) and not _has_other_level(x)


def _has_other_level(x: Excitation) -> bool:
    """Whether the input is held anywhere else than at both ends of its step."""
    span, half = abs(x.level - x.before), max(int(0.5 * _HELD * len(x)), 2)
    still = max(_MOVES * span, _NOISE * noise_level(x.pressure))
    away = np.minimum(np.abs(x.pressure - x.level), np.abs(x.pressure - x.before)) > _OTHER * span
    if still > 0.5 * _OTHER * span or not away.any():
        return False
    size = 2 * half + 1
    moved = maximum_filter1d(x.pressure, size) - minimum_filter1d(x.pressure, size)
    return bool(np.any(away[half:-half] & (moved[half:-half] <= still)))


def _number(fit: FractionalFit, name: str) -> float:
    """The half interval of a single parameter."""
    return float(fit.half[name])


def _experiment_fit(x: Excitation, fit: FractionalFit, integer: tuple[IntegerFit, ...]) -> ExperimentFit:
    half = {"K": float(np.ravel(fit.half["gain"])[0]), "T": _number(fit, "T"), "alpha": _number(fit, "alpha")}
    found = {"K": fit.K, "T": fit.T, "alpha": fit.alpha}
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
        integer=integer,
        step=is_step(x),
        past=fit.pasts[0] is not None and fit.pasts[0].steps > 0,
    )


def _integer_models(done: list[tuple[Excitation, FractionalFit]]) -> list[tuple[IntegerFit, ...]]:
    """The integer-order models of each experiment, on all cores where that is worth it."""
    offsets = [_needs_offset(x, fit) for x, fit in done]
    runs = [x for x, _ in done]
    count = min(len(runs), os.cpu_count() or 1)
    if count < 2 or sum(map(len, runs)) < _WORTH_PROCESSES:
        return [fit_integer_models(x, o) for x, o in track(list(zip(runs, offsets)), "integer orders")]
    with pool(count) as called:
        found = called.map(fit_integer_models, [x.bare() for x in runs], offsets)
        return list(track(found, "integer orders", len(runs)))


def _needs_offset(x: Excitation, fit: FractionalFit) -> bool:
    """Whether integer-order models are given an offset: not where no rest is on record and none is seen.

    There it would only let a slow model jump at the step.
    """
    seen = _CLEAR * float(fit.half["offset"]) + _NO_OFFSET * np.ptp(x.measured)
    return x.rest_shown or bool(abs(fit.offset[0]) > seen)
