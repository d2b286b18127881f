"""focgen: from a CSV of step tests to a verified fractional-order controller on a microcontroller.

Every command is a function of this package with the same name; see ``focgen --help``.
"""

from importlib import import_module

from focgen.errors import FocgenError

__version__ = "0.1.0"

# Where each function lives; imported on first use, so that `import focgen` is quick.
_FUNCTIONS = {
    "init": "focgen.rig.proposal",
    "identify": "focgen.identification.identify",
    "design": "focgen.loop.design",
    "simulate": "focgen.loop.simulate",
    "generate": "focgen.codegen.generate",
    "verify": "focgen.verification.verify",
    "load": "focgen.running.load",
    "cost": "focgen.verification.costs",
    "diagnose": "focgen.diagnosis.diagnose",
    "trial": "focgen.trials.trial",
    "replay": "focgen.rig.replay",
    "study": "focgen.studies.study",
    "demo": "focgen.demonstration",
    "report": "focgen.report.paths",
    "read_logs": "focgen.rig.reading",
    "read_rig": "focgen.rig.files",
    "read_controller": "focgen.control.files",
}

__all__ = ["FocgenError", "__version__", *sorted(_FUNCTIONS)]


def __getattr__(name: str):
    if name not in _FUNCTIONS:
        raise AttributeError(f"module 'focgen' has no attribute {name!r}")
    return getattr(import_module(_FUNCTIONS[name]), name)


def __dir__():
    return __all__
