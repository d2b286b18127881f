"""Pictures, tables, pages.

Called, the room does what the command of its name does: :func:`focgen.report.paths.report`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from focgen.report.paths import Part


class _Room(ModuleType):
    """``focgen.report(paths, out)``: a command's function has the command's name, here the room's, too."""

    def __call__(self, paths: Part | Sequence[Part], out: str | Path) -> Path:
        """Write one page of ``paths`` to the file ``out``, :func:`focgen.report.paths.report`, and return it.

        Raises InputError for a path that no page is made of, MissingExtra where Bokeh is not installed.
        """
        from focgen.report.paths import report

        return report(paths, out)


sys.modules[__name__].__class__ = _Room
