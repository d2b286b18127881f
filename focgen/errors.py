"""Every error that bad input can cause.

    FocgenError                 where it is, what is wrong, and the remedy, in one line
    ├── InputError              a file cannot be read, or lacks what it needs
    │   ├── LogError            a log: columns, time stamps, samples
    │   ├── RigError            a rig.toml
    │   └── ControllerError     a controller.toml
    ├── FitError                the data cannot determine what was asked for
    ├── DesignError             no controller meets the specification
    ├── PlanError               the controller cannot be realised in this arithmetic
    ├── BuildError              the C compiler is missing or refused the code
    └── MissingExtra            an optional library is not installed

The command line prints ``focgen: error: WHERE: WHAT; REMEDY`` and exits with status 2.
"""

import re
from collections.abc import Iterable
from typing import Self

_BREAKS = re.compile(r"\s*[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]\s*")
_LONGEST = 600  # characters of a part of a message: a value from a file may have millions


class FocgenError(Exception):
    """Input that cannot be used.

    ``where`` names the file, table or argument; ``what`` the fault, with the offending value;
    ``remedy`` what to do about it.
    """

    def __init__(self, where: str, what: str, remedy: str) -> None:
        self.where, self.what, self.remedy = _short(str(where)) or "''", _short(what), _short(remedy)
        super().__init__(f"{self.where}: {self.what}; {self.remedy}")

    def __reduce__(
        self,
    ) -> tuple[type[Self], tuple[str, str, str]]:  # three arguments, so that errors cross process boundaries
        return type(self), (self.where, self.what, self.remedy)


def _short(text: str) -> str:
    """A part of the message on one line, without the middle of what is too long to be read."""
    text = _BREAKS.sub(" ", text)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} … {text[-_LONGEST // 2 :]}"


class InputError(FocgenError):
    """A file cannot be read, or lacks what it needs."""


class LogError(InputError):
    """A log cannot be used."""


class RigError(InputError):
    """A rig.toml cannot be used."""


class ControllerError(InputError):
    """A controller.toml cannot be used."""


class FitError(FocgenError):
    """The data cannot determine what was asked for."""


class DesignError(FocgenError):
    """No controller meets the specification."""


class PlanError(FocgenError):
    """The controller cannot be realised in this arithmetic."""


class BuildError(FocgenError):
    """The C compiler is missing or refused the code."""


class MissingExtra(FocgenError):
    """An optional library is not installed; the remedy is the line that installs it."""

    @classmethod
    def of(cls, library: str, extra: str, purpose: str) -> Self:
        """The error of a ``purpose`` that needs a library from one of the project's extras."""
        return cls(purpose, f"needs {library}, which is not installed", f"pip install 'focgen[{extra}]'")


def check_choice(
    where: str, value: str, choices: Iterable[str], error: type[FocgenError] = InputError
) -> None:
    """Raise ``error`` where ``value`` is none of ``choices``."""
    names = tuple(choices)
    if value not in names:
        raise error(where, f"is {value!r}", f"choose one of {', '.join(names)}")
