"""What the browser shows, as data: views, figures, tables, cards, the catalogue."""
