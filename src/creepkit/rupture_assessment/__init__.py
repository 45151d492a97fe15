"""Rupture tests by time-temperature methods: one censored likelihood, ranking, strength with bounds, checks."""
