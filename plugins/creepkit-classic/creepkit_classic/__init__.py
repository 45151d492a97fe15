"""Creep laws of the literature, one a file; each imports creepkit.language only. `conversions` is for Norton-Bailey."""
