"""Pictures, tables, pages.

Called, the room does what the command of its name does: :func:`focgen.report.paths.report`.
"""

import sys
from types import ModuleType


class _Room(ModuleType):
    """``focgen.report(paths, out)``: a command's function has the command's name, here the room's, too."""

    def __call__(self, paths, out):
        from focgen.report.paths import report

        return report(paths, out)


sys.modules[__name__].__class__ = _Room
