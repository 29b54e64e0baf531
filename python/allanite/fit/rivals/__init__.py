"""Alternative explanations of an effect, and their evidence.

Input: a fit. Output: fits with other effects, and their evidence. Add a kind of replacement in `alternatives.py` for
one effect, or in `pairs.py` for two effects.
"""
