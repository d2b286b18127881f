"""Generated controllers as Python objects."""
