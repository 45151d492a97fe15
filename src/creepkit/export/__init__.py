"""Laws with their values as text: for people, for programs, and for the solvers of others."""

from creepkit.export.writing import write_text

__all__ = ["write_text"]
