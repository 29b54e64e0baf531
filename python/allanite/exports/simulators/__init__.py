"""Formats of simulators, one module each.

Input: the models of the axes and a rate. Output: the text of a parameter file. Add a simulator as a module with
`render` and `TARGETS`.
"""
