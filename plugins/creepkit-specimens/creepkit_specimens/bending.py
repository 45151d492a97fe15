"""Beams in bending."""
