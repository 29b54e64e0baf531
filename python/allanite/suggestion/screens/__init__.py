"""Searches for missing effects in the residual of a fit, one module for each kind.

Input: a fit and its whitened residual. Output: candidates with the expected rise of the log-likelihood. Add a search
as a module here that declares `SCREEN` (`_screen.py`); `suggest.py` runs it.
"""
