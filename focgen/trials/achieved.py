"""The shrink that a diagnosis achieves on logs it never saw."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import focgen

_LEAST = 0.1  # of the floor's mean square: a smaller gap cannot be measured


def shrink(run: Path, unseen: Sequence[Path], floor: float) -> float | None:
    """(m_refitted − m_augmented) / (m_refitted − m_floor) of the output over the unseen experiments, each
    counted alike.

    ``run`` holds ``refitted.toml`` and ``augmented.toml``, replayed from the command; ``floor`` is the rms of
    the noise that was added. None where the refitted rig is within a tenth of the floor already. Raises
    FocgenError as replay does.
    """
    before, after = (_mean_square(run / name, unseen) for name in ("refitted.toml", "augmented.toml"))
    if before - floor**2 < _LEAST * floor**2:
        return None
    return (before - after) / (before - floor**2)


def _mean_square(rig: Path, logs: Sequence[Path]) -> float:
    replayed = focgen.replay(rig, list(logs))
    return float(np.mean([one.rmse**2 for one in replayed.logs.values()]))
