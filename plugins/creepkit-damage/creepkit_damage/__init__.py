"""Creep laws with damage, one a file; each imports creepkit.language only."""
