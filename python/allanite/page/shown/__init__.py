"""Contents of the browser page as data: views, figures, tables, cards, and the catalog of effects.

Input: the state of a tab. Output: documents that the browser draws. Add a view to `VIEWS` in
`figures.py`, and other data to `_PARTS` in `parts.py`.
"""
