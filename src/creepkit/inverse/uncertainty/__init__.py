"""Uncertainty of identified laws: intervals, posterior samples, model averaging and correlation."""
