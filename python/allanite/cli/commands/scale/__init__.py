"""Commands for many logs and for growing logs.

Input: paths of logs, or a stream. Output: a table, or alarms. Add a command as a module with a function `command`,
and its line of help in `cli/__init__.py`.
"""
