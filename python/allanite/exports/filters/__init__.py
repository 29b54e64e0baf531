"""Formats of filters and calibration programs; formats with one convention share a module.

Add a filter to the module of its convention, or as a new module with `TARGETS`.
"""
