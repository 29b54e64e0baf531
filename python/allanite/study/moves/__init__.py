"""Moves of the search: each takes the state of the search and returns a changed one, or None.

`add` adds an effect that a check found missing. `drop` drops what it makes needless. `replace` puts another effect in
the place of one, `split` two, and `merge` puts one effect in the place of several. `allanite.study.judgement` decides which
change is accepted.
"""
