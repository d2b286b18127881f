"""``signals.json``: what the figures of a diagnosis draw, so that they can be drawn from its folder alone."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.errors import InputError
from focgen.jsontext import UNWRITTEN, check_tied, fits, plain, read_json

_SWEEPING = 20  # of 50 places in its range: an input that visits fewer only steps
FILE = "signals.json"
_DIGITS = 6  # of a number
LOGGED = ("command", "pressure", "curvature", "output")


@dataclass(frozen=True, eq=False)
class Trace:
    """One experiment's input and output: measured, and simulated by the rig as given, refitted, and with the
    effects; (n,) all, at ``time`` s after ``start`` on the session's clock."""

    name: str
    start: float
    time: Array
    input: Array
    measured: Array
    as_given: Array
    refitted: Array
    explained: Array


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
    place: Array
    mean: Array


@dataclass(frozen=True)
class Rivals:
    """The families that were tried for one cause, by how many standard deviations they are behind it."""

    found: str
    effects: tuple[str, ...]
    separations: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Residual:
    """What the worst segment leaves, (n,) all, thinned: the input's ``level``, its ``rate`` (1/s) and ``way``
    (1 rising, −1 falling, 0 holding), the session's ``clock`` (s), the error ``refitted`` and ``explained``.
    """

    level: Array
    rate: Array
    way: Array
    clock: Array
    refitted: Array
    explained: Array


@dataclass(frozen=True, eq=False)
class Drawn:
    """All of it. ``entry``: the role of the traces' input; ``units`` by role; ``worst``: the segment that the
    means are of; ``kept`` of ``samples`` are there. ``residual`` is not in the file: None where it was read
    from one."""

    entry: str
    units: dict[str, str]
    samples: int
    kept: int
    traces: tuple[Trace, ...]
    segments: tuple[SegmentError, ...]
    worst: tuple[str, str]
    means: tuple[Mean, ...]
    rivals: tuple[Rivals, ...]
    residual: Residual | None = field(default=None, metadata=UNWRITTEN)


def sweeps(x: Array) -> bool:
    """Whether an input (n,) runs through its range instead of stepping: it visits many fiftieths of it."""
    places = np.round((x - x.min()) / max(float(np.ptp(x)), 1e-300) * 50)
    return len(np.unique(places)) >= _SWEEPING


# ------------------------------------------------------------------------------------------- the file


def drawn_text(found: Drawn) -> str:
    """The file's content: compact JSON, numbers to six digits, null where one is not finite."""
    text = json.dumps(_rounded(plain(found)), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text + "\n"


def _rounded(value: Any) -> Any:
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
_MEAN = {
    "over": re.compile("level|rate|time"),
    "way": re.compile("rising|falling|any"),
    "of": re.compile("refitted|explained"),
    "place": _CURVE,
    "mean": _CURVE,
}
_RIVALS = {"found": str, "effects": [str], "separations": [float]}
_SHAPE: dict[str, Any] = {
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
    """The file read back. Raises InputError where it is none of ours, or of another diagnosis than the one
    beside it."""
    remedy = "diagnose again: `focgen diagnose` writes it"
    value = read_json(path, remedy)
    if not fits(value, _SHAPE) or len(value["worst"]) != 2 or not _equally_long(value):
        raise InputError(str(path), f"is no {FILE} of a diagnosis", remedy)
    check_tied(value, path, path.with_name("diagnosis.json"), remedy)
    value["units"] = {role: str(value["units"].get(role, "")) for role in LOGGED}
    value["worst"] = tuple(value["worst"])
    for key, kind in (("traces", Trace), ("segments", SegmentError), ("means", Mean), ("rivals", Rivals)):
        parts = _SHAPE[key][0]
        value[key] = tuple(kind(**{k: _array(one[k]) for k in parts}) for one in value[key])
    return Drawn(**{key: value[key] for key in _SHAPE})


def _equally_long(value: dict[str, Any]) -> bool:
    """Whether all curves of a trace, and of a mean, have as many numbers."""
    parts = [*value["traces"], *value["means"], *value["rivals"]]
    return all(len({len(v) for v in part.values() if isinstance(v, list)}) == 1 for part in parts)


def _array(value: Any) -> Any:
    if not isinstance(value, list):
        return value
    return tuple(value) if value and isinstance(value[0], str) else np.array(value, float)
