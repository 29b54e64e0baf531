"""Classical methods for comparison: slope lines on the Allan curve, and generalized least squares.

Input: a recording and a model. Output: estimates with intervals, or slope lines with the range of τ where they hold.
Add another method as a module here, and compare it in `methods.py`.
"""
