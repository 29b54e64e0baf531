"""Fits to records with missing samples: complete the record under the model, and correct ordinates and bins for gaps.

Input: data with missing samples, and a model. Output: data completed under this model, with corrected degrees of
freedom. Add a further correction of bins in `shares.py`.
"""
