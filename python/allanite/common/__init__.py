"""Utilities for all packages: errors, units, formatting of numbers, validation of arguments, files and processes."""
