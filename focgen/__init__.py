"""focgen: from a CSV of step tests to a verified fractional-order controller on a microcontroller.

Every command is a function of this package with the same name; see ``focgen --help``. Arguments are called as
the options are, and the rig comes before its logs. Beside the functions stand the types that they take and
return, and the errors that they raise. :mod:`focgen.fractional` is the mathematics, :mod:`focgen.testing`
compares C of one's own with a reference.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from focgen.errors import (
    BuildError,
    ControllerError,
    DesignError,
    FitError,
    FocgenError,
    InputError,
    LogError,
    MissingExtra,
    PlanError,
    RigError,
)

if TYPE_CHECKING:
    from focgen.codegen.generate import Generated, generate
    from focgen.control.controller import Controller
    from focgen.control.files import read_controller, write_controller
    from focgen.demonstration import Demo, demo
    from focgen.diagnosis.diagnose import diagnose
    from focgen.diagnosis.model import Diagnosis
    from focgen.fractional.transfer import TransferFunction
    from focgen.identification.identification import Identification
    from focgen.identification.identify import identify
    from focgen.logs.experiment import Experiment
    from focgen.loop.design import Design, design
    from focgen.loop.simulate import Simulation, simulate
    from focgen.report.paths import report
    from focgen.rig.files import read_rig, write_rig
    from focgen.rig.proposal import Proposal, init
    from focgen.rig.reading import read_logs
    from focgen.rig.replay import Replay, replay
    from focgen.rig.rig import Rig
    from focgen.running.controller import LoadedController, ScheduledController
    from focgen.running.load import load
    from focgen.studies.results import Study
    from focgen.studies.study import study
    from focgen.trials.score import Summary
    from focgen.trials.trial import trial
    from focgen.verification.costs import Costs, cost
    from focgen.verification.verify import Verification, verify

__version__ = "0.1.0"

__all__ = [
    "BuildError",
    "Controller",
    "ControllerError",
    "Costs",
    "Demo",
    "Design",
    "DesignError",
    "Diagnosis",
    "Experiment",
    "FitError",
    "FocgenError",
    "Generated",
    "Identification",
    "InputError",
    "LoadedController",
    "LogError",
    "MissingExtra",
    "PlanError",
    "Proposal",
    "Replay",
    "Rig",
    "RigError",
    "ScheduledController",
    "Simulation",
    "Study",
    "Summary",
    "TransferFunction",
    "Verification",
    "__version__",
    "cost",
    "demo",
    "design",
    "diagnose",
    "generate",
    "identify",
    "init",
    "load",
    "read_controller",
    "read_logs",
    "read_rig",
    "replay",
    "report",
    "simulate",
    "study",
    "trial",
    "verify",
    "write_controller",
    "write_rig",
]

# Where each name lives; imported on first use, so that `import focgen` is quick.
_HOMES = {
    "codegen.generate": ("Generated", "generate"),
    "control.controller": ("Controller",),
    "control.files": ("read_controller", "write_controller"),
    "demonstration": ("Demo", "demo"),
    "diagnosis.diagnose": ("diagnose",),
    "diagnosis.model": ("Diagnosis",),
    "fractional.transfer": ("TransferFunction",),
    "identification.identify": ("identify",),
    "identification.identification": ("Identification",),
    "logs.experiment": ("Experiment",),
    "loop.design": ("Design", "design"),
    "loop.simulate": ("Simulation", "simulate"),
    "report.paths": ("report",),
    "rig.files": ("read_rig", "write_rig"),
    "rig.rig": ("Rig",),
    "rig.proposal": ("Proposal", "init"),
    "rig.reading": ("read_logs",),
    "rig.replay": ("Replay", "replay"),
    "running.controller": ("LoadedController", "ScheduledController"),
    "running.load": ("load",),
    "studies.results": ("Study",),
    "studies.study": ("study",),
    "trials.score": ("Summary",),
    "trials.trial": ("trial",),
    "verification.costs": ("Costs", "cost"),
    "verification.verify": ("Verification", "verify"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


if not TYPE_CHECKING:  # a checker reads the imports above

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module 'focgen' has no attribute {name!r}")
        return getattr(import_module(f"focgen.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
