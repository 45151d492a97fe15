"""From histories to a law with intervals: coordinates, objective, search, scatter, uncertainty, ranking."""
