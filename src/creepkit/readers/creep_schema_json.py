"""Creep tests after the data schema of NFDI-MatWerk (IUC02) for ISO 204: a JSON document, and its series in LIS files.

The document holds what is known of one test, numbers as `{"value": "980", "unit": "°C"}`; its series stand in a file
beside it that it names, `Vh5205_C-95-Creep.LIS`: lines of entry, symbol, unit and value, then `[data]`, rows of names,
symbols and units, and the numbers, all separated by tabs. Such a file alone is a test too. A document that names no
series is a rupture time, or a test that was stopped. The series is the percentage creep extension from the end of
loading on; the initial total extension before it is kept as the label `loading_strain`.

Source: data schema for creep data v2.1, github.com/kit-data-manager/Metadata-Schemas-for-Materials-Science; reference
data of BAM in it, doi 10.5281/zenodo.13937986.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from creepkit.errors import HistoryError, nearest, quoted
from creepkit.files.json_documents import read_json
from creepkit.files.reading import FileKind, read_bytes
from creepkit.readers.assembly import assemble_history, assemble_without_frames
from creepkit.readers.column_names import plain_name, unit_suffix
from creepkit.readers.table import CellTable, SourceText, TableRow, cells_of_width
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records import History
from creepkit.records.quantities import STRAIN, STRESS, TEMPERATURE, TIME, QuantityKind

DOCUMENT = FileKind("a creep test after the NFDI-MatWerk schema", HistoryError, "name its JSON document or LIS file")


SERIES = FileKind("a LIS file of a creep test", HistoryError, "save it as text", maximum_bytes=200_000_000)


NOT_STATED = ("", "not applicable", "n/a", "todo", "unknown")
"""Texts, in small letters, that stand for a value that is not there."""


_TEST, _RECORDED = "AdditionalMetadata/TestInfo/testParameters", "TestResult/valuesRecordedDuringTestRun"


ENTRIES: Mapping[str, tuple[str, str, QuantityKind | None]] = {
    "name": ("AdditionalMetadata/TestInfo/testJobDetails/testID", "test id", None),
    "alloy": ("AdditionalMetadata/MaterialHistoryAndCondition/materialIdentifier", "material identifier", None),
    "kind of loading": (f"{_TEST}/typeOfLoading", "type of loading", None),
    "control": (f"{_TEST}/loadControlType", "load control type", None),
    "end": (f"{_TEST}/endOfTestCriterium/endOfTestCriteriumOptions", "end of test criterium", None),
    "temperature": (f"{_TEST}/specifiedTemperature", "specified temperature", TEMPERATURE),
    "stress": (f"{_TEST}/initialStress", "initial stress", STRESS),
    "rupture": (*("PrimaryData/TestResult/valuesRecordedAfterTestEnd/creepRuptureTime", "creep rupture time"), TIME),
    "end_time": (f"PrimaryData/{_RECORDED}/testDuration", "test duration", TIME),
    "loading_strain": (
        *("SecondaryData/TestResult/extensionValues/percentageInitialTotalExtension",),
        *("percentage initial total extension", STRAIN),
    ),
    "series": (f"PrimaryData/{_RECORDED}/elapsedTimeFromEndOfLoading", "", None),
    "second series": (f"SecondaryData/{_RECORDED}/percentageExtension", "", None),
}
"""{what: where it stands below MeasurementData in a document, its name in a LIS file, and the kind of a number}."""


MEANINGS: Mapping[str, Mapping[str, str]] = {
    "kind of loading": {"tension": "tension"},
    "control": {"constant force": "load", "constant stress": "stress"},
}
"""{what: {text in small letters: what it means}}."""


BROKEN = ("test piece break", "break", "rupture", "fracture")
"""Criteria of the end of a test, in small letters, that say that it broke."""


CREEP_EXTENSION, PLASTIC_EXTENSION, TOTAL_EXTENSION = EXTENSIONS = (
    "percentage creep extension",
    "percentage plastic extension",
    "percentage extension",
)
"""ISO 204: that since the end of loading; with the initial plastic extension; with the whole initial extension."""


_NUMBER_AND_UNIT = re.compile(r"([+-]?\d+(?:[.,]\d+)?(?:[eEdD][+-]?\d+)?)\s*(\D*)", re.ASCII)


_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)


_FILE_NAME = re.compile(r"[\w.\- ]{0,200}\w\.lis\b", re.IGNORECASE)


class SchemaEntry(NamedTuple):
    """What is stated; unit : that stands apart from it."""

    text: str
    unit: str
    place: str


@dataclass(frozen=True)
class CreepSchemaReader:
    """Reader of documents and LIS files of single tests."""

    name: str = "creep-schema"
    title: str = "a creep test after the NFDI-MatWerk data schema for ISO 204: a JSON document, or a LIS file"

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is such a document, or such a series that no document beside it names."""
        suffix = path.suffix.lower()
        if suffix not in (".json", ".lis") or not path.is_file():
            return False
        beginning = _text(path, first=65536).casefold()
        if suffix == ".json":
            return '"measurementdata"' in beginning
        documents = (one for one in path.parent.glob("*.json") if one.is_file())
        named = any(path.name.casefold() in _text(one).casefold() for one in documents)
        return "[data]" in beginning and "elapsed time from end of loading" in beginning and not named

    def read(self, path: Path) -> list[History]:
        """Return the one test."""
        if path.suffix.lower() == ".lis":
            entries, table, extension = _read_series(path)
            return [_history(entries, path, table, extension)]
        document = read_json(path, DOCUMENT)
        data = _member(document, "measurementdata") if isinstance(document, dict) else None
        if not isinstance(data, dict):
            raise HistoryError(f"{path}: no object 'MeasurementData'; {DOCUMENT.advice}")
        entries = {what: _nested(data, where, path) for what, (where, _, _) in ENTRIES.items()}
        for link in ("series", "second series"):
            if found := _FILE_NAME.search(entries[link].text):
                file = path.parent / found[0].strip()
                if not file.is_file():
                    raise HistoryError(f"{path}: its series stand in '{file.name}', which is not beside it")
                others, table, extension = _read_series(file)
                named, here = others["name"].text, entries["name"].text
                if named and here and plain_name(named) != plain_name(here):
                    what = f"it is of the test '{named}', and {path} of '{here}'"
                    raise HistoryError(f"{file}: {what}; correct one of them")
                return [_history(entries, path, table, extension)]
        return [_history(entries, path)]


