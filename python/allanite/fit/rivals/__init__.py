"""What may stand in the place of an effect, and how much evidence there is for it."""
