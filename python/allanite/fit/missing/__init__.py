"""Missing samples: the record completed under the fitted model, and what holes leave of each ordinate and bin."""
