"""Laws with values as files: JSON that creepkit reads back, and the text of any exporter written to a file."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.errors import ExportError
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import Exporter, LawWithValues

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification


LAW_FORMAT = "creepkit-valued-law"


LAW_FORMAT_VERSION = 2


_REQUIRED_KEYS = {"format", "version", "units", "gas_constant", "law", "values", "notes", "ranges"}


_FIXED_ENTRIES = {
    "units": {"stress": "MPa", "time": "s", "temperature": "K", "energy": "J/mol"},
    "gas_constant": GAS_CONSTANT,
}
"""What the numbers of a document mean: told to other readers, and never anything else."""


@dataclass(frozen=True)
class JsonExporter:
    """The law, its values and notes as JSON; `read_valued_law` reads it."""

    name: str = "json"
    title: str = "JSON that creepkit reads back"
    suffix: str = ".json"

    def text(self, source: LawWithValues) -> str:
        """Return the document as text, indented."""
        if not source.units.is_native:
            raise ExportError(f"law '{source.law.name}': JSON holds a law in MPa and s, as creepkit reads it back")
        document = {
            "format": LAW_FORMAT,
            "version": LAW_FORMAT_VERSION,
            **_FIXED_ENTRIES,
            "law": law_to_json(source.law),
            "values": dict(source.values),
            "notes": list(source.notes),
            "ranges": {name: list(ends) for name, ends in source.ranges.items()},
        }
        return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def read_valued_law(text: str, source: str = "exported law") -> LawWithValues:
    """Return what JsonExporter wrote; ExportError or LawError, naming `source`, when it is anything else."""
    data = _parse_json(text, source)
    if not isinstance(data, dict) or data.get("format") != LAW_FORMAT:
        raise ExportError(
            f"{source}: this is not a law that creepkit exported (format '{LAW_FORMAT}', version {LAW_FORMAT_VERSION})"
        )
    if data.get("version") != LAW_FORMAT_VERSION:
        raise ExportError(
            f"{source}: written by another creepkit, in version {data.get('version')!r} of the format; "
            f"this one reads version {LAW_FORMAT_VERSION}: export the law again"
        )
    if set(data) != _REQUIRED_KEYS:
        unexpected = ", ".join(sorted(set(data) ^ _REQUIRED_KEYS))
        raise ExportError(
            f"{source}: the entries {unexpected} are missing or unknown; allowed are {', '.join(sorted(_REQUIRED_KEYS))}"
        )
    for key, expected in _FIXED_ENTRIES.items():
        if data[key] != expected:
            raise ExportError(
                f"{source}: '{key}' is {data[key]!r}; creepkit reads {expected!r} alone, convert the values"
            )
    values, notes = data["values"], data["notes"]
    if not isinstance(values, dict) or any(type(v) not in (int, float) for v in values.values()):
        raise ExportError(f"{source}: 'values' must be numbers by the names of parameters")
    if not isinstance(notes, list) or any(type(note) is not str for note in notes):
        raise ExportError(f"{source}: 'notes' must be a list of texts")
    law = law_from_json(data["law"], source)
    return LawWithValues(law, values, tuple(notes), ranges=_ranges(data["ranges"], source))


def _ranges(data: Any, source: str) -> dict[str, tuple[float, float]]:
    """What tests covered: two numbers by name, the lower first."""
    if not isinstance(data, dict) or not all(map(_is_range, data.values())):
        raise ExportError(
            f"{source}: 'ranges' must be pairs of numbers, the lower first, by the names of what they are"
        )
    return {str(name): (float(low), float(high)) for name, (low, high) in data.items()}


def _is_range(value: Any) -> bool:
    return (
        isinstance(value, list)
        and [type(v) in (int, float) for v in value] == [True, True]
        and bool(value[0] <= value[1])
    )


def read_law_file(path: str | Path) -> Identification | LawWithValues:
    """Return what a JSON file holds: an identification that was saved, or a law that was exported."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ExportError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or 'not UTF-8 text'})") from None
    data = _parse_json(text, str(path))
    if isinstance(data, dict) and data.get("format") == LAW_FORMAT:
        return read_valued_law(text, str(path))
    from creepkit.inverse.identification_document import identification_from_json

    return identification_from_json(data, str(path))


def _parse_json(text: str, source: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise ExportError(f"{source}, line {error.lineno}: not JSON: {error.msg}") from None
    except (ValueError, RecursionError):
        raise ExportError(f"{source}: not a law: it holds an integer too long or lists nested too deep") from None


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
