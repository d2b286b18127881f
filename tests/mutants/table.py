"""What was tried, counted: by room, with intervals, and every survivor with what is known of it."""

from __future__ import annotations

import math
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from scipy.stats import beta

JUDGED = Path(__file__).with_name("judged.toml")
"""Survivors that were looked at: ``equivalent`` or ``open``, and why, by the change's key."""
_LEVEL = 0.90


@dataclass(frozen=True)
class Count:
    """Changes of a room: tried, killed, and survivors that nothing can kill; ``weight``: its share of all."""

    tried: int
    killed: int
    equivalent: int
    weight: float

    @property
    def live(self) -> int:
        """Those that could be killed."""
        return self.tried - self.equivalent


def interval(killed: int, tried: int) -> tuple[float, float]:
    """Clopper's and Pearson's, of 90 %."""
    side = 0.5 * (1.0 - _LEVEL)
    low = beta.ppf(side, killed, tried - killed + 1) if killed else 0.0
    high = beta.ppf(1.0 - side, killed + 1, tried - killed) if killed < tried else 1.0
    return float(low), float(high)


def weighted(counts: list[Count]) -> tuple[float, float, float]:
    """The share over all rooms, each by its weight, and the ends of its interval (two more of each kind are
    added, so that a room without a survivor is not taken for certain)."""
    total = sum(c.weight for c in counts)
    share = sum(c.weight * c.killed / c.live for c in counts) / total
    sure = [((c.killed + 2.0) / (c.live + 4.0), c) for c in counts]
    spread = math.sqrt(sum((c.weight / total) ** 2 * p * (1.0 - p) / (c.live + 4.0) for p, c in sure))
    middle = sum(c.weight * p for p, c in sure) / total
    return share, max(middle - 1.645 * spread, 0.0), min(middle + 1.645 * spread, 1.0)


def judged() -> dict[str, dict]:
    """What was found out of survivors, by key."""
    return tomllib.loads(JUDGED.read_text(encoding="utf-8")) if JUDGED.exists() else {}


def counted(results: list[dict], weights: dict[str, int]) -> dict[str, Count]:
    """By room; stillborn ones and those that no test was run for do not count."""
    known, found = judged(), {}
    for room, weight in weights.items():
        own = [r for r in results if r["room"] == room and r["outcome"] not in ("stillborn", "not run")]
        outcomes = Counter(r["outcome"] for r in own)
        left = [r for r in own if r["outcome"] in ("survived", "no test")]
        equal = sum(known.get(r["key"], {}).get("verdict") == "equivalent" for r in left)
        found[room] = Count(len(own), outcomes["killed"] + outcomes["timed out"], equal, float(weight))
    return {room: count for room, count in found.items() if count.live}


def table(results: list[dict], weights: dict[str, int]) -> str:
    """Markdown."""
    counts = counted(results, weights)
    lines = [
        "| room | places | tried | equivalent | killed | share | 90 % interval |",
        "|---|---|---|---|---|---|---|",
    ]
    for room, c in counts.items():
        low, high = interval(c.killed, c.live)
        lines.append(_row(room, weights[room], c, c.killed / c.live, low, high))
    whole = Count(
        *(sum(getattr(c, k) for c in counts.values()) for k in ("tried", "killed", "equivalent", "weight"))
    )
    if counts:
        every = weighted(list(counts.values()))
        lines.append(_row("all, rooms by their places", int(whole.weight), whole, *every))
    return "\n".join([*lines, "", *survivors(results)])


def _row(name: str, places: int, c: Count, share: float, low: float, high: float) -> str:
    numbers = f"{places} | {c.tried} | {c.equivalent} | {c.killed} | {100 * share:.1f} %"
    return f"| {name} | {numbers} | {100 * low:.0f} to {100 * high:.0f} % |"


def survivors(results: list[dict]) -> list[str]:
    """A line each."""
    known, lines = judged(), []
    for r in results:
        if r["outcome"] in ("survived", "no test"):
            told = known.get(r["key"], {"verdict": "not looked at", "why": ""})
            change = f"{r['kind']}: `{r['old']}` → `{r['new']}`"
            lines.append(
                f"- {r['key']} {r['file']}:{r['line']} {change} ({r['outcome']}): "
                f"{told['verdict']}. {told['why']}"
            )
    return lines
