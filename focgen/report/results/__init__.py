"""Results outside of a page: in a line, in a notebook's cell, as matplotlib's figures, as data frames."""

from __future__ import annotations

from typing import Any

from focgen.report.results import chain, findings
from focgen.report.results.view import View

_VIEWS: dict[str, View[Any]] = {
    "Proposal": chain.PROPOSAL,
    "Identification": chain.IDENTIFICATION,
    "Design": chain.DESIGN,
    "Simulation": chain.SIMULATION,
    "Generated": chain.GENERATED,
    "Verification": chain.VERIFICATION,
    "Costs": chain.COSTS,
    "Diagnosis": findings.DIAGNOSIS,
    "Replay": findings.REPLAY,
    "Study": findings.STUDY,
    "Summary": findings.SUMMARY,
}


def _view(found: Any) -> View[Any]:
    return next(_VIEWS[kind.__name__] for kind in type(found).__mro__ if kind.__name__ in _VIEWS)


def line_of(found: Any) -> str:
    """The result in one line, its figures that matter first."""
    return _view(found).text(found)


def html_of(found: Any) -> str:
    """The result as a notebook shows it: a sentence, a table, what has to be said."""
    return _view(found).html(found)


def figure_of(found: Any, which: int = 0) -> Any:
    """One of the result's figures, ``matplotlib.figure.Figure``.

    Raises InputError where there is none of that number, MissingExtra where matplotlib is not installed.
    """
    return _view(found).figure(found, which)


def files_of(found: Any) -> dict[str, str | bytes]:
    """What is drawn of the result for its folder, by file name; pictures where matplotlib is installed."""
    return _view(found).files(found)


def frame_of(found: Any) -> Any:
    """The result's numbers, ``pandas.DataFrame``. Raises MissingExtra where pandas is not installed."""
    return _view(found).frame(found)
