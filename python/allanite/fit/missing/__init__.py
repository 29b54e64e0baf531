"""Fits to records with missing samples: complete the record under the model, and correct ordinates and bins for gaps."""
