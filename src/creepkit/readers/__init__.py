"""Measured files to histories: small declared readers, units converted at the edge, every error with its line."""
