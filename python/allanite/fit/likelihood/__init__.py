"""Whittle likelihood of cosine ordinates: prepared data, model discrepancy, whitening, heavy tails."""
