"""Files of clocks: RINEX clock files, Stable32, TimeLab.

Input: a path and a choice of columns. Output: a `Table` with the phase or frequency of clocks. Add a format as a
module with `read(path, pick)` and `FORMAT`.
"""
