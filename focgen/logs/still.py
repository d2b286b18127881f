"""Signals that stand still from the first sample to the last: a plug that is out, a channel that is none."""

from __future__ import annotations

from collections.abc import Sequence

from focgen.errors import LogError
from focgen.logs.experiment import Experiment

_MEASURED = "output", "pressure", "curvature"


def check_moving(logs: Sequence[Experiment]) -> None:
    """Raise LogError where a measured signal has one value throughout, though another one moves.

    Of an output that stands still nothing can be said. A stage between two signals, of which one stands
    still, would be given a dead zone, friction or a limit of flow, each as large as need be.
    """
    moving = {role for role in logs[0].signals if _moves(logs, role)}
    for role in _MEASURED:
        if role in moving or not all(role in log for log in logs) or not (moving or role == "output"):
            continue
        what = f"{role} is {float(logs[0][role][0]):g} throughout"
        whose = f"{', '.join(sorted(moving))} move{'s' * (len(moving) == 1)}" if moving else "nothing moves"
        left = "" if role == "output" else f", or leave {role} out of [signals]"
        raise LogError(logs[0].name, f"{what}, while {whose}", f"check its plug and its column{left}")


def _moves(logs: Sequence[Experiment], role: str) -> bool:
    first = next((log[role][0] for log in logs if role in log), 0.0)
    return any(bool((log[role] != first).any()) for log in logs if role in log)
