"""Formats of filters and calibration programs, one module each.

Input: the models of the axes and a rate. Output: the text of a parameter file. Add a filter as a module with `render`
and `TARGETS`.
"""
