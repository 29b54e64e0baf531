"""The likelihood of cosine ordinates: data made ready, discrepancy, heavy tails."""
