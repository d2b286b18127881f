"""Results read back from the files that commands wrote."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

from focgen.diagnosis.model import (
    VERDICT,
    Candidate,
    Diagnosis,
    Estimate,
    Found,
    Gap,
    NextExperiment,
    PlainFit,
    Where,
)
from focgen.errors import InputError
from focgen.jsontext import fits, read_json
from focgen.present import present

_SPAN = [(float, None)]
_ESTIMATE = {"value": (float, None), "ci95": _SPAN, "unit": str}
_CANDIDATE = {  # and its stage, which earlier versions did not write
    "effect": str,
    "confidence": float,
    "form": str,
    "parameters": dict,
    "sizes?": dict,
    "separation": (float, None),
}
_FOUND = {"stage": str, "candidates": [_CANDIDATE], "shrink": (float, None), "shrink_interval": _SPAN}
_GAP = dict.fromkeys(("as_given", "refitted", "explained", "floor"), float) | {
    "unit": str,
    "gof": {"as given": float, "refitted": float, "explained": float, "possible": float},
}
_DIAGNOSIS: dict[str, Any] = {
    "verdict": VERDICT,
    "where": {"stage": (str, None), "inferred": bool, "share": dict, "regimes": dict},
    "causes": [_FOUND],
    "gap": _GAP,
    "shrink": (float, None),
    "shrink_interval": (_SPAN, None),
    "refitted_rig": str,
    "augmented_rig": str,
    "next_experiment": ({"why": str, "what": str, "expected_separation": (float, None)}, None),
    "unexplained": dict,
    "notes": [str],
    "fits": [{"effect": str, "error": (float, None)}],
    "warnings": [str],
}


def read_diagnosis(path: Path) -> Diagnosis:
    """``diagnosis.json`` read back. Raises InputError where it is none."""
    remedy = "name a folder that `focgen diagnose` has written"
    value = read_json(path, remedy)
    if not fits(value, _DIAGNOSIS) or not _sound(value):
        raise InputError(str(path), "is no diagnosis", remedy)
    ahead = value["next_experiment"]
    return Diagnosis(
        **{key: value[key] for key in ("verdict", "shrink", "refitted_rig", "augmented_rig", "unexplained")},
        where=Where(**{key: value["where"][key] for key in _DIAGNOSIS["where"]}),
        causes=tuple(map(_found, value["causes"])),
        gap=Gap(**{key: value["gap"][key] for key in _GAP}),
        shrink_interval=_pair(value["shrink_interval"]),
        next_experiment=ahead
        and NextExperiment(ahead["why"], ahead["what"], _real(ahead["expected_separation"])),
        notes=tuple(value["notes"]),
        fits=tuple(PlainFit(one["effect"], _real(one["error"])) for one in value["fits"]),
        warnings=tuple(value["warnings"]),
    )


def _sound(value: dict[str, Any]) -> bool:
    """What a shape cannot say: intervals have two ends, shares are numbers, parameters estimates."""
    spans = [value["shrink_interval"]] + [cause["shrink_interval"] for cause in value["causes"]]
    candidates = [candidate for cause in value["causes"] for candidate in cause["candidates"]]
    estimates = [estimate for one in candidates for estimate in _told(one)]
    return (
        all(span is None or len(span) == 2 for span in spans)
        and all(0.0 <= candidate["confidence"] <= 1.0 for candidate in candidates)
        and all(isinstance(candidate.get("stage", ""), str) for candidate in candidates)
        and all(cause["candidates"] for cause in value["causes"])
        and all(fits(share, (float, None)) for share in value["where"]["share"].values())
        and all(fits(estimate, _ESTIMATE) and len(estimate["ci95"]) == 2 for estimate in estimates)
        and all(isinstance(what, dict) for what in value["unexplained"].values())
        and (value["shrink"] is None) == (value["shrink_interval"] is None)
    )


def _told(candidate: dict[str, Any]) -> Iterator[Any]:
    """The sizes and parameters of a candidate; sizes earlier versions did not write."""
    return chain(candidate.get("sizes", {}).values(), candidate["parameters"].values())


def _found(value: dict[str, Any]) -> Found:
    candidates = tuple(_candidate({"stage": value["stage"]} | one) for one in value["candidates"])
    return Found(value["stage"], candidates, _real(value["shrink"]), present(_pair(value["shrink_interval"])))


def _candidate(value: dict[str, Any]) -> Candidate:
    parameters, sizes = (_estimates(value.get(key, {})) for key in ("parameters", "sizes"))
    effect, stage, confidence, form = (value[k] for k in ("effect", "stage", "confidence", "form"))
    return Candidate(effect, stage, confidence, form, parameters, _real(value["separation"]), sizes)


def _estimates(value: dict[str, Any]) -> dict[str, Estimate]:
    return {
        name: Estimate(_real(e["value"]), present(_pair(e["ci95"])), e["unit"]) for name, e in value.items()
    }


def _real(value: float | None) -> float:
    """A number; NaN where JSON had to say null."""
    return float("nan") if value is None else float(value)


def _pair(value: list[Any] | None) -> tuple[float, float] | None:
    return None if value is None else (_real(value[0]), _real(value[1]))
