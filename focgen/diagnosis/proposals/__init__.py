"""Experiments not yet made: which are worth making, and what they would tell apart."""
