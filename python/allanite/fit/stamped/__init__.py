"""Exact likelihood of samples at arbitrary times: generalized least squares of known functions under modeled noise."""