def _member(found: Mapping[str, Any], name: str) -> Any:
    """A member by its name in small letters: versions of the schema differ in capitals."""
    return next((value for key, value in found.items() if key.casefold() == name.casefold()), None)


def _nested(data: Mapping[str, Any], where: str, path: Path) -> SchemaEntry:
    """The entry that stands somewhere in a document."""
    found: Any = data
    for name in where.split("/"):
        found = _member(found, name) if isinstance(found, dict) else None
    is_pair = isinstance(found, dict)
    value, unit = ((_member(found, name) or "") for name in ("value", "unit")) if is_pair else (found, "")
    place = f"{path}: MeasurementData/{where}"
    value = "" if value is None else value
    if not isinstance(value, (str, int, float)) or isinstance(value, bool) or not isinstance(unit, str):
        raise HistoryError(f"{place}: it is {type(value).__name__}; write a text or a number")
    return _entry(value if isinstance(value, str) else repr(value), unit, place)


def _entry(text: str, unit: str, place: str) -> SchemaEntry:
    text = " ".join(text.replace("*", "").split())
    return SchemaEntry("" if text.casefold() in NOT_STATED else text, unit.strip(), place)


def _number(what: str, entry: SchemaEntry, kind: QuantityKind) -> tuple[str, SourceText]:
    """Key with its unit, and number with a decimal point."""
    match = _NUMBER_AND_UNIT.fullmatch(entry.text)
    if match is None:
        raise HistoryError(f"{entry.place}: '{entry.text}' is no number; write one such as 980, and its unit apart")
    if _THOUSANDS.fullmatch(match[1]):
        raise HistoryError(f"{entry.place}: '{match[1]}' may be a thousand or a decimal; write a decimal point")
    written = match[2].strip() or entry.unit
    suffix = unit_suffix(written)
    if suffix not in kind.units:
        raise HistoryError(f"{entry.place}: the unit '{written}' is not understood; {nearest(written, kind.units)}")
    return f"{what}_{suffix}", SourceText(match[1].replace(",", "."), entry.place)


def _stated(entries: Mapping[str, SchemaEntry]) -> Iterator[tuple[str, SourceText]]:
    """Keys and texts of a history file; HistoryError for a test that is none in tension, or ends that contradict."""
    for what, (_, _, kind) in ENTRIES.items():
        entry = entries[what]
        if what in MEANINGS and entry.text:
            if entry.text.casefold() not in MEANINGS[what]:
                allowed = ", ".join(MEANINGS[what])
                raise HistoryError(f"{entry.place}: '{entry.text}' is not understood; allowed: {allowed}")
            entry = entry._replace(text=MEANINGS[what][entry.text.casefold()])
        if entry.text and (kind or what in ("name", "alloy", "control")):
            yield _number(what, entry, kind) if kind else (what, SourceText(entry.text, entry.place))
    criterion, place = entries["end"].text, entries["end"].place
    if criterion and criterion.casefold() not in BROKEN:
        if entries["rupture"].text:
            what = f"it is '{quoted(criterion, 60)}', and a rupture time is stated"
            raise HistoryError(f"{place}: {what}; correct one of them")
        yield "ended", SourceText("stopped", place)
    yield "strain_measure", SourceText("engineering", place)


