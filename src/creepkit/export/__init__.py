"""Laws with their values as text: for people, for programs, and for the solvers of others."""

from creepkit.export.writing import write_export

__all__ = ["write_export"]
