"""Data sets: designs of experiments, what makes a sample worth keeping, campaigns of simulations and their files."""
