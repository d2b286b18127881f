"""A rig fitted to experiments: one joint fit, each by itself, and what the logs cannot show."""
