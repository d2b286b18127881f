"""Slips of unit, sign and column: what a log would be if one were made, and whether that is more plausible.

A slip is named only where the log as it stands is implausible, and the log without it is not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.experiment import Experiment
from focgen.logs.units import SIZES, unit_of

EXCESS = 1.5  # times its range: a signal beyond is implausible
_GAIN = 2.5  # times the nominal gain, or less than 1/2.5: implausible
_LIKELY = 1.9  # times the nominal gain: what a slip may leave
_UNUSED = 0.02  # of its range: a signal that never leaves it is implausible
_USED = 0.2  # of its range: so much of it a slip leaves used, where only the ranges tell
_TWO = 0.2  # nats: what a slip of two columns, or a factor e of an unused range, has to explain better
_FLIPPED = 0.3  # of its range: so far on the wrong side
_UPRIGHT = 0.1  # of its range: so little on the right one
_SEEN = 0.7  # correlation: below, a response tells no gain
_ATMOSPHERE = 1.01325  # bar
_WEATHER = (0.9, 1.05)  # of it: hills and weather
_REST = 0.05  # of the range of the command: at rest

Limits = Mapping[str, tuple[float, float]]
Signals = dict[str, list[Array]]


@dataclass(frozen=True)
class Slip:
    """``roles`` hold ``factor`` times what they should plus ``shift``; or, ``exchanged``, two of them each
    other's signal. ``words`` say so; of slips that explain alike the one of less ``price`` is likelier."""

    words: str
    roles: tuple[str, ...]
    factor: float = 1.0
    shift: float = 0.0
    exchanged: bool = False
    price: float = 0.0

    def undone(self, signals: Signals) -> Signals:
        """The signals without it."""
        if self.exchanged:
            a, b = self.roles
            return {**signals, a: signals[b], b: signals[a]}
        return signals | {r: [(y - self.shift) / self.factor for y in signals[r]] for r in self.roles}


@dataclass(frozen=True)
class Link:
    """``ratio``: by how much more strongly ``exit`` answers ``entry`` than it should, negative where it falls
    instead of rising; ``correlation`` with what it should be."""

    entry: str
    exit: str
    ratio: float
    correlation: float

    @property
    def known(self) -> bool:
        """Whether the response is like the expected one, up to its size and sign."""
        return abs(self.correlation) >= _SEEN

    def within(self, factor: float) -> bool:
        """Whether the ratio is right up to ``factor``, or not known."""
        return not self.known or 1.0 / factor <= self.ratio <= factor

    def in_words(self) -> str:
        """What is implausible of it."""
        if self.ratio < 0:
            return f"{self.exit} falls with {self.entry} where the nominal rig rises, or the other way round"
        return f"{self.exit} answers {self.entry} {self.ratio:.3g} times as strongly as in the nominal rig"


Response = Callable[[Signals], tuple[Link, ...]]


def doubts(
    experiments: Sequence[Experiment],
    limits: Limits,
    columns: Mapping[str, str] | None = None,
    response: Response | None = None,
) -> tuple[str, ...]:
    """One warning that names what is implausible of a session, and the most likely slip; none where all is
    plausible.

    ``limits`` are the (low, high) of each role in its unit; ``columns`` or units by role name the unit
    ("p_bar", "kPa"); ``response`` compares how signals answer each other with what they should (a nominal
    rig's; without it only the ranges tell).
    """
    signals = {
        role: [np.asarray(e[role], float) for e in experiments]
        for role in experiments[0].signals
        if role != "reference" and all(role in e for e in experiments)
    }
    response = response or (lambda _: ())
    links = response(signals)
    odd = [*_out_of_range(signals, limits), *(link.in_words() for link in links if not link.within(_GAIN))]
    absolute = _absolute(signals, limits, columns or {})
    if absolute:
        return (f"pressure rests at {_lowest(signals):.3g}; {absolute.words}?",)
    if not odd:
        return ()
    found = _most_likely(_candidates(signals, limits, columns or {}), signals, limits, response)
    beyond = _out_of_range(signals, limits)
    if found is None and not beyond and all(link.ratio > 0 for link in links if link.known):
        return ()  # a gain that is no unit's is for an identification to find
    return (f"{odd[0]}; {found.words}?" if found else f"{odd[0]}; correct [ranges], or a unit, or a sign",)


def hint(role: str, column: str, factor: float) -> str:
    """The unit that makes values larger by about ``factor``, in words, or nothing."""
    slips = [s for s in _unit_slips((role,), column, None) if _USED <= factor / s.factor <= 1.1]
    return f"{max(slips, key=lambda s: factor / s.factor).words}?" if slips else ""


def _unit_slips(roles: tuple[str, ...], column: str, span: tuple[float, float] | None) -> list[Slip]:
    """Every other unit that ``roles`` may have been logged in; ``column`` names the right one."""
    known, named = unit_of(column), " and ".join(roles)
    if known is None and "pressure" in roles:
        known = "pressure", "bar"
    unit = known[1] if known else "its unit"
    slips = []
    if roles == ("command",) and span and span[1] > 0 and abs(span[1] - 100.0) > 1.0:
        slips.append(Slip(f"command in per cent instead of {unit}", roles, 100.0 / span[1]))
    if known:
        sizes = SIZES[known[0]]
        others = {other: sizes[unit] / size for other, size in sizes.items() if other != unit}
        return slips + [Slip(f"{named} in {u} instead of {unit}", roles, f) for u, f in others.items()]
    if roles != ("command",):
        for factor in (10.0, 100.0, 1000.0):
            slips.append(Slip(f"{named} in a unit {factor:g} times smaller", roles, factor))
            slips.append(Slip(f"{named} in a unit {factor:g} times larger", roles, 1.0 / factor))
    return slips


