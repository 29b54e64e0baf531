"""The commands, one module each.

Input: the options of the command line. Output: text or JSON on standard output, and files. Add a command as a module
with a function `command`, and its line of help in `cli/__init__.py`.
"""