def _history(
    entries: Mapping[str, SchemaEntry], path: Path, table: CellTable | None = None, extension: str = CREEP_EXTENSION
) -> History:
    """The history; table : its series, None for a rupture time alone; extension : one of EXTENSIONS, of the series."""
    stated, name, vocabulary = dict(_stated(entries)), entries["name"].text or path.stem, HeaderVocabulary()
    lengths = [key for key in stated if key.startswith("end_time")]
    if table is None:
        for quantity in ("temperature", "stress"):
            if not entries[quantity].text:
                raise HistoryError(f"{entries[quantity].place}: it is not stated; a test needs its {quantity}")
        if not entries["rupture"].text and "ended" not in stated:
            found = "the test piece broke" if entries["end"].text else "it is not stated"
            raise HistoryError(
                f"{entries['end'].place}: {found}, and there is no creepRuptureTime; state it, or the criterion by "
                "which the test was stopped"
            )
        kept = ("temperature", "stress", "alloy", "control", "ended", "rupture", "end_time")
        drop = [*(lengths if entries["rupture"].text else []), *(key for key in stated if not key.startswith(kept))]
        stated = {key: entry for key, entry in stated.items() if key not in drop}
        return assemble_without_frames(name, stated, vocabulary, location=str(path), source=str(path))
    # What loading left of the plastic extension is its first value; the total extension is another.
    drop = [*lengths, *(key for key in stated if key.startswith("loading_strain") and extension == PLASTIC_EXTENSION)]
    stated = {key: entry for key, entry in stated.items() if key not in drop}
    if extension == CREEP_EXTENSION:
        stated["includes_elastic"] = SourceText("no", str(path))
    stated["includes_loading"] = SourceText("no" if extension == CREEP_EXTENSION else "yes", str(path))
    if temperatures := tuple(column for column in table.columns if column.startswith("Corrected")):
        vocabulary = replace(vocabulary, averaged_columns={"measured_temperature_C": temperatures})
    return assemble_history(name, stated, table, vocabulary, location=str(path), source=str(path))


def _text(path: Path, first: int | None = None) -> str:
    """The text of a file in UTF-8, else in the code page of Windows, in which the first LIS files were written."""
    content = read_bytes(path, SERIES, first=first)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _read_series(path: Path) -> tuple[dict[str, SchemaEntry], CellTable, str]:
    """Entries of the head of a LIS file, its table, and its extension."""
    lines = _text(path).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    cells = [[cell.strip().strip('"') for cell in line.rstrip().split("\t")] for line in lines]
    start = next((k for k, line in enumerate(lines) if line.strip().casefold() == "[data]"), None)
    if start is None or len(lines) < start + 4:
        raise HistoryError(f"{path}: no line '[data]' with rows of names, symbols and units below it; {SERIES.advice}")
    meant = {name: what for what, (_, name, _) in ENTRIES.items()}
    found: dict[str, SchemaEntry] = {}
    for number, row in enumerate(cells[:start], 1):
        if len(row) < 4 or not row[0]:
            continue
        name = " ".join(row[0].casefold().split()).removeprefix("(digital) ")
        if name not in meant:
            continue
        entry, what = _entry(row[3], row[2], f"{path}: {name}"), meant[name]
        if found.setdefault(what, entry) != entry:
            raise HistoryError(f"{path}:{number}: '{name}' stands there twice, with other values; keep one of them")
    names, units, columns = cells[start + 1], cells[start + 3], list[str]()
    if len(units) != len(names):
        raise HistoryError(f"{path}:{start + 4}: {len(units)} units for {len(names)} columns; write one for each")
    for name, written in zip(names, units, strict=True):
        plain, unit = name.casefold(), unit_suffix(written) or written
        if plain.startswith("elapsed time from end of loading") and unit in TIME.units:
            columns.append(f"time_{unit}")
        elif plain in EXTENSIONS and unit == "pct":
            columns.append("strain_pct")
        elif name.startswith("Corrected measured temperature") and unit == "C":
            columns.append(name)
        else:
            what = f"column '{name}' in '{written}' is not understood"
            raise HistoryError(f"{path}:{start + 2}: {what}; correct it or leave it out")
    table = CellTable(path, (), columns=columns, columns_line=start + 2)
    numbered = ((number, row) for number, row in enumerate(cells[start + 4 :], start + 5) if any(row))
    rows = [TableRow(k, cells_of_width(table, TableRow(k, row), len(columns))) for k, row in numbered]
    if not rows:
        raise HistoryError(f"{path}:{start + 4}: no rows below the units; a test needs at least two")
    extension = next((name.casefold() for name in names if name.casefold() in EXTENSIONS), CREEP_EXTENSION)
    entries = {what: SchemaEntry("", "", f"{path}: {name}") for what, (_, name, _) in ENTRIES.items()}
    return {**entries, **found}, replace(table, rows=rows), extension


CREEP_SCHEMA = CreepSchemaReader()
