"""The plugin interfaces of readers and exporters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from creepkit.records.history import History
    from creepkit.records.law_with_values import LawWithValues


@runtime_checkable
class Reader(Protocol):
    """Turns measured files into histories."""

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""

    @property
    def title(self) -> str:
        """One line for people."""

    def accepts(self, path: Path) -> bool:
        """Say whether this reader understands the file or folder, without reading all of it."""

    def read(self, path: Path) -> list[History]:
        """Return the histories in the file or folder; HistoryError with file and line when it cannot."""


@runtime_checkable
class Exporter(Protocol):
    """Writes a law with its values as text: to read, or for another program.

    Optional attribute: `serves`, other words that users ask for it by, such as ("umat",).
    """

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""

    @property
    def title(self) -> str:
        """One line for people."""

    @property
    def suffix(self) -> str:
        """Ending of a file's name, with its dot."""

    def text(self, source: LawWithValues) -> str:
        """Return the text; notes (intervals, validity) become comments.

        ExportError, with the reason, when the target cannot express the law or its units.
        """
