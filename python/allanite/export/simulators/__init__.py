"""Formats of simulators, one module each."""
