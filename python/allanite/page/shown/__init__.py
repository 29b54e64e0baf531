"""Contents of the browser page as data: views, figures, tables, cards, and the catalog of effects.

Add a view to `VIEWS` in `figures.py`, and other data to `_PARTS` in `parts.py`.
"""
