"""Classical methods for comparison: slope lines on the Allan curve, and generalized least squares."""
