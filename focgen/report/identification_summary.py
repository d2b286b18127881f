"""An identification as a JSON payload and as text: Table I, the parameters, what the logs cannot show."""

from __future__ import annotations

import math
from typing import Any

from focgen.fractional.terms import terms_of
from focgen.identification.identification import ExperimentFit, Identification, Joint
from focgen.identification.stages import StageFit
from focgen.present import present
from focgen.report.page import TableOf, text_table
from focgen.report.style import with_unit
from focgen.rig.rig import UNITY

_DECIMALS = 7  # more are written with an exponent


def identification_payload(found: Identification) -> dict[str, Any]:
    """What ``focgen identify --json`` carries."""
    return {
        "name": found.rig.name,
        "experiments": [_experiment(fit) for fit in found.experiments],
        "rig": _joint(found.joint),
        "stages": {name: _stage(fit) for name, fit in found.stages.items()},
        "gof": found.gof,
        "bic": found.bic,
        "unseen": {log.name: log.gof for log in found.unseen},
        "warnings": list(found.warnings),
        "notes": list(found.notes),
    }


def _joint(joint: Joint | None) -> dict[str, Any] | None:
    if joint is None:
        return None
    keys = ("T", "alpha", "delay", "gain_r2", "ci95", "closed_loop", "play")
    begun = {name: past.steps for name, past in joint.pasts.items()}
    return {key: getattr(joint, key) for key in keys} | {"gain": list(joint.gain), "initial_steps": begun}


def _stage(fit: StageFit) -> dict[str, Any]:
    up_down = None
    if fit.up_down is not None:
        up_down = {key: getattr(fit.up_down, key) for key in ("rising", "falling", "one_line_will_do", "gof")}
    return {
        "shape": fit.shape,
        "num": terms_of(fit.transfer.num),
        "den": terms_of(fit.transfer.den),
        "delay": fit.delay,
        "gof": fit.gof,
        "parameters": {
            name: {"value": v, "ci95": (max(v - h, 0.0) if name == "delay" else v - h, v + h)}
            for name, (v, h) in fit.parameters.items()
        },
        "up_down": up_down,
        "shapes": {one.shape: {"bic": one.bic, "gof": one.gof, "refused": one.refused} for one in fit.fits},
    }


def _experiment(fit: ExperimentFit) -> dict[str, Any]:
    keys = (
        "name",
        "K",
        "T",
        "alpha",
        "ci95",
        "level",
        "offset",
        "gof",
        "fitted",
        "driven_by",
        "step",
        "past",
    )
    return {key: getattr(fit, key) for key in keys} | {
        "integer": {f.name: {"num": f.num, "den": f.den, "offset": f.offset} for f in fit.integer}
    }


def model_label(model: str) -> str:
    """``iom_2p1z`` as Table I writes it."""
    return {"fom": "FOM", "rig": "the rig"}.get(model, f"IOM ({model.removeprefix('iom_')})")


def stage_text(fit: StageFit) -> str:
    """A stage in one line: what it is, and how well it fits."""
    parts = ", ".join(f"{name} = {_pm(v, (v - h, v + h))}" for name, (v, h) in fit.parameters.items())
    return f"{fit.stage}: {fit.shape}, {parts}; GOF {fit.gof:.3f}"


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
    """K, T and alpha of each experiment, with 95 % intervals, and of all together."""
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
    joint = present(found.joint)
    rows.append(
        ("all together", "", "", _pm(joint.T, joint.ci95["T"]), _pm(joint.alpha, joint.ci95["alpha"]))
    )
    level, gain = with_unit("level", _driving_unit(found)), with_unit("K", gain_unit(found))
    return TableOf(
        ("experiment", level, gain, "T (s^alpha)", "alpha"), tuple(rows), "K / (T s^alpha + 1), ± 95 %"
    )


def driving_role(found: Identification) -> str:
    """What drives the actuator: the command only where no regulator makes a pressure of it."""
    role = found.experiments[0].driven_by
    return "pressure" if found.rig.regulator != UNITY else role


def _driving_unit(found: Identification) -> str:
    return found.rig.signals.unit_of(driving_role(found))


def gain_unit(found: Identification) -> str:
    """The unit of K, as far as the columns tell it."""
    above, below = found.rig.signals.unit_of(found.experiments[0].fitted), _driving_unit(found)
    if not above or not below:
        return ""
    return f"1/({above[2:]} {below})" if above.startswith("1/") else f"{above}/{below}"


def _pm(value: float, span: Any) -> str:
    """A value to the digits that its interval leaves it, and half the interval to two digits."""
    half = (span[1] - span[0]) / 2.0
    digits = 1 - math.floor(math.log10(half)) if 0.0 < half < math.inf else -1
    if not 0 <= digits <= _DECIMALS:
        return f"{value:.4g} ± {half:.2g}"
    return f"{value:.{digits}f} ± {half:.{digits}f}"


def gain_text(found: Identification) -> str:
    """K(p) with its intervals, R² where it is more than a constant, and the dead time where there is one."""
    joint = present(found.joint)
    powers = ("", " p", *(f" p^{i}" for i in range(2, len(joint.gain))))
    each = [_pm(g, span) for g, span in zip(joint.gain, joint.ci95["gain"])]
    terms = " + ".join(f"({text}){power}" for text, power in zip(each, powers)) if len(each) > 1 else each[0]
    steps = sum(fit.step for fit in found.experiments)
    known = joint.gain_r2 is not None and 1 < len(each) < steps
    r2 = f",  R² of the single fits = {joint.gain_r2:.4f}" if known else ""
    span = joint.ci95.get("delay")
    high: Any = span[1] if span else 0.0  # the lower end may have been cut at 0
    late = f"\ndead time = {_pm(joint.delay, (2.0 * joint.delay - high, high))} s" if span else ""
    return f"K(p) = {terms}{r2}{late}"


def identification_text(found: Identification) -> str:
    """The identification for people."""
    parts = [stage_text(fit) for fit in found.stages.values()]
    if found.experiments:
        parts += [text_table(quality_table(found)), text_table(parameter_table(found))]
    if found.joint:
        parts.append(gain_text(found))
    if found.unseen:
        parts.append(
            "not fitted, only shown: " + ", ".join(f"{u.name} GOF {u.gof:.3f}" for u in found.unseen)
        )
    parts.append("\n".join([f"warning: {w}" for w in found.warnings] + [f"note: {n}" for n in found.notes]))
    return "\n\n".join(part for part in parts if part)
