"""Formats of filters and calibration programs; formats with one convention share a module.

Input: the models of the axes and a rate. Output: the text of a parameter file. Add a filter to the module of its
convention, or as a new module with `TARGETS`.
"""
