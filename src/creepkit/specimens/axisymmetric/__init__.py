"""Specimens that are bodies of revolution, simulated by finite elements."""
