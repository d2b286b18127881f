"""How findings are shown: a diagnosis, a rig replayed, a study, the scores of trials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, TypeVar

from focgen.diagnosis.model import Diagnosis
from focgen.errors import MissingExtra
from focgen.report.diagnosis import diagnosis_pictures
from focgen.report.figures import Figure
from focgen.report.page import TableOf
from focgen.report.pages.chain import replay_section
from focgen.report.pages.diagnosis import diagnosis_lead, diagnosis_sections, sizes, units_of
from focgen.report.pages.parts import figures_of, notes, number, warnings
from focgen.report.pages.study import study_page, study_sections
from focgen.report.pages.trials import section, trials_lead
from focgen.report.results.view import Rows, View
from focgen.report.study import study_pictures
from focgen.report.study_summary import rows_table, sample_times
from focgen.rig.replay import Replay
from focgen.studies.results import Study
from focgen.trials.score import Summary

_Found = TypeVar("_Found")


def _if_drawn(pictures: Callable[[_Found], dict[str, bytes]], found: _Found) -> dict[str, bytes]:
    """None where matplotlib is not installed."""
    try:
        return pictures(found)
    except MissingExtra:
        return {}


# ------------------------------------------------------------------------------------------ diagnosis


def _diagnosed(found: Diagnosis) -> str:
    causes = ", ".join(
        f"{' or '.join(c.effect for c in cause.candidates)} ({cause.candidates[0].confidence:.0%})"
        for cause in found.causes
    )
    gap, unit = found.gap, f" {found.gap.unit}".rstrip()
    far = "" if found.shrink is None else f", {max(found.shrink, 0.0):.0%} of what can be explained will go"
    where = f" in the {found.where.stage}" if found.where.stage else ""
    told = f"{found.verdict}{where}{': ' if causes else ''}{causes}"
    return f"{told}, off by {gap.as_given:.3g}{unit}{far}"


def _sizes(found: Diagnosis) -> TableOf | None:
    tables = sizes(found, units_of(found.drawn))
    return tables[0] if tables else None


def _candidates(found: Diagnosis) -> Rows:
    """A row for each size and each parameter of each candidate; one without any has a row as well."""
    rows = []
    for number_of, cause in enumerate(found.causes, 1):
        for one in cause.candidates:
            head: dict[str, Any] = {"cause": number_of, "stage": cause.stage, "effect": one.effect}
            head |= {"confidence": one.confidence, "shrink": cause.shrink}
            known = one.sizes | {k: e for k, e in one.parameters.items() if k not in one.sizes}
            for name, estimate in known.items():
                size = {"value": estimate.value, "low": estimate.ci95[0], "high": estimate.ci95[1]}
                rows.append(head | {"parameter": name} | size | {"unit": estimate.unit})
            if not known:
                rows.append(head | {"parameter": None})
    return rows


def _diagnosis_figures(found: Diagnosis) -> Sequence[Figure]:
    return figures_of(diagnosis_sections(found, found.drawn))


DIAGNOSIS = View[Diagnosis](
    _diagnosed,
    lambda found: diagnosis_lead(found, units_of(found.drawn)),
    _sizes,
    _candidates,
    _diagnosis_figures,
    lambda found: (*warnings(found.warnings), *notes(found.notes)),
    lambda found: dict(_if_drawn(diagnosis_pictures, found)),
)


# --------------------------------------------------------------------------------------------- replay


def _replayed(found: Replay) -> str:
    name = "" if found.rig is None else f"{found.rig.name}: "
    worst = min(found.logs, key=lambda log: found.logs[log].gof)
    mean = sum(one.gof for one in found.logs.values()) / len(found.logs)
    return (
        f"{name}GOF {mean:.3f} of {len(found.logs)} experiments, the worst {worst} with "
        f"{found.logs[worst].gof:.3f}"
    )


def _replay_table(found: Replay) -> TableOf:
    rows = tuple((name, number(one.gof), number(one.rmse)) for name, one in found.logs.items())
    return TableOf(("experiment", "GOF", "RMSE"), rows, "The output, measured and simulated")


def _logs(found: Replay) -> Rows:
    return [
        {"experiment": name, "gof": one.gof, "rmse": one.rmse}
        | {f"rmse_{signal}": value for signal, value in one.rmse_by_signal.items()}
        for name, one in found.logs.items()
    ]


def _replay_figures(found: Replay) -> Sequence[Figure]:
    return () if found.rig is None else replay_section(found.rig, found.experiments, found).figures


REPLAY = View[Replay](
    _replayed,
    lambda found: f"The rig on the inputs of {len(found.logs)} experiments: {_replayed(found)}.",
    _replay_table,
    _logs,
    _replay_figures,
    lambda found: (*warnings(found.warnings), *notes(found.notes)),
)


# ------------------------------------------------------------------------------------ study and scores


def _variants(found: Study) -> Rows:
    """A row for each variant; the errors of the four inputs each in a column of their own."""
    rows = [asdict(row) for row in found.rows]
    return [
        {key: value for key, value in row.items() if key != "errors"}
        | {f"error_{name}": value for name, value in (row["errors"] or {}).items()}
        for row in rows
    ]


def _study_files(found: Study) -> dict[str, str | bytes]:
    """Pictures, and a page with figures of its own or beside them: as far as the libraries are there."""
    pictures = _if_drawn(study_pictures, found)
    return {**pictures, "report.html": study_page(found, pictures).best()}


STUDY = View[Study](
    lambda found: f"{found.controller.name}: {len(found.rows)} variants; {found.recommendation}",
    lambda found: found.recommendation,
    lambda found: rows_table(found, sample_times(found)[0]),
    _variants,
    lambda found: figures_of(study_sections(found)),
    lambda found: notes(found.notes),
    _study_files,
)


def _scored(found: Summary) -> str:
    asked = [row for scores in found.sets for row in scores.rows if row.reached is not None]
    reached = sum(bool(row.reached) for row in asked)
    cases = sum(scores.cases for scores in found.sets)
    names = ", ".join(f"{scores.signals} {scores.suite}" for scores in found.sets)
    return f"{names}: {cases} cases, {reached} of {len(asked)} targets reached"


def _rows(found: Summary) -> Rows:
    """A row for each figure of each set."""
    rows = []
    for scores in found.sets:
        head = {"signals": scores.signals, "suite": scores.suite, "seed": scores.seed}
        for row in scores.rows:
            low, high = row.interval or (None, None)
            figures = {"score": row.name.strip(), "value": row.value, "low": low, "high": high}
            rows.append(head | figures | {"cases": row.cases, "target": row.target, "reached": row.reached})
    return rows


def _scores_table(found: Summary) -> TableOf | None:
    return section(found.sets[0]).tables[0] if found.sets else None


SUMMARY = View[Summary](
    _scored,
    lambda found: trials_lead(found.sets),
    _scores_table,
    _rows,
    lambda found: figures_of(map(section, found.sets)),
)
