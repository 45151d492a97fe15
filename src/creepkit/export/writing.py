"""The text of an exporter into a file."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from creepkit.errors import ExportError
from creepkit.records import Exporter, LawWithValues


def write_export(source: LawWithValues, exporter: Exporter, destination: str | Path, *, force: bool = False) -> Path:
    """Write the exporter's text to the file `to`, whole or not at all, and return its path.

    force : replace a file that exists; else that is an ExportError, and the file stays.
    """
    text, path, subject = exporter.text(source), Path(destination), f"law '{source.law.name}'"
    if path.is_dir():
        raise ExportError(f"{subject} cannot be written to {path}: it is a folder; name a file in it")
    if path.exists() and not force:
        raise ExportError(f"{path} exists already and was left as it is; choose another name, or overwrite it by force")
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        with suppress(OSError):  # the folder may be no folder
            temporary.unlink(missing_ok=True)
        raise ExportError(f"{subject} cannot be written to {path}: {error.strerror or error}") from None
    return path
