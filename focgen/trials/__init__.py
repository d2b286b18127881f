"""Sealed cases: rigs whose unmodelled effect is withheld from the diagnosis and unsealed only to score it.

The generator is a simulator of its own, in C (folder ``c``): Runge–Kutta for the integer stages, the implicit
L1 scheme on the full history for the fractional one, and for every effect two or more forms that the
library's own simulator does not have (see :mod:`focgen.trials.forms`).

Seeds below 1000 are for tuning the diagnosis, seeds from 1000 on for reporting, each run once.
"""
