"""``signals.json``: what the figures of a diagnosis draw, so that they can be drawn from its folder alone."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from focgen.control.units import units_of_rig
from focgen.diagnosis.explain import Explanation
from focgen.diagnosis.fit import problem_residual
from focgen.diagnosis.model import Evidence
from focgen.errors import InputError
from focgen.jsontext import fits, plain, read_json
from focgen.logs.experiment import Experiment
from focgen.logs.thinning import thinned
from focgen.rig.model import Rig

_SWEEPING = 20  # of 50 places in its range: an input that visits fewer only steps
FILE = "signals.json"
MOST = 8000
"""Samples of all experiments together that are kept."""
_FEWEST = 300  # of one experiment
_DIGITS = 6  # of a number
_STILL = 0.02  # of the largest rate: below it the input holds
LOGGED = ("command", "pressure", "curvature", "output")


@dataclass(frozen=True, eq=False)
class Trace:
    """One experiment's input and output: measured, and simulated by the rig as given, refitted, and with the
    effects; (n,) all, at ``time`` s after ``start`` on the session's clock."""

    name: str
    start: float
    time: np.ndarray
    input: np.ndarray
    measured: np.ndarray
    as_given: np.ndarray
    refitted: np.ndarray
    explained: np.ndarray


@dataclass(frozen=True)
class SegmentError:
    """Root-mean-square residual between two signals on the measured input, % of the output's range."""

    entry: str
    exit: str
    as_given: float
    refitted: float
    explained: float


@dataclass(frozen=True, eq=False)
class Mean:
    """The mean residual over ``place``, (n,) both: ``over`` level, rate or time, while the input goes ``way``
    (rising, falling, any), of the model ``refitted`` or ``explained``."""

    over: str
    way: str
    of: str
    place: np.ndarray
    mean: np.ndarray


@dataclass(frozen=True)
class Rivals:
    """The families that were tried for one cause, by how many standard deviations they are behind it."""

    found: str
    effects: tuple[str, ...]
    separations: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Drawn:
    """All of it. ``entry``: the role of the traces' input; ``units`` by role; ``worst``: the segment that the
    means are of; ``kept`` of ``samples`` are there."""

    entry: str
    units: dict[str, str]
    samples: int
    kept: int
    traces: tuple[Trace, ...]
    segments: tuple[SegmentError, ...]
    worst: tuple[str, str]
    means: tuple[Mean, ...]
    rivals: tuple[Rivals, ...]


def drawn_of(rig: Rig, evidence: Evidence, logs: Sequence[Experiment]) -> Drawn:
    """What is drawn of a diagnosis, signals thinned to :data:`MOST` samples."""
    entry, worst = entry_of(logs), worst_of(evidence)
    traces = tuple(_trace(evidence, logs, i, entry) for i in range(len(logs)))
    return Drawn(
        entry=entry,
        units=units_of_rig(rig),
        samples=sum(map(len, logs)),
        kept=sum(len(trace.time) for trace in traces),
        traces=traces,
        segments=tuple(map(_error, evidence.explanations)),
        worst=(worst.segment.entry, worst.segment.exit),
        means=_means_of(worst),
        rivals=tuple(
            Rivals(
                cause.rivals[0].effect,
                tuple(r.effect for r in cause.rivals),
                tuple(float(r.separation) for r in cause.rivals),
            )
            for e in evidence.explanations
            for cause in e.causes
        ),
    )


def entry_of(logs: Sequence[Experiment]) -> str:
    """The first signal that every experiment has."""
    return "command" if all("command" in log for log in logs) else "pressure"


def sweeps(x: np.ndarray) -> bool:
    """Whether an input (n,) runs through its range instead of stepping: it visits many fiftieths of it."""
    places = np.round((x - x.min()) / max(float(np.ptp(x)), 1e-300) * 50)
    return len(np.unique(places)) >= _SWEEPING


def worst_of(evidence: Evidence) -> Explanation:
    """The segment whose residual the effects reduce most."""
    return max(evidence.explanations, key=_gap_ratio)


def _gap_ratio(e: Explanation) -> float:
    return float(
        np.mean(problem_residual(e.nominal) ** 2) / max(np.mean(problem_residual(e.best) ** 2), 1e-300)
    )


