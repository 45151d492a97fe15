"""From histories to a law with intervals: coordinates, objective, search, noise model, uncertainty, ranking."""
