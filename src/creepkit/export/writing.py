"""The verbs: a law and its values through an exporter, to a string or to a file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from creepkit.errors import ExportError
from creepkit.language.law import CreepLaw
from creepkit.records import Exporter


def export_text(law: CreepLaw, values: Mapping[str, float], exporter: Exporter, notes: Sequence[str] = ()) -> str:
    """Return the law with `values`, {parameter: number in its unit}, as the exporter writes it."""
    return exporter.text(law, law.values(values), tuple(notes))


def write_text(
    law: CreepLaw, values: Mapping[str, float], exporter: Exporter, to: str | Path, notes: Sequence[str] = ()
) -> Path:
    """Write the exporter's text to the file `to`, whole or not at all, and return its path."""
    text = export_text(law, values, exporter, notes)
    path = Path(to)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise ExportError(f"law '{law.name}' cannot be written to {path}: {error.strerror or error}") from None
    return path
