"""Formats of filters and calibration programs, one module each."""
