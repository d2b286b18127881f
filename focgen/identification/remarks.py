"""What was done to the logs and taken for granted, each kind of it said once."""

from __future__ import annotations

from collections.abc import Sequence

from focgen.identification.identification import Identification
from focgen.logs.experiment import Experiment
from focgen.logs.notes import listed, notes_of
from focgen.rig.rig import UNITY, LinearActuator, Rig


def remarks_of(experiments: Sequence[Experiment], nominal: Rig, found: Identification) -> tuple[str, ...]:
    """The notes, those on the logs first."""
    said = [*notes_of(experiments)]
    for fit in found.stages.values():
        said += fit.notes
    said += _between(nominal, found.rig)
    said += _pasts(found)
    said += _singles(found)
    if isinstance(nominal.actuator, LinearActuator) and found.joint:
        said.append(
            "the rig's actuator was a transfer function; the identified one is K(p) p through "
            "1/(T s^alpha + 1)"
        )
    said += _taken_for_one(experiments, found)
    said += [
        f"driven by the {_input(driven, found.rig)}, fitted to the {_output(fitted, found.rig)}"
        for driven, fitted in sorted({(f.driven_by, f.fitted) for f in found.experiments})
    ]
    if found.joint and found.joint.closed_loop:
        said.append("closed loop: fitted with a model of the noise, so that feedback brings no bias")
    return tuple(said)


def _between(nominal: Rig, found: Rig) -> list[str]:
    """What the command does between its samples, where the logs have shown it."""
    if found.between in (None, nominal.between):
        return []
    word = found.between.name.lower()
    does = {"held": "is held", "straight": "runs in straight lines", "smooth": "is smooth"}[word]
    return [f"the command {does} between its samples, as the logs show: written as between = {word!r}"]


def _input(role: str, rig: Rig) -> str:
    if role == "pressure":
        return "measured pressure"
    return "command" if rig.regulator == UNITY else "command through the regulator"


def _output(role: str, rig: Rig) -> str:
    return "output through the sensor" if role == "output" and rig.sensor != UNITY else role


def _pasts(found: Identification) -> list[str]:
    pasts = found.joint.pasts if found.joint else {}
    if not pasts:
        return []
    verb = "begins" if len(pasts) == 1 else "begin"
    return [f"{listed(pasts)} {verb} in a transient: the state from what was before is estimated along"]


def _singles(found: Identification) -> list[str]:
    bare = [f.name for f in found.experiments if f.integer and not any(m.offset for m in f.integer)]
    if not bare:
        return []
    verb = "begins with the step and shows" if len(bare) == 1 else "begin with the step and show"
    return [f"{listed(bare)} {verb} no offset: integer-order models have none"]


def _taken_for_one(experiments: Sequence[Experiment], found: Identification) -> list[str]:
    """Stages that both ends of are logged, and that the rig does not have."""
    said = []
    for stage, ends in (("regulator", ("command", "pressure")), ("sensor", ("curvature", "output"))):
        logged = any(all(role in e for role in ends) for e in experiments)
        if stage not in found.stages and getattr(found.rig, stage) == UNITY and logged:
            said.append(
                f"no [{stage}] in the rig: it is taken for 1, though {ends[0]} and {ends[1]} are logged; "
                f"--stages {stage},actuator identifies it"
            )
    return said
