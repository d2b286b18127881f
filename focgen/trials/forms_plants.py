"""Dry friction on what moves, in the rigs of the suite "plants"; other suites have none."""

from __future__ import annotations

from focgen.trials.forms import Form


def _block(rng, s):
    return lambda a: (a * s.drive,)


def _stribeck(rng, s):
    more, speed = rng.uniform(0.15, 0.5), rng.uniform(0.01, 0.05) * s.curvature
    return lambda a: (a * s.drive, more * a * s.drive, speed)


FRICTION = (Form("dry_block", 0.003, 0.5, _block), Form("stribeck_block", 0.003, 0.4, _stribeck))
