"""Pictures of an identification: Table I, the fits (Fig. 5, 6), the parameters (Fig. 7), loops (Fig. 8)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from focgen.arrays import Array
from focgen.identification.identification import ExperimentFit, Identification, Joint
from focgen.identification.stages import StageFit
from focgen.present import present
from focgen.report.identification_summary import driving_role, gain_unit, model_label
from focgen.report.style import COLOURS, CYCLE, GREY, figure, png, with_unit
from focgen.report.texts import pictured

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RUNS = tuple(colour for colour in CYCLE if colour != COLOURS["ideal"])  # of runs: models are drawn over them
_COMPARED = ("iom_1p", "iom_2p1z", "iom_3p2z")
_LISTED = 16  # experiments in one column of a legend
_JUMP = 0.5  # of an input's reach: it jumps where a single sample changes it by so much
_LETTERS = 60  # in a row below an axis
LAST = 0.5  # of a swinging log: the part drawn as loops, when the start has died away


def identification_pictures(found: Identification) -> dict[str, bytes]:
    """Return PNG pictures by file name: ``loops.png`` only where a log swings, ``parameters.png`` where two
    are steps, and those of a stage where it was identified."""
    pictures = {f"{name}.png": _stage(found, fit) for name, fit in found.stages.items()}
    if found.joint is None or not found.experiments:
        return pictures
    pictures |= {"gof.png": _gof(found), "fits.png": _fits(found), "models.png": _models(found)}
    if sum(fit.step for fit in found.experiments) > 1:
        pictures["parameters.png"] = _parameters(found)
    if swinging := swings(found):
        pictures["loops.png"] = _loops(found, swinging)
    return pictures


def _stage(found: Identification, fit: StageFit) -> bytes:
    """What leaves a stage, measured and as identified, run by run."""
    with figure(1, 1, size=(7.0, 3.4)) as (fig, axes):
        for i, (time, measured, simulated) in enumerate(fit.traces):
            axes.plot(time, measured, color=_RUNS[i % len(_RUNS)], lw=0.8, label=fit.names[i])
            axes.plot(time, simulated, color=COLOURS["ideal"], lw=1.0)
        axes.set_xlabel("time (s)")
        axes.set_ylabel(named(found, {"regulator": "pressure", "sensor": "output"}[fit.stage]))
        axes.set_title(f"The {fit.stage}: measured (colour) and identified, {fit.shape} (black)")
        _legend_beside(axes, [measured[-1] for _, measured, _ in fit.traces])
        return png(fig)


def _gof(found: Identification) -> bytes:
    names = [fit.name for fit in found.experiments] + ["mean"]
    models = list(found.gof)
    with figure(1, 1, size=(7.0, 3.2)) as (fig, axes):
        width = 0.8 / len(models)
        for i, model in enumerate(models):
            places = np.arange(len(names)) + (i - 0.5 * (len(models) - 1)) * width
            axes.bar(
                places,
                [max(found.gof[model][n], 0.0) for n in names],
                width,
                label=model_label(model),
                color=GREY if model == "rig" else CYCLE[i % len(CYCLE)],
            )
        crowded = sum(map(len, names)) > _LETTERS
        axes.set_xticks(range(len(names)), list(map(pictured, names)), rotation=90 if crowded else 0)
        axes.set_ylabel("goodness of fit")
        axes.set_ylim(0.0, 1.0)
        axes.set_title("Fractional and integer-order models (Table I)")
        axes.legend(ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.34 if crowded else -0.1))
        return png(fig)


def _fits(found: Identification) -> bytes:
    with figure(1, 1, size=(7.0, 3.6)) as (fig, axes):
        for i, fit in enumerate(found.experiments):
            axes.plot(fit.time, fit.measured, color=_RUNS[i % len(_RUNS)], lw=0.8, label=pictured(fit.name))
            axes.plot(fit.time, fit.simulated, color=COLOURS["ideal"], lw=0.9, ls=":")
            axes.plot(fit.time, present(found.joint).simulated[fit.name], color=COLOURS["ideal"], lw=1.0)
        axes.set_xlabel("time (s)")
        axes.set_ylabel(named(found, found.experiments[0].fitted))
        axes.set_title("Measured (colour), the rig (black), each experiment's own model (dotted)")
        _legend_beside(axes, [fit.measured[-1] for fit in found.experiments])
        return png(fig)


def _legend_beside(axes: Axes, ends: Any) -> None:
    """The experiments to the right of the curves, in the order in which these end."""
    handles, labels = axes.get_legend_handles_labels()
    order = np.argsort(ends)[::-1]
    axes.legend(
        [handles[i] for i in order],
        [labels[i] for i in order],
        title="experiment",
        ncols=1 + len(order) // _LISTED,
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
    )


def named(found: Identification, role: str, ahead: str = "") -> str:
    """A signal's name, with ``ahead`` before it, and the unit that its column tells."""
    return with_unit(ahead + role, found.rig.signals.unit_of(role))


