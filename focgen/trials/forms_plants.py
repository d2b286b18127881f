"""Dry friction on what moves, in the rigs of the suite "plants"; other suites have none."""

from __future__ import annotations

import numpy as np

from focgen.trials.forms import Amplitude, Form, Spans


def _block(rng: np.random.Generator, s: Spans) -> Amplitude:
    return lambda a: (a * s.drive,)


def _stribeck(rng: np.random.Generator, s: Spans) -> Amplitude:
    more, speed = rng.uniform(0.15, 0.5), rng.uniform(0.01, 0.05) * s.curvature
    return lambda a: (a * s.drive, more * a * s.drive, speed)


FRICTION = (Form("dry_block", 0.003, 0.5, _block), Form("stribeck_block", 0.003, 0.4, _stribeck))
