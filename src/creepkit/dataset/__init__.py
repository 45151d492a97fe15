"""Data sets: designs of experiments, what makes a sample worth keeping, generations of simulations and their files."""