def _models(found: Identification) -> bytes:
    """The experiment in the middle, with the models of Fig. 6 and what they leave."""
    fit = sorted(found.experiments, key=lambda f: f.level)[len(found.experiments) // 2]
    with figure(2, 1, size=(7.0, 5.0), sharex=True, height_ratios=(2, 1)) as (fig, (top, bottom)):
        top.plot(fit.time, fit.measured, color=GREY, lw=0.8, label="measured")
        for label, simulated, colour in candidates(fit):
            top.plot(fit.time, simulated, color=colour, label=label)
            bottom.plot(fit.time, fit.measured - simulated, color=colour, lw=0.8)
        top.set_ylabel(named(found, fit.fitted))
        top.set_title(f"Experiment {pictured(fit.name)}: models of different kind")
        bottom.set_ylabel("residual")
        bottom.set_xlabel("time (s)")
        top.legend(ncols=2)
        return png(fig)


def candidates(fit: ExperimentFit) -> Any:
    """Yield label, simulated output (n,) and colour of every model of an experiment."""
    yield "FOM", fit.simulated, COLOURS["ideal"]
    for i, model in enumerate(f for f in fit.integer if f"iom_{f.name}" in _COMPARED):
        yield model_label(f"iom_{model.name}"), model.simulated, CYCLE[i]


def _parameters(found: Identification) -> bytes:
    """Fig. 7 with intervals."""
    steps = [fit for fit in found.experiments if fit.step]
    labels = (with_unit("K", gain_unit(found)), r"T ($\mathrm{s}^\alpha$)", "α")
    with figure(3, 1, size=(7.0, 6.6), sharex=True) as (fig, axes):
        for ax, key in zip(axes, ("K", "T", "alpha")):
            _draw_each(ax, steps, key)
        _draw_joint(axes, present(found.joint), [fit.level for fit in steps])
        for ax, label in zip(axes, labels):
            low, high = ax.get_ylim()
            ax.set_ylim(low, high + 0.3 * (high - low))  # room for the legend
            ax.set_ylabel(label)
            ax.legend(loc="upper left", ncols=2)
        axes[-1].set_xlabel(named(found, driving_role(found), "level of the "))
        axes[0].set_title("Parameters of the fractional model over the level")
        return png(fig)


def _draw_each(axes: Any, steps: Sequence[ExperimentFit], key: str) -> None:
    """A parameter of each experiment with its interval."""
    values = np.array([getattr(fit, key) for fit in steps])
    half = np.array([(fit.ci95[key][1] - fit.ci95[key][0]) / 2.0 for fit in steps])
    levels, label = [fit.level for fit in steps], "each experiment, 95 % interval"
    axes.errorbar(levels, values, half, fmt="o", color=COLOURS["model"], capsize=3, label=label)


def _draw_joint(axes: Any, joint: Joint, levels: Sequence[float]) -> None:
    """K(p), and T and α of all experiments together."""
    reach = np.linspace(min(levels), max(levels), 50)
    line = np.polynomial.polynomial.polyval(reach, joint.gain)
    r2 = "" if joint.gain_r2 is None else f", R² = {joint.gain_r2:.4f}"
    label = f"K(p), all together{r2}" if len(joint.gain) > 1 else "K, all together"
    axes[0].plot(reach, line, color=COLOURS["ideal"], label=label)
    for ax, key in zip(axes[1:], ("T", "alpha")):
        value = getattr(joint, key)
        ax.axhspan(*joint.ci95[key], color=COLOURS["band"])
        ax.axhline(value, color=COLOURS["ideal"], label=f"all together: {value:.4g}, 95 % interval", zorder=1)


def swings(found: Identification) -> list[tuple[str, Array, Array, Array]]:
    """Name, input, measured and simulated output of what swings; an input that jumps draws no loops."""
    swings = [(u.name, u.pressure, u.measured, u.simulated) for u in found.unseen if u.swings]
    swings += [
        (f.name, f.pressure, f.measured, present(found.joint).simulated[f.name])
        for f in found.experiments
        if not f.step
    ]
    return [each for each in swings if np.abs(np.diff(each[1])).max() < _JUMP * np.ptp(each[1])]


def _loops(found: Identification, swings: list[tuple[str, Array, Array, Array]]) -> bytes:
    """Fig. 8: output over input, logged and as the identified rig has it."""
    columns = min(4, len(swings))
    rows = -(-len(swings) // columns)
    with figure(
        rows, columns, size=(2.4 * columns + 1.0, 2.6 * rows + 0.5), sharex=True, sharey=True, squeeze=False
    ) as (fig, axes):
        for ax, (name, pressure, measured, simulated) in zip(axes.flat, swings):
            late = slice(int(len(pressure) * (1.0 - LAST)), None)
            ax.plot(pressure[late], measured[late], color=GREY, lw=0.7, label="log")
            ax.plot(pressure[late], simulated[late], color=COLOURS["model"], lw=0.9, label="identified rig")
            ax.set_title(pictured(name))
        for ax in axes[-1]:
            ax.set_xlabel(named(found, driving_role(found)))
        axes[0, 0].set_ylabel(named(found, found.experiments[0].fitted))
        axes[0, 0].legend(loc="upper left")
        return png(fig)
