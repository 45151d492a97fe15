"""Sampling designs: which parameters and test conditions are simulated, and which samples are kept."""
