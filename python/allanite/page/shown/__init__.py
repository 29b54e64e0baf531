"""Contents of the browser page as data: views, figures, tables, cards, and the catalog of effects."""