def _trace(evidence: Evidence, logs: Sequence[Experiment], i: int, entry: str) -> Trace:
    made = [evidence.simulated[name][i]["output"] for name in ("as given", "refitted", "explained")]
    log = logs[i]
    most = max(_FEWEST, MOST * len(log) // max(1, sum(map(len, logs))))
    kept = thinned(log[entry], log["output"], *made[1:], most=most)
    signals = (log.time, log[entry], log["output"], *made)
    return Trace(log.name, float(log.start), *(np.asarray(s, float)[kept] for s in signals))


def segment_errors(e: Explanation) -> tuple[float, float, float]:
    """Root-mean-square residuals as given, refitted, and with the effects, % of the output's range."""
    parts = [e.nominal.problem.residual(e.given), problem_residual(e.nominal), problem_residual(e.best)]
    given, refitted, best = (float(np.sqrt(np.mean(p**2))) / e.segment.level_out * 100 for p in parts)
    return given, refitted, best


def _error(e: Explanation) -> SegmentError:
    return SegmentError(e.segment.entry, e.segment.exit, *segment_errors(e))


# ------------------------------------------------------------------------------ what a segment leaves


def steady(x: np.ndarray, run) -> np.ndarray:
    """An input without its noise: medians of 0.25 s, experiment by experiment."""
    width = 2 * max(1, round(0.125 / run.h)) + 1
    parts = [median_filter(x[a:b], width, mode="nearest") for a, b in run.spans]
    return np.concatenate([uniform_filter1d(p, width, mode="nearest") for p in parts])


def rate_of(level: np.ndarray, run) -> np.ndarray:
    """Its rate of change, 1/s."""
    return np.concatenate([np.gradient(level[a:b], run.h) for a, b in run.spans])


def way_of(rate: np.ndarray) -> np.ndarray:
    """1 where an input rises, −1 where it falls, 0 where it holds."""
    still = _STILL * np.quantile(np.abs(rate), 0.99)
    return np.where(np.abs(rate) <= still, 0, np.sign(rate))


def means(place: np.ndarray, values: np.ndarray, bins: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Mean of ``values`` (n,) over equal bins of ``place`` (n,) that hold enough samples."""
    if len(place) == 0:
        return np.array([]), np.array([])
    edges = np.linspace(place.min(), place.max() + 1e-300, bins + 1)
    index = np.clip(np.digitize(place, edges) - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    sums = np.bincount(index, weights=values, minlength=bins)
    kept = count >= max(5, 0.002 * len(place))
    return 0.5 * (edges[1:] + edges[:-1])[kept], sums[kept] / count[kept]


def _means_of(e: Explanation) -> tuple[Mean, ...]:
    run, level = e.segment.run, steady(e.segment.x, e.segment.run)
    rate = rate_of(level, run)
    way, found = way_of(rate), []
    for of, residual in (("refitted", problem_residual(e.nominal)), ("explained", problem_residual(e.best))):
        for name, sign in (("rising", 1), ("falling", -1)):
            here = way == sign
            found.append(Mean("level", name, of, *means(level[here], residual[here])))
        found.append(Mean("rate", "any", of, *means(rate, residual)))
        found.append(Mean("time", "any", of, *means(run.clock, residual, 60)))
    return tuple(found)


# ------------------------------------------------------------------------------------------- the file


def drawn_text(found: Drawn) -> str:
    """The file's content: compact JSON, numbers to six digits, null where one is not finite."""
    text = json.dumps(_rounded(plain(found)), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text + "\n"


def _rounded(value):
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value


_CURVE = [(float, None)]
_TRACE = {"name": str, "start": float} | dict.fromkeys(
    ("time", "input", "measured", "as_given", "refitted", "explained"), _CURVE
)
_ERROR = {"entry": str, "exit": str, "as_given": float, "refitted": float, "explained": float}
_MEAN = {"over": str, "way": str, "of": str, "place": _CURVE, "mean": _CURVE}
_RIVALS = {"found": str, "effects": [str], "separations": [float]}
_SHAPE = {
    "entry": str,
    "units": dict,
    "samples": int,
    "kept": int,
    "traces": [_TRACE],
    "segments": [_ERROR],
    "worst": [str],
    "means": [_MEAN],
    "rivals": [_RIVALS],
}


def read_drawn(path: Path) -> Drawn:
    """The file read back. Raises InputError where it is none of ours."""
    remedy = "diagnose again: `focgen diagnose` writes it"
    value = read_json(path, remedy)
    if not fits(value, _SHAPE) or len(value["worst"]) != 2 or not _equally_long(value):
        raise InputError(str(path), f"is no {FILE} of a diagnosis", remedy)
    value["units"] = {role: str(value["units"].get(role, "")) for role in LOGGED}
    value["worst"] = tuple(value["worst"])
    for key, kind in (("traces", Trace), ("segments", SegmentError), ("means", Mean), ("rivals", Rivals)):
        value[key] = tuple(kind(**{k: _array(v) for k, v in one.items()}) for one in value[key])
    return Drawn(**{key: value[key] for key in _SHAPE})


def _equally_long(value: dict) -> bool:
    """Whether all curves of a trace, and of a mean, have as many numbers."""
    parts = [*value["traces"], *value["means"], *value["rivals"]]
    return all(len({len(v) for v in part.values() if isinstance(v, list)}) == 1 for part in parts)


def _array(value):
    if not isinstance(value, list):
        return value
    return tuple(value) if value and isinstance(value[0], str) else np.array(value, float)
