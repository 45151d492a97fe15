"""Laws with values as files: JSON that creepkit reads back, and the text of any exporter written to a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.errors import ExportError, LawError, quoted
from creepkit.files.json_documents import DocumentFormat, check_heading, check_keys, json_text, parse_json, read_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.files.writing import write_text
from creepkit.hookspecs import hookimpl
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import Exporter, LawWithValues, exported_text

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification


VALUED_LAW = DocumentFormat(
    "creepkit-valued-law",
    3,
    FileKind("a law", ExportError, "give a law that creepkit exported as JSON"),
    remedy="export the law again",
)


_CONVENTIONS = {
    "units": {"stress": "MPa", "time": "s", "temperature": "K", "energy": "J/mol"},
    "gas_constant": GAS_CONSTANT,
}
"""What the numbers of a document mean: for other readers, and never anything else."""


@dataclass(frozen=True)
class _Values:
    """The values of a document, beside its law.

    values : {parameter: value}. notes : texts. ranges : {quantity: (lowest, highest)} that tests covered.
    """

    values: dict[str, float]
    notes: tuple[str, ...]
    ranges: dict[str, tuple[float, float]]


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
        values = _Values(dict(source.values), tuple(source.notes), dict(source.ranges))
        law = law_to_json(source.law)
        return json_text({**VALUED_LAW.heading, **_CONVENTIONS, "law": law, **RecordCodec().to_json(values)})


def read_valued_law(text: str, source: str = "exported law") -> LawWithValues:
    """Return what JsonExporter wrote; ExportError or LawError, naming `source`, when it is anything else."""
    return _valued_law(parse_json(text, source, VALUED_LAW.kind), source)


def _valued_law(data: Any, source: str) -> LawWithValues:
    content = check_heading(data, source, VALUED_LAW)
    problem = check_keys(content, (*_CONVENTIONS, "law", "values", "notes", "ranges"), source)
    if problem:
        raise ExportError(f"{problem}; {VALUED_LAW.kind.advice}")
    for key, expected in _CONVENTIONS.items():
        if content.pop(key) != expected:
            raise ExportError(
                f"{source}: '{key}' is {data[key]!r}; creepkit reads {expected!r} alone, convert the values"
            )
    law = law_from_json(content.pop("law"), source)
    try:
        values = RecordCodec().from_json(_Values, content)
    except RecordError as error:
        raise ExportError(f"{source}: {error}; {VALUED_LAW.kind.advice}") from None
    for name, (low, high) in values.ranges.items():
        if low > high:
            raise ExportError(f"{source}: ranges.{quoted(name)} is {low:g} to {high:g}; the lower number comes first")
    try:
        return LawWithValues(law, values.values, values.notes, ranges=values.ranges)
    except LawError as error:
        raise ExportError(f"{source}: {error}") from error


def read_law_file(path: str | Path) -> Identification | LawWithValues:
    """Return what a JSON file holds: an identification that was saved, or a law that was exported."""
    from creepkit.inverse.identification_document import identification_from_json

    data = read_json(Path(path), VALUED_LAW.kind)
    if isinstance(data, dict) and data.get("format") == VALUED_LAW.name:
        return _valued_law(data, str(path))
    return identification_from_json(data, str(path))


def write_export(source: LawWithValues, exporter: Exporter, destination: str | Path, *, force: bool = False) -> Path:
    """Write the exporter's text to a file, whole or not at all, and return its path.

    force : replace a file that creepkit did not write; else that is an ExportError, and the file stays.
    """
    text, path = exported_text(exporter, source), Path(destination)
    return write_text(text, path, ExportError, force=force)


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [JsonExporter()]
