"""Exporters: a law with its values as text for people, for programs and for finite element codes.

One exporter a file; `builtin` lists them. A new one is a class with `name`, `title`, `suffix` and `text(source)`.
"""

from creepkit.exporters.law_files import write_export

__all__ = ["write_export"]
