"""Fits of one model to several recordings or several columns, and tests whether they agree.

Input: recordings or columns, and one model. Output: a fit of each, common values, and p-values of agreement. Add a
test of agreement in `many.py`.
"""
