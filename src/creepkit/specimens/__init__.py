"""Test pieces: what is loaded, which outputs are observed, and how they follow from a law."""
