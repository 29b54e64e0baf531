"""Fit of shape parameters (grid search, then joint optimization), and regression on known functions of time."""
