"""Moves of the search: each takes the state of the search and returns a changed one, or None.

Input: a `State` of the search. Output: a changed `State`, or None if the move does not help. Add a move as a module
here, and call it in `allanite.study.steps`; `allanite.study.judgement` decides which change is accepted.

`add` adds a missing effect, and `drop` removes needless effects. `replace` exchanges an effect for another one or for
two. Four modules replace several effects by one: `merge`, `excursions`, `levels`, and `narrow_bands` for harmonics and
side bands.
"""
