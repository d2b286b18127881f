"""The three groups: what is read in process, readers in their own, whole commands."""

from __future__ import annotations

from tests.fuzz import commands, forked, targets
from tests.fuzz.campaign import Group

GROUPS = (
    Group("inputs", targets.TARGETS, lambda guidance: None, 10.0),
    Group("readers", forked.TARGETS, forked.preloaded, 30.0),
    Group("commands", commands.TARGETS, lambda guidance: commands.loaded(), 60.0),
)
