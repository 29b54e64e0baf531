"""Fit of shape parameters (grid search, then joint optimization), and regression on known functions of time.

Input: data, and a model with open shapes. Output: the model with fitted shapes and coefficients. Add a search for a
new kind of shape as a module, and call it in `shape.py`.
"""
