"""Sparse laws: contributions of the terms of a sum, penalties on them, and the reduced law compared with the sum."""
