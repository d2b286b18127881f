"""Which kinds of cases a trial has, and in what shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.errors import InputError
from focgen.trials import plants
from focgen.trials.closed import CONTROLLER_EFFECTS
from focgen.trials.engine.forms import BODY, HANDS
from focgen.trials.forms_outside import OUTSIDE
from focgen.trials.vocabulary import VOCABULARY

KINDS = ("single", "pair", "none", "parameters", "outside", "unidentifiable", "linear")
CLOSED_KINDS = ("single", "none", "parameters", "outside")
_SHARES = {
    "single": 0.58,
    "pair": 0.11,
    "none": 0.05,
    "parameters": 0.07,
    "outside": 0.09,
    "unidentifiable": 0.06,
    "linear": 0.04,
}

# What two effects do alike: together they are one to any log.
_ALIKE = (
    {"transport_delay", "slow_regulator"},
    {"valve_asymmetry", "flow_limit"},
    {"valve_asymmetry", "slow_regulator"},
    {"supply_saturation", "leak"},
    {"flow_limit", "slow_regulator"},
    {"gain_nonlinearity", "dead_zone"},
    {"gain_nonlinearity", "contact"},
    {"softening", "gain_drift"},
    {"contact", "dead_zone"},
    {"softening", "hysteresis"},
    {"hysteresis", "unloading_asymmetry"},
    {"sensor_nonlinearity", "sensor_saturation"},
    {"sensor_relaxation", "sensor_lag"},
    {"contact", "sensor_saturation"},
    {"contact", "sensor_nonlinearity"},
    {"hysteresis", "sensor_hysteresis"},
    {"gain_nonlinearity", "sensor_nonlinearity"},
    {"creep", "sensor_lag"},
    {"creep", "sensor_relaxation"},
    {"creep", "sensor_drift"},
    {"gain_drift", "sensor_drift"},
)

# Without the pressure these are alike, too.
_ALIKE_BLIND = (
    {"valve_stiction", "hysteresis"},
    {"valve_stiction", "sensor_hysteresis"},
    {"valve_asymmetry", "unloading_asymmetry"},
    {"supply_saturation", "contact"},
    {"supply_saturation", "sensor_saturation"},
    {"supply_saturation", "gain_nonlinearity"},
    {"supply_saturation", "sensor_nonlinearity"},
    {"leak", "gain_nonlinearity"},
    {"leak", "dead_zone"},
    {"leak", "sensor_nonlinearity"},
    {"transport_delay", "sensor_lag"},
    {"slow_regulator", "sensor_lag"},
    {"flow_limit", "unloading_asymmetry"},
)

# With a command and a response alone, these have a meaning of their own.
_LINEAR = (
    "transport_delay",
    "valve_asymmetry",
    "flow_limit",
    "valve_stiction",
    "hysteresis",
    "gain_nonlinearity",
    "dead_zone",
    "sensor_quantization",
    "sensor_saturation",
    "resonance",
)


@dataclass(frozen=True)
class Assignment:
    """What a case is to be."""

    kind: str
    effects: tuple[str, ...] = ()
    severity: str = "mid"

    @property
    def linear(self) -> bool:
        """Whether the rig is one stage in foreign units."""
        return self.kind == "linear"

    @property
    def must_show(self) -> bool:
        """Whether the case has no meaning where its effects stay below the noise."""
        return self.kind in ("pair", "outside", "unidentifiable")


def assignments(
    count: int, kinds: tuple[str, ...], signals: str, suite: str, rng: np.random.Generator
) -> list[Assignment]:
    """``count`` cases of the given kinds, in the usual shares, shuffled; effects equally often. Raises
    InputError for a kind that the suite does not have.
    """
    allowed = CLOSED_KINDS if suite in ("closed", "engine", "plants", "loops") else KINDS
    unknown = sorted(set(kinds) - set(allowed))
    if unknown:
        raise InputError(
            "--kinds", f"has the unknown kind {unknown[0]!r}", f"choose from {', '.join(allowed)}"
        )
    shares = {kind: _SHARES[kind] for kind in kinds}
    whole = sum(shares.values())
    quota = {kind: max(1, round(count * share / whole)) for kind, share in shares.items()}
    quota[max(quota, key=lambda kind: quota[kind])] += count - sum(quota.values())
    found = [a for kind, n in quota.items() for a in _of_kind(kind, max(n, 0), signals, suite, rng)]
    rng.shuffle(found)
    return found[:count]


def _of_kind(kind: str, count: int, signals: str, suite: str, rng: np.random.Generator) -> list[Assignment]:
    if kind == "single":
        effects = _vocabulary(suite)
        return _dealt(effects, ("low", "mid", "high"), kind, count, rng)
    if kind == "linear":
        return _dealt(_LINEAR, ("mid", "high"), kind, count, rng)
    if kind == "outside":
        return _dealt(_outside(signals, suite), ("mid", "high"), kind, count, rng)
    if kind == "pair":
        return [Assignment(kind, _pair(signals, rng), str(rng.choice(("mid", "high")))) for _ in range(count)]
    return [Assignment(kind, (), "high") for _ in range(count)]


def _dealt(
    effects: Sequence[str], severities: Sequence[str], kind: str, count: int, rng: np.random.Generator
) -> list[Assignment]:
    """Deal effects like cards, no one twice more often than another, each time with its next severity."""
    first = rng.integers(len(severities), size=len(effects))
    cards: list[Assignment] = []
    for deal in range(-(-count // len(effects))):
        for i in rng.permutation(len(effects)):
            severity = severities[(first[i] + deal) % len(severities)]
            cards.append(Assignment(kind, (effects[i],), severity))
    return cards[:count]


def _vocabulary(suite: str) -> tuple[str, ...]:
    """The effects that singles of a suite have."""
    if suite == "engine":
        around = (effect for effect, (stage, _) in VOCABULARY.items() if stage != "actuator")
        return (*around, *BODY)
    if suite == "plants":
        return plants.SINGLES
    return tuple(VOCABULARY) + (3 * CONTROLLER_EFFECTS if suite == "closed" else ())


def _outside(signals: str, suite: str) -> tuple[str, ...]:
    """A baseline's swing is a sensor drift to logs without curvature, a folded curve an odd calibration."""
    if suite == "engine":
        return (*HANDS, "supply_ripple", "loose_plug")
    if suite == "plants":
        return plants.OUTSIDE
    return tuple(name for name in OUTSIDE if signals == "C" or name != "room_swing")


def _pair(signals: str, rng: np.random.Generator) -> tuple[str, ...]:
    """Two effects, in half of the cases of one stage, that are not alike."""
    names = list(VOCABULARY)
    alike = _ALIKE + (_ALIKE_BLIND if signals == "A" else ())
    same = rng.random() < 0.4
    while True:
        pair = tuple(rng.choice(names, 2, replace=False))
        stages = [VOCABULARY[e][0] for e in pair]
        if (stages[0] == stages[1]) == same and set(pair) not in alike:
            return tuple(str(e) for e in pair)
