"""What looks for one kind of missing effect each, in the residual of a fit."""
