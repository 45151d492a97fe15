"""Sparse laws: the terms of a sum that the tests need, and the reduced law compared with the sum."""
