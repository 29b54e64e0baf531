"""Text logs with a structure of their own, recognized by their first bytes.

Input: a path and a choice of columns. Output: a `Table`. Add a format as a module with `read(path, pick)` and a
`FORMAT` whose `recognizes` tests the first bytes.
"""
