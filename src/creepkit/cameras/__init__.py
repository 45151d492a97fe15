"""Cameras: what correlation systems export, read frame by frame into one record."""
