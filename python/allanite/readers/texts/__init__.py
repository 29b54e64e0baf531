"""Text logs that are more than a table; each is recognized by its first bytes."""
