"""Targets that are filters and their calibrators: one a file."""
