"""A transfer function as it stands in a file: two lists of terms."""

from __future__ import annotations

from collections.abc import Iterable

from focgen.fractional.transfer import Term, TransferFunction
from focgen.tomlfile import Table


def read_transfer(table: Table) -> TransferFunction:
    """The transfer function of a table's ``num`` and (optional) ``den``. Raises the table's error."""
    num, den = table.terms("num"), table.terms("den", [[1.0, 0.0]])
    try:
        return TransferFunction(num, den)
    except ValueError as reason:
        raise table.fail("den", str(reason), "give a denominator that is not zero") from None


def terms_of(polynomial: Iterable[Term]) -> list[list[float]]:
    """A polynomial as TOML writes it: [[coefficient, order], …]."""
    return [[t.coefficient, t.order] for t in polynomial]
