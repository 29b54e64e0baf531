"""Exact likelihood of samples at arbitrary times: generalized least squares of known functions under modeled noise.

Input: samples with their times, known functions, and candidates of noise. Output: coefficients, fitted noise and
their uncertainties. Add a candidate in `candidates.py`, and its state space in `noise.py`.
"""
