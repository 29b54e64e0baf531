"""Tools that every package uses: errors, units, numbers, files, child processes, memory limits, threads.

Input: arguments, paths and numbers. Output: checked values, texts, or an error that names its remedy. Add a unit in
`units.py`, and a parameter that errors can ask for in `errors.py`.
"""
