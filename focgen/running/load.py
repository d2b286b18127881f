"""``load``: a generated folder as a Python object."""

from __future__ import annotations

from pathlib import Path

from focgen.arguments import checked
from focgen.errors import InputError
from focgen.running.controller import LoadedController, ScheduledController
from focgen.running.machine import Machine
from focgen.verification.folder import read_folder, sources

__all__ = ["LoadedController", "ScheduledController", "load"]


@checked
def load(
    folder: str | Path, *, raw: bool = False, edited: bool = False
) -> LoadedController | ScheduledController:
    """Compile the C of a generated folder and return it as an object with ``reset``, ``step``, ``track``,
    ``flags`` and ``run``; where the gain is scheduled, ``step`` and ``run`` take ``sched`` as well.

    Values are in the units of controller.toml, or counts with ``raw``. Any number of controllers may be
    loaded, of one folder too; ``new()`` makes one more without compiling again.

    The folder is rendered anew first, and compiled from that. One that has been edited is refused unless
    ``edited`` asks for its own C. That runs in this process: do not load a stranger's outside a sandbox.

    Raises InputError for a folder that is none, has been edited, or was made by another version of focgen,
    BuildError where there is no C compiler or the C does not compile.
    """
    read = read_folder(folder)
    if read.differences and not edited:
        remedy = "generate it again, or load it with edited=True"
        raise InputError(str(read.path), f"has been edited: {read.differences[0]}", remedy)
    with sources(read) as place:
        machine = Machine(read.plan, place)
    kind = ScheduledController if read.plan.schedule else LoadedController
    return kind(read.plan, machine, Path(folder), raw, read.differences)
