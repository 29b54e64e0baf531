"""Shapes: searched on an effect's grid, climbed together with the coefficients; regression on known functions of time."""
