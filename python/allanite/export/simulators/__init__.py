"""Targets that are simulators: one a file."""
