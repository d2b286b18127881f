"""One case's diagnosis held against its label."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

# What a name of the generator may rightly be called by the vocabulary instead of `unknown`.
ALSO = {"folded_reading": {"sensor_nonlinearity"}}
# What an effect may rightly be called as well: friction against a spring that returns is a play to the logs.
LIKE = {"friction": "hysteresis"}
PROPOSED = "proposed"  # the name of the experiment that a diagnosis proposes, beside those of the menu
_CAUSED = ("named", "set")

Candidates = tuple[tuple[str, float], ...]
"""Effect and confidence of each, most likely first."""


@dataclass(frozen=True)
class Judged:
    """A case as it was (``kind``, ``effects``, ``stages``, ``visible``) and what the diagnosis said of it.

    ``causes``: for each entry its candidates (effect, confidence), most likely first. ``verdict`` is "failed"
    where there is no diagnosis. ``promise`` and ``promise_interval``: the shrink that was predicted;
    ``achieved`` and ``oracle``: what replay on the unseen logs gives, None where it cannot be measured.
    ``resolved``: of the proposed experiment and those of the menu, by name, whether the true rig's log of it
    made the diagnosis name the truth and nothing else. ``forgone``: the part of the gap in the given logs
    that the oracle closes beyond what was closed.
    """

    number: str
    kind: str
    effects: tuple[str, ...]
    stages: tuple[str, ...]
    visible: bool
    severity: str
    form: str
    verdict: str
    stage: str | None
    causes: tuple[Candidates, ...]
    proposal: str
    tied: tuple[str, ...] = ()
    resolves: tuple[str, ...] = ()
    promise: float | None = None
    promise_interval: tuple[float, float] | None = None
    achieved: float | None = None
    oracle: float | None = None
    forgone: float | None = None
    seconds: float | None = None
    baseline: str | None = None
    best_fit: str | None = None
    resolved: Mapping[str, bool] = field(default_factory=dict)

    @property
    def caused(self) -> bool:
        """Whether the verdict says that effects are there."""
        return self.verdict in _CAUSED and bool(self.causes)

    @property
    def top(self) -> str | None:
        """The most likely effect of the strongest cause."""
        return self.causes[0][0][0] if self.caused and self.causes[0] else None

    @property
    def reported(self) -> tuple[str, ...]:
        """Every effect that the diagnosis holds possible."""
        return tuple(effect for cause in self.causes for effect, _ in cause) if self.caused else ()

    @property
    def top_right(self) -> bool:
        """Whether the strongest cause's first candidate is true."""
        return self.top in self.effects

    @property
    def stage_right(self) -> bool:
        """Whether the stage is the strongest true effect's; of a single-stage rig every stage is right."""
        return self.stage is not None and (self.kind == "linear" or self.stage in self.stages)

    @property
    def wrongly_named(self) -> bool:
        """Whether some cause names one effect alone, and that effect is not there."""
        return self.caused and any(len(c) == 1 and c[0][0] not in self.effects for c in self.causes)

    @property
    def in_set(self) -> bool:
        """Whether the truth is among what is held possible."""
        return bool(self.effects) and set(self.effects) <= set(self.reported)

    @property
    def found(self) -> bool:
        """Whether each true effect is among the candidates of a cause of its own."""
        return _matched(self.effects, self.causes if self.caused else ()) == len(self.effects)

    @property
    def extras(self) -> int:
        """Causes beyond those that hold a true effect."""
        causes = self.causes if self.caused else ()
        return len(causes) - _matched(self.effects, causes)

    @property
    def says_unknown(self) -> bool:
        """Whether the effect was recognised as none of the vocabulary's."""
        allowed = set().union(*(ALSO.get(e, set()) for e in self.effects))
        return self.verdict == "unknown" or (bool(allowed) and self.caused and set(self.reported) <= allowed)

    @property
    def says_tied(self) -> bool:
        """Whether truth and a rival are left standing, and the proposal would tell them apart."""
        rivals = set(self.tied) - set(self.effects)
        held = any(
            set(self.effects) <= (names := {e for e, _ in cause}) and names & rivals for cause in self.causes
        )
        return held and any(word in self.proposal.lower() for word in self.resolves)

    def first_confidences(self) -> list[tuple[float, bool]]:
        """(stated probability, whether it is so) of each cause's first candidate."""
        if not self.caused:
            return []
        return [(cause[0][1], cause[0][0] in self.effects) for cause in self.causes if cause]


def _matched(effects: tuple[str, ...], causes: tuple[Candidates, ...]) -> int:
    """How many true effects can be paired with causes of their own (at most two: tried both ways)."""
    names = [{effect for effect, _ in cause} for cause in causes]
    best = 0
    for order in (effects, tuple(reversed(effects))):
        free, hits = list(range(len(names))), 0
        for effect in order:
            at = next((i for i in free if effect in names[i]), None)
            if at is not None:
                free.remove(at)
                hits += 1
        best = max(best, hits)
    return best


def judge(
    number: str,
    label: dict[str, Any],
    outcome: dict[str, Any],
    diagnosis: dict[str, Any] | None,
    **measured: Any,
) -> Judged:
    """Hold a diagnosis (None: failed) against its label; ``measured``: further fields of :class:`Judged`."""
    truth, design = label["truth"], label.get("design") or {}
    said = diagnosis or {"verdict": "failed"}
    interval = said.get("shrink_interval")
    return Judged(
        number=number,
        kind=label["kind"],
        effects=tuple(t["effect"] for t in truth),
        stages=tuple(t["stage"] for t in truth),
        visible=bool(truth) and all(t["visible"] for t in truth),
        severity=truth[0]["severity"] if truth else "",
        form=truth[0]["form"] if truth else "",
        verdict=said["verdict"],
        stage=(said.get("where") or {}).get("stage"),
        causes=tuple(_candidates(cause, truth) for cause in said.get("causes") or ()),
        proposal=_proposal(said.get("next_experiment")),
        tied=tuple(design.get("tied", ())),
        resolves=tuple(design.get("resolves", ())),
        promise=said.get("shrink"),
        promise_interval=tuple(interval) if interval else None,
        seconds=outcome.get("seconds"),
        **measured,
    )


def _candidates(cause: dict[str, Any], truth: list[dict[str, Any]]) -> Candidates:
    """Effect and confidence of each, by the name of the truth where it may be called as it was."""
    named = [(c["effect"], float(c["confidence"])) for c in cause["candidates"]]
    for effect in (t["effect"] for t in truth):
        if effect in LIKE and effect not in dict(named):
            named = [(effect if name == LIKE[effect] else name, sure) for name, sure in named]
    return tuple(named)


def _proposal(proposed: dict[str, Any] | None) -> str:
    return f"{proposed.get('what', '')} {proposed.get('why', '')}" if proposed else ""


def forgone(diagnosis: dict[str, Any] | None, told: dict[str, Any] | None) -> float | None:
    """The part of the refitted gap, as mean square above the floor, that the fit of the true effects closes
    beyond what was closed without being told."""
    if not diagnosis or not told:
        return None
    gap = diagnosis["gap"]
    could = gap["refitted"] ** 2 - gap["floor"] ** 2
    return (gap["explained"] ** 2 - told["gap"]["explained"] ** 2) / could if could > 0 else None
