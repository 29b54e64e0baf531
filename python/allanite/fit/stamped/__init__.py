"""Exact likelihood of samples at any times: generalized least squares of known functions under the noise of a model."""
