"""What an experiment may do to a rig: how far, how fast, how long, and from where.

The input goes where the logs have been, within ``[ranges]``, and at first no faster than there: what has been
survived is known to be safe. What other signals do is predicted by simulation; they may go where ``[ranges]``
allows and where the logs have been.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.logs.experiment import Experiment
from focgen.rig.response import integrations, longest, response_time
from focgen.rig.rig import Rig

_JUMP = 0.1  # of the input's span: a change by more in one sample is a step, and steps are allowed
_BELOW = 0.1  # of the input's magnitude: a range that reaches as far below rest goes both ways
_BEYOND = 0.05  # of a signal's span: what logs let it go beyond what they showed
_LEAST = 20.0  # response times: a shorter experiment shows little, however short the session was
_LONGEST = 600.0  # response times of one experiment, however long the session was
_FINE = 200  # samples of a response time that experiments are planned in
_MARGIN = 0.1  # of the range of a rig that integrates: kept free, for what pushes it is known to a part only


@dataclass(frozen=True)
class InputLimits:
    """The input from ``low`` to ``high`` about ``rest``, at no more than ``rate`` a second (inf: steps are
    allowed), for at most ``seconds``; the rig responds in ``response`` s. Experiments are planned in samples
    of ``h`` s, ``coarse`` of the logs' each. ``integrates``: how often the rig integrates its input."""

    low: float
    high: float
    rest: float
    rate: float
    seconds: float
    response: float
    h: float
    coarse: int = 1
    integrates: int = 0

    @property
    def faster(self) -> InputLimits:
        """The same with steps."""
        return replace(self, rate=np.inf)

    @property
    def two_sided(self) -> bool:
        """Whether the input goes to both sides of where it rests."""
        return self.rest - self.low > _BELOW * (self.high - self.rest)

    def of(self, levels: np.ndarray, share: float = 1.0) -> np.ndarray:
        """The input (n,) that stands for ``levels`` (n,) of −1 … 1: at most ``share`` of the way from rest to
        either end, and no faster than the rate allows."""
        levels = share * np.asarray(levels, float)
        wanted = self.rest + np.where(levels > 0, self.high - self.rest, self.rest - self.low) * levels
        return _slowed(wanted, self.rest, self.rate * self.h)


@dataclass(frozen=True)
class Bounds:
    """What other signals may reach, (low, high) by role, and where the output of a rig that integrates stands
    at the begin: where the logs left it, or where it has to be brought first (not ``left``), the middle of
    its range."""

    ends: Mapping[str, tuple[float, float]]
    stands: float | None = None
    left: bool = True

    def _placed(self, output: np.ndarray) -> np.ndarray:
        return output if self.stands is None else output - output[0] + self.stands

    def hold(self, made: Mapping[str, np.ndarray]) -> bool:
        """Whether all signals ``made`` stay inside, the output counted from where it stands."""
        for role, (low, high) in self.ends.items():
            if role in made:
                signal = self._placed(made[role]) if role == "output" else made[role]
                if not np.all(np.isfinite(signal)) or signal.min() < low or signal.max() > high:
                    return False
        return True


def limits_of(rig: Rig, logs: Sequence[Experiment], entry: str) -> InputLimits:
    """What may be done with the input ``entry``, by the rig's ranges and the session so far."""
    h = logs[0].sample_time
    response = response_time(rig, h, longest(logs))
    signals = [np.asarray(log[entry], float) for log in logs]
    low, high = _ends(signals)
    stated = getattr(rig.ranges, entry, None)
    if stated is not None and max(low, stated[0]) < min(high, stated[1]):
        low, high = max(low, stated[0]), min(high, stated[1])
    rest = _rest(signals, low, high)
    if integrations(rig) and low < rest < high:  # what pushes it one way is to push it back as far
        low, high = (rest + sign * min(high - rest, rest - low) for sign in (-1.0, 1.0))
    session = sum(len(log) * log.sample_time for log in logs)
    seconds = min(max(session, _LEAST * response), _LONGEST * response)
    coarse = max(1, int(response / _FINE / h))
    return InputLimits(
        low, high, rest, _rate(signals, h), seconds, response, coarse * h, coarse, integrations(rig)
    )


def bounds_of(rig: Rig, logs: Sequence[Experiment]) -> Bounds:
    """What pressure and output may reach."""
    found = {}
    for role in ("pressure", "output"):
        stated = getattr(rig.ranges, role)
        seen = [np.asarray(log[role], float) for log in logs if role in log]
        ends = ([stated] if stated is not None else []) + ([_widened(*_ends(seen), _BEYOND)] if seen else [])
        if ends:
            found[role] = min(low for low, _ in ends), max(high for _, high in ends)
    if not integrations(rig):
        return Bounds(found)
    stated = rig.ranges.output or _ends([np.asarray(log["output"], float) for log in logs])
    low, high = found["output"] = _widened(*stated, -_MARGIN)
    stands = float(np.asarray(logs[-1]["output"], float)[-1])
    return Bounds(found, stands if low < stands < high else 0.5 * (low + high), low < stands < high)


def _rest(signals: Sequence[np.ndarray], low: float, high: float) -> float:
    """Where the input rests: at 0 where it has been there, else where experiments begin."""
    begins = float(np.median([s[0] for s in signals]))
    near = 0.02 * (high - low)
    return float(np.clip(0.0 if low - near <= 0.0 <= high + near else begins, low, high))


def _rate(signals: Sequence[np.ndarray], h: float) -> float:
    low, high = _ends(signals)
    fastest = max(float(np.max(np.abs(np.diff(s)), initial=0.0)) for s in signals)
    return np.inf if fastest >= _JUMP * (high - low) else fastest / h


def _ends(signals: Sequence[np.ndarray]) -> tuple[float, float]:
    return min(float(s.min()) for s in signals), max(float(s.max()) for s in signals)


def _widened(low: float, high: float, share: float) -> tuple[float, float]:
    return low - share * (high - low), high + share * (high - low)


def _slowed(wanted: np.ndarray, rest: float, most: float) -> np.ndarray:
    """``wanted`` (n,) followed from ``rest`` by at most ``most`` a sample."""
    if not np.isfinite(most):
        return wanted
    found, now = np.empty(len(wanted)), rest
    for i, level in enumerate(wanted):
        now += min(max(float(level) - now, -most), most)
        found[i] = now
    return found
