"""Whittle likelihood of cosine ordinates: prepared data, model discrepancy, whitening, heavy tails.

Input: samples or a summary (`prepare`), and a model. Output: the prepared `Data` and the log-likelihood of the model.
Add an exception to the Whittle likelihood as a module, and apply it in `data.py` or `whittle.py`.
"""
