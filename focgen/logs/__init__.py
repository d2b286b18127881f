"""Logs: tables from files, one reader a file; roles, time stamps, sessions."""

from focgen.logs.experiment import ROLES, Experiment
from focgen.logs.notes import notes_of
from focgen.logs.read import read_logs

__all__ = ["ROLES", "Experiment", "notes_of", "read_logs"]
