"""Laws with their values as text: LaTeX, plain Python, JSON and whatever plugins add."""

from creepkit.export.writing import export_text, write_text

__all__ = ["export_text", "write_text"]