def _candidates(signals: Signals, limits: Limits, columns: Mapping[str, str]) -> list[Slip]:
    """Every slip that might have been made: of one signal, of camera and sensor alike, or of two columns."""
    groups: list[tuple[str, ...]] = [(role,) for role in signals]
    if {"curvature", "output"} <= set(signals):
        groups.append(("curvature", "output"))
    slips = []
    for roles in groups:
        price = _TWO * (len(roles) - 1)
        of_unit = _unit_slips(roles, columns.get(roles[-1], ""), limits.get(roles[-1]))
        flipped = Slip(f"the sign of {' and '.join(roles)} flipped", roles, -1.0)
        slips += [replace(slip, price=price) for slip in [flipped, *of_unit]]
    measured = [role for role in signals if role != "command"]
    for i, a in enumerate(measured):
        for b in measured[i + 1 :]:
            words = f"the columns of {a} and {b} exchanged"
            slips.append(Slip(words, (a, b), exchanged=True, price=_TWO))
    return slips


def _most_likely(slips: list[Slip], signals: Signals, limits: Limits, response: Response) -> Slip | None:
    """The slip without which all is plausible, and most so."""
    costs = []
    for slip in slips:
        without = slip.undone(signals)
        if _out_of_range(without, limits):
            continue
        links = response(without)
        used = [_peak(without[role]) / _largest(limits[role]) for role in limits if role in without]
        least = min([_peak(without[r]) / _largest(limits[r]) for r in slip.roles if r in limits], default=1.0)
        if least < (_UNUSED if any(link.known for link in links) else _USED):
            continue
        if all(link.within(_LIKELY) for link in links):
            gains = sum(abs(np.log(link.ratio)) if link.known else 1.0 for link in links)
            unused = sum(abs(np.log(min(share, 1.0))) for share in used)
            costs.append((gains + _TWO * unused + slip.price, slip))
    return min(costs, key=lambda cost: cost[0])[1] if costs else None


def _out_of_range(signals: Signals, limits: Limits) -> list[str]:
    """What is implausible by the ranges, in words, the worst first."""
    found = []
    for role in limits:
        if role not in signals or not np.isfinite(_largest(limits[role])) or not _largest(limits[role]):
            continue
        (low, high), peak = limits[role], _peak(signals[role])
        excess = peak / _largest(limits[role])
        bottom, top = (f(f(y) for y in signals[role]) for f in (min, max))
        if excess >= EXCESS:
            words = f"{role} reaches {peak:.3g} where [ranges] allows {high:g}: {excess:.3g} times"
            found.append((excess, words))
        elif 0.0 < excess < _UNUSED:
            found.append((1 / excess, f"{role} reaches {peak:.3g} only, where [ranges] allows {high:g}"))
        elif low >= 0.0 and -bottom > _FLIPPED * high and top < _UPRIGHT * high:
            words = f"{role} is negative, down to {bottom:.3g}, where [ranges] begins at {low:g}"
            found.append((1.0, words))
    return [words for _, words in sorted(found, key=lambda entry: -entry[0])]


def _absolute(signals: Signals, limits: Limits, columns: Mapping[str, str]) -> Slip | None:
    """The slip of an absolute for a gauge pressure, where it rests at that of the air and its range begins at
    0. Within the range that is a slip only of a known unit, and no small offset, with the command at rest.
    """
    if "pressure" not in signals or "pressure" not in limits:
        return None
    low, high = limits["pressure"]
    known = unit_of(columns.get("pressure", ""))
    unit = (known or ("pressure", "bar"))[1]
    air = _ATMOSPHERE / SIZES["pressure"].get(unit, 1.0)
    rest = _lowest(signals)
    at_rest = rest > EXCESS * high or (
        known and rest > _REST * high and _commanded_rest(signals, limits.get("command"))
    )
    if abs(low) > _REST * high or not _WEATHER[0] <= rest / air <= _WEATHER[1] or not at_rest:
        return None
    slip = Slip("absolute instead of gauge pressure", ("pressure",), shift=rest)
    return None if _peak(slip.undone(signals)["pressure"]) > EXCESS * high else slip


def _commanded_rest(signals: Signals, span: tuple[float, float] | None) -> bool:
    """Whether the lowest pressure comes with a command at the lower end of its range."""
    if "command" not in signals or span is None:
        return False
    pressure, command = (np.concatenate(signals[role]) for role in ("pressure", "command"))
    resting = command[pressure <= np.quantile(pressure, 0.02)]
    return bool(np.median(resting) <= span[0] + _REST * (span[1] - span[0]))


def _lowest(signals: Signals) -> float:
    return float(np.quantile(np.concatenate(signals["pressure"]), 0.01))


def _peak(parts: Sequence[Array]) -> float:
    return max(float(np.abs(y).max()) for y in parts)


def _largest(span: tuple[float, float]) -> float:
    return max(abs(span[0]), abs(span[1]))
