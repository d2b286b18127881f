"""Pictures, tables, pages.

Called, the room does what the command of its name does: :func:`focgen.report.paths.report`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType


class _Room(ModuleType):
    """``focgen.report(paths, out)``: a command's function has the command's name, here the room's, too."""

    def __call__(self, paths: str | Path | Sequence[str | Path], out: str | Path) -> Path:
        from focgen.report.paths import report

        return report(paths, out)


sys.modules[__name__].__class__ = _Room
