"""Moves of the search: each takes the state of the search and returns a changed one, or None.

Input: a `State` of the search. Output: a changed `State`, or None if the move does not help. Add a move as a module
here, and call it in `allanite.study.steps`; `allanite.study.judgement` decides which change is accepted.

`add` adds a missing effect, and `drop` removes needless effects. `replace` exchanges an effect for another one or for
two. `merge` replaces several effects by one, and `narrow_bands` replaces lines and bands by one with harmonics or side
bands.
"""
