"""Global searches for the minima of a cost function, each followed by least squares."""
