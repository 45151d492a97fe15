"""Uncertainty of identified laws: intervals, profile likelihood, posterior samples, model averaging and correlation."""
