"""Attempts to have code executed by data, one module for each place that text or files are taken from."""
