"""Mutation testing: one small change of the sources at a time, and whether a test tells of it."""
