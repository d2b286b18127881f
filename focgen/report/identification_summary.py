"""An identification as a JSON payload and as text: Table I, the parameters, what the logs cannot show."""

from __future__ import annotations

import math

from focgen.identification.model import ExperimentFit, Identification
from focgen.report.page import TableOf, text_table

_DECIMALS = 7  # more are written with an exponent


def identification_payload(found: Identification) -> dict:
    """What ``focgen identify --json`` carries."""
    pooled = found.pooled
    return {
        "name": found.rig.name,
        "experiments": [_experiment(fit) for fit in found.experiments],
        "rig": {
            "T": pooled.T,
            "alpha": pooled.alpha,
            "gain": list(pooled.gain),
            "gain_r2": pooled.gain_r2,
            "ci95": pooled.ci95,
        },
        "gof": found.gof,
        "bic": found.bic,
        "unseen": {log.name: log.gof for log in found.unseen},
        "warnings": list(found.warnings),
        "notes": list(found.notes),
    }


def _experiment(fit: ExperimentFit) -> dict:
    keys = ("name", "K", "T", "alpha", "ci95", "level", "offset", "gof", "fitted", "driven_by", "step")
    return {key: getattr(fit, key) for key in keys} | {
        "integer": {f.name: {"num": f.num, "den": f.den, "offset": f.offset} for f in fit.integer}
    }


def model_label(model: str) -> str:
    """``iom_2p1z`` as Table I writes it."""
    return {"fom": "FOM", "rig": "rig (pooled)"}.get(model, f"IOM ({model.removeprefix('iom_')})")


def quality_table(found: Identification) -> TableOf:
    """Table I: the GOF of every model in every experiment, and Schwarz's criterion below the FOM's."""
    names = [fit.name for fit in found.experiments]
    heads = ("experiment", *map(model_label, found.gof))
    rows = [(name, *(f"{values[name]:.4f}" for values in found.gof.values())) for name in [*names, "mean"]]
    fom = found.bic["fom"]["mean"]
    criterion = [
        "BIC − FOM's",
        *(f"{found.bic[m]['mean'] - fom:+.1f}" if m in found.bic else "–" for m in found.gof),
    ]
    return TableOf(
        heads, (*rows, tuple(criterion)), "Goodness of fit, eq. (4); BIC with the effective sample size"
    )


def parameter_table(found: Identification) -> TableOf:
    """K, T and alpha of each experiment, with 95 % intervals, and the pooled ones."""
    rows = [
        (
            fit.name,
            f"{fit.level:.4g}",
            _pm(fit.K, fit.ci95["K"]),
            _pm(fit.T, fit.ci95["T"]),
            _pm(fit.alpha, fit.ci95["alpha"]),
        )
        for fit in found.experiments
    ]
    pooled = found.pooled
    rows.append(("pooled", "", "", _pm(pooled.T, pooled.ci95["T"]), _pm(pooled.alpha, pooled.ci95["alpha"])))
    return TableOf(
        ("experiment", "level", "K", "T (s^alpha)", "alpha"), tuple(rows), "K / (T s^alpha + 1), ± 95 %"
    )


def _pm(value: float, span: tuple[float, float]) -> str:
    """A value to the digits that its interval leaves it, and half the interval to two digits."""
    half = (span[1] - span[0]) / 2.0
    digits = 1 - math.floor(math.log10(half)) if 0.0 < half < math.inf else -1
    if not 0 <= digits <= _DECIMALS:
        return f"{value:.4g} ± {half:.2g}"
    return f"{value:.{digits}f} ± {half:.{digits}f}"


def gain_text(found: Identification) -> str:
    """K(p) with its intervals, and R² where it is more than a constant."""
    powers = ("", " p", *(f" p^{i}" for i in range(2, len(found.pooled.gain))))
    terms = " + ".join(
        f"({_pm(g, span)}){power}"
        for g, span, power in zip(found.pooled.gain, found.pooled.ci95["gain"], powers)
    )
    r2 = f",  R² = {found.pooled.gain_r2:.4f}" if len(found.pooled.gain) > 1 else ""
    return f"K(p) = {terms}{r2}"


def identification_text(found: Identification) -> str:
    """The identification for people."""
    parts = [text_table(quality_table(found)), text_table(parameter_table(found)), gain_text(found)]
    if found.unseen:
        parts.append(
            "not fitted, only shown: " + ", ".join(f"{u.name} GOF {u.gof:.3f}" for u in found.unseen)
        )
    parts.append("\n".join([f"warning: {w}" for w in found.warnings] + [f"note: {n}" for n in found.notes]))
    return "\n\n".join(part for part in parts if part)
