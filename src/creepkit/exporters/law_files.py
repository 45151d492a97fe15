"""Laws with values as files: JSON that creepkit reads back, in the format creepkit-valued-law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from creepkit.errors import SAID, ExportError, LawError, quoted, restated
from creepkit.files.json_documents import DocumentFormat, check_heading, check_keys, json_text, parse_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.hookspecs import hookimpl
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import Exporter, LawWithValues

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


class JsonExporter:
    """The law, its values and notes as JSON; `read_valued_law` reads it."""

    name = "json"
    title = "JSON that creepkit reads back"
    suffix = ".json"

    def text(self, source: LawWithValues) -> str:
        """Return the document as text, indented."""
        if not source.units.is_native:
            raise ExportError(f"law '{source.law.name}': JSON holds a law in MPa and s, as creepkit reads it back")
        values = _Values(dict(source.values), tuple(source.notes), dict(source.ranges))
        law = law_to_json(source.law)
        return json_text({**VALUED_LAW.heading, **_CONVENTIONS, "law": law, **RecordCodec().to_json(values)})


def read_valued_law(text: str, source: str = "exported law") -> LawWithValues:
    """Return what JsonExporter wrote; ExportError or LawError, naming `source`, when it is anything else."""
    return valued_law_from_json(parse_json(text, source, VALUED_LAW.kind), source)


def valued_law_from_json(data: Any, source: str) -> LawWithValues:
    """Return the law of the JSON-able data of a document; errors as of read_valued_law."""
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
    with restated(RecordError, ExportError, f"{source}: {SAID}; {VALUED_LAW.kind.advice}"):
        values = RecordCodec().from_json(_Values, content)
    for name, (low, high) in values.ranges.items():
        if low > high:
            raise ExportError(f"{source}: ranges.{quoted(name)} is {low:g} to {high:g}; the lower number comes first")
    with restated(LawError, ExportError, f"{source}: {SAID}"):
        return LawWithValues(law, values.values, values.notes, ranges=values.ranges)


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [JsonExporter()]
