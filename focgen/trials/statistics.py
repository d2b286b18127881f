"""Intervals and calibration of the scores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.special import betaincinv

from focgen.arrays import Array


def interval(
    values: Sequence[float], figure: Callable[..., Any] = np.mean, draws: int = 2000, seed: int = 0
) -> tuple[float, float]:
    """90 % interval of ``figure`` of the values; NaN where there are none.

    Jeffreys' interval for a share of hits, which has a width even where all hit or none does (L. D. Brown,
    T. T. Cai and A. DasGupta, Statistical Science 16, 2001); the percentile bootstrap for any other figure.
    """
    seen: Array = np.asarray(values, float)
    if len(seen) == 0:
        return float("nan"), float("nan")
    if figure is np.mean and np.all((seen == 0.0) | (seen == 1.0)):
        return _jeffreys(int(seen.sum()), len(seen))
    rng = np.random.default_rng(seed)
    picks = rng.integers(0, len(seen), (draws, len(seen)))
    low, high = np.quantile([figure(seen[p]) for p in picks], (0.05, 0.95))
    return float(low), float(high)


def _jeffreys(hits: int, count: int) -> tuple[float, float]:
    low, high = betaincinv(hits + 0.5, count - hits + 0.5, (0.05, 0.95))
    return 0.0 if hits == 0 else float(low), 1.0 if hits == count else float(high)


def calibration_error(confidence: Array, right: Array, bins: int = 10) -> float:
    """Mean distance of confidence and hit rate over bins of equal count, weighted by their size."""
    order = np.argsort(confidence, kind="stable")
    groups = np.array_split(order, min(bins, len(order)))
    return float(sum(len(g) * abs(confidence[g].mean() - right[g].mean()) for g in groups) / len(order))


def reliability(
    confidence: Sequence[float], right: Sequence[bool], draws: int = 4000, seed: int = 0
) -> dict[str, Any]:
    """Calibration error, what a perfectly calibrated tool would score on as many cases, and the bootstrap
    p-value.

    ``p``: how often outcomes drawn with the stated confidences give an error as large or larger.
    """
    c, r = np.clip(np.asarray(confidence, float), 0.0, 1.0), np.asarray(right, float)
    if len(c) == 0:
        return {"error": float("nan"), "perfect": float("nan"), "p": float("nan"), "cases": 0}
    rng = np.random.default_rng(seed)
    error = calibration_error(c, r)
    drawn = np.array([calibration_error(c, (rng.random(len(c)) < c).astype(float)) for _ in range(draws)])
    p = (1.0 + np.sum(drawn >= error - 1e-12)) / (1.0 + draws)
    return {"error": error, "perfect": float(drawn.mean()), "p": float(p), "cases": len(c)}


def reliability_bins(
    confidence: Sequence[float], right: Sequence[bool], bins: int = 10
) -> list[tuple[float, float, float, float, int]]:
    """(mean confidence, hit rate, 5 % and 95 % quantile under perfect calibration, cases) of bins of equal
    count, in rising confidence."""
    c, r = np.clip(np.asarray(confidence, float), 0.0, 1.0), np.asarray(right, float)
    order, rng = np.argsort(c, kind="stable"), np.random.default_rng(0)
    found = []
    for g in np.array_split(order, max(1, min(bins, len(order)))):
        drawn = (rng.random((4000, len(g))) < c[g]).mean(axis=1)
        low, high = np.quantile(drawn, (0.05, 0.95))
        found.append((float(c[g].mean()), float(r[g].mean()), float(low), float(high), len(g)))
    return found
