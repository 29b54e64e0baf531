"""The methods of the field beside ours: slope lines of the Allan curve, generalised least squares, a comparison of them."""
