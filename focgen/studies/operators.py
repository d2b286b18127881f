"""Which operator a loop needs: Grünwald–Letnikov weights, or a fit to (jω)^α itself over its band.

The weights lag s^α by α h/2, whatever the memory. That is nothing to a slow loop and degrees of phase margin
to a fast one; the fit has no lag and, at the same error, about as many states. So the two run in the same
loop, and what the lag costs it decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from focgen.fractional.continuous import RATIOS
from focgen.present import present
from focgen.studies.recommend import SETTLING
from focgen.studies.results import Band, Row, Variant
from focgen.studies.spectrum import PHASE

TOLERANCES = (0.03, 0.01)
_HIGHEST = 0.25 * math.pi  # rad per sample: up to here a fit takes few states
_LAG = 0.035  # relative error that PHASE degrees of lag make


@dataclass(frozen=True)
class Choice:
    """``operator``: "gl" or "continuous"; ``why``, a sentence; ``rows``: the one of each that were compared,
    in this order."""

    operator: str
    why: str
    rows: tuple[Row, ...]


def compared_band(band: Band, sample_time: float) -> Band | None:
    """The band that matters to the loop, as far as a fit is compared with the weights: up to a quarter of the
    Nyquist frequency. None where that is too narrow for one."""
    high = min(band.high, _HIGHEST / sample_time)
    low = max(band.low, high / RATIOS[1])
    return replace(band, low=low, high=high) if high >= RATIOS[0] * low else None


def continuous_variants(band: Band, arithmetic: str, sample_time: float) -> list[Variant]:
    """Fits over a band that :func:`compared_band` gives."""
    given: dict[str, Any] = dict(operator="continuous", band=(band.low, band.high))
    return [Variant("exponential", arithmetic, sample_time, tolerance=e, **given) for e in TOLERANCES]


def _off(row: Row) -> float:
    """How far a row that was compared is from s^α."""
    return present(row.error_s)


def chosen(weights: Row | None, fits: list[Row]) -> Choice | None:
    """Compare an exponential memory of the weights with the leanest fit that is at least as close to s^α, or
    else the closest; None where either is missing."""
    able = sorted((row for row in fits if row.error_s is not None), key=_off)
    if weights is None or weights.error_s is None or not able:
        return None
    closer = [row for row in able if _off(row) <= weights.error_s] or able[:1]
    fit = min(closer, key=lambda row: (row.ram_bytes, _off(row)))
    operator, cost = _decided(weights, fit)
    both = f"{_told('gl', weights)}; {_told('continuous', fit)}"
    return Choice(operator, f"Operator {operator}: {cost} ({both}).", (weights, fit))


def _decided(weights: Row, fit: Row) -> tuple[str, str]:
    """The operator, and what speaks for it."""
    if weights.margin_deg is None or fit.margin_deg is None:
        if _off(weights) <= _LAG:
            return "gl", f"its lag leaves s^α within {100 * _LAG:.2g} % over the band"
        return "continuous", f"the weights' lag takes them more than {100 * _LAG:.2g} % from s^α in the band"
    lost = fit.margin_deg - weights.margin_deg
    if weights.stable and not fit.stable:
        return "gl", "with it the loop is stable, with the fit it is not"
    if not weights.stable and fit.stable:
        return "continuous", "with it the loop is stable, with the weights it is not"
    if lost > PHASE:
        return "continuous", f"the weights' lag costs {lost:.2g}° of phase margin"
    if _slower(weights, fit):
        return "continuous", f"with the weights the loop settles more than {100 * SETTLING:.0f} % later"
    return "gl", f"its lag changes the phase margin by {abs(lost):.2g}°, and settling no later"


def _slower(weights: Row, fit: Row) -> bool:
    if fit.settling_s is None:
        return False
    return weights.settling_s is None or weights.settling_s > (1.0 + SETTLING) * fit.settling_s


def _told(name: str, row: Row) -> str:
    said = [f"{100 * _off(row):.2g} % from s^α at most"]
    if row.margin_deg is not None:
        said.append(f"{row.margin_deg:.1f}°")
    if row.settling_s is not None:
        said.append(f"{row.settling_s:.3g} s")
    return f"{name}: {', '.join([*said, f'{row.multiplies} multiplies', f'{row.ram_bytes} B'])}"
