"""Public benchmarks: diagnosed on their training record, replayed on their official test."""
