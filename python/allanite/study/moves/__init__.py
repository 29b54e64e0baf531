"""Moves of the search: each takes the state of the search and returns a changed one, or None.

Input: a `State` of the search. Output: a changed `State`, or None if the move does not help. Add a move as a module
here, and call it in `allanite.study.steps`; `allanite.study.judgement` decides which change is accepted.

`add` adds a missing effect, `drop` removes needless effects, `replace` exchanges one effect, `split` replaces one
effect by two, and `merge` replaces several effects by one.
"""
