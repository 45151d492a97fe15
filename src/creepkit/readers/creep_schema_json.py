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
from typing import Any

from creepkit.errors import HistoryError, quoted
from creepkit.files.json_documents import read_json
from creepkit.files.reading import FileKind, read_bytes
from creepkit.readers.assembly import assemble_history, assemble_without_frames
from creepkit.readers.ends_of_tests import RUPTURED, STOPPED, UNCLEAR, end_said_by
from creepkit.readers.table import CellTable, SourceText, TableRow, cells_of_width
from creepkit.readers.vocabulary import HeaderVocabulary, plain_name, unit_suffix
from creepkit.records import History
from creepkit.records.quantities import TIME

DOCUMENT = FileKind("a creep test after the NFDI-MatWerk schema", HistoryError, "name its JSON document or LIS file")


SERIES = FileKind("a LIS file of a creep test", HistoryError, "save it as text", maximum_bytes=200_000_000)


NOT_STATED = ("", "not applicable", "n/a", "todo", "unknown")
"""Texts, in small letters, that stand for a value that is not there."""


_TEST, _RECORDED = "AdditionalMetadata/TestInfo/testParameters", "TestResult/valuesRecordedDuringTestRun"


ENTRIES: Mapping[str, tuple[str, str]] = {
    "name": ("AdditionalMetadata/TestInfo/testJobDetails/testID", "test id"),
    "alloy": ("AdditionalMetadata/MaterialHistoryAndCondition/materialIdentifier", "material identifier"),
    "kind of loading": (f"{_TEST}/typeOfLoading", "type of loading"),
    "control": (f"{_TEST}/loadControlType", "load control type"),
    "end": (f"{_TEST}/endOfTestCriterium/endOfTestCriteriumOptions", "end of test criterium"),
    "temperature": (f"{_TEST}/specifiedTemperature", "specified temperature"),
    "stress": (f"{_TEST}/initialStress", "initial stress"),
    "rupture": ("PrimaryData/TestResult/valuesRecordedAfterTestEnd/creepRuptureTime", "creep rupture time"),
    "end_time": (f"PrimaryData/{_RECORDED}/testDuration", "test duration"),
    "loading_strain": (
        *("SecondaryData/TestResult/extensionValues/percentageInitialTotalExtension",),
        "percentage initial total extension",
    ),
    "series": (f"PrimaryData/{_RECORDED}/elapsedTimeFromEndOfLoading", ""),
    "second series": (f"SecondaryData/{_RECORDED}/percentageExtension", ""),
}
"""{what: where it stands below MeasurementData in a document, and its name in a LIS file}."""


MEANINGS: Mapping[str, Mapping[str, str]] = {
    "kind of loading": {"tension": "tension"},
    "control": {"constant force": "load", "constant stress": "stress"},
}
"""{what: {text in small letters: what it means}}."""


CREEP_EXTENSION, PLASTIC_EXTENSION, TOTAL_EXTENSION = EXTENSIONS = (
    "percentage creep extension",
    "percentage plastic extension",
    "percentage extension",
)
"""ISO 204: that since the end of loading; with the initial plastic extension; with the whole initial extension."""


_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d+)?(?:[eEdD][+-]?\d+)?", re.ASCII)


_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}\b.*", re.ASCII)


_FILE_NAME = re.compile(r"[\w.\- ]{0,200}\w\.lis\b", re.IGNORECASE)


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
        data = _member(document, "measurementdata")
        if not isinstance(data, dict):
            raise HistoryError(f"{path}: no object 'MeasurementData'; {DOCUMENT.advice}")
        entries = {what: _nested(data, where, path) for what, (where, _) in ENTRIES.items()}
        link = next(filter(None, (_FILE_NAME.search(entries[one].text) for one in ("series", "second series"))), None)
        if link is None:
            return [_history(entries, path)]
        file = path.parent / link[0].strip()
        if not file.is_file():
            raise HistoryError(f"{path}: its series stand in '{file.name}', which is not beside it")
        others, table, extension = _read_series(file)
        named, here = others["name"].text, entries["name"].text
        if named and here and plain_name(named) != plain_name(here):
            raise HistoryError(f"{file}: it is of the test '{named}', and {path} of '{here}'; correct one of them")
        return [_history(entries, path, table, extension)]


def _member(found: Any, name: str) -> Any:
    """A member by its name in small letters: versions of the schema differ in capitals."""
    members = found.items() if isinstance(found, dict) else ()
    return next((value for key, value in members if key.casefold() == name.casefold()), None)


def _nested(data: Mapping[str, Any], where: str, path: Path) -> SourceText:
    """The entry that stands somewhere in a document, a pair of value and unit as one text."""
    found: Any = data
    for name in where.split("/"):
        found = _member(found, name)
    value, unit = (_member(found, "value"), _member(found, "unit")) if isinstance(found, dict) else (found, "")
    place = f"{path}: MeasurementData/{where}"
    if not isinstance(value, (str, int, float, type(None))) or isinstance(value, bool):
        raise HistoryError(f"{place}: it is {type(value).__name__}; write a text or a number")
    return _entry("" if value is None else str(value), str(unit or ""), place)


def _entry(text: str, unit: str, place: str) -> SourceText:
    """An entry; unit : that stands apart from a number."""
    text = " ".join(text.replace("*", "").split())
    if _THOUSANDS.fullmatch(text):
        raise HistoryError(f"{place}: '{quoted(text)}' may be a thousand or a decimal; write a decimal point")
    text = "" if text.casefold() in NOT_STATED else text
    return SourceText(f"{text} {unit.strip()}".strip() if _NUMBER.fullmatch(text) else text, place, ",")


def _stated(entries: Mapping[str, SourceText]) -> Iterator[tuple[str, SourceText]]:
    """Keys and texts of a history file; HistoryError for a test that is none in tension, or ends that contradict."""
    for what, entry in entries.items():
        meant = MEANINGS.get(what, {}).get(entry.text.casefold(), "")
        if what in ("kind of loading", "control") and entry.text and not meant:
            allowed = ", ".join(MEANINGS[what])
            raise HistoryError(f"{entry.location}: '{entry.text}' is not understood; allowed: {allowed}")
        if what == "end" and entry.text:
            said = end_said_by(
                entry.text
            )  # a criterion that says nothing of rupture is that of a test that was stopped
            if said == UNCLEAR:
                found = f"'{quoted(entry.text, 60)}' leaves open whether the test piece broke"
                raise HistoryError(f"{entry.location}: {found}; write 'test piece break', or 'interruption'")
            if said != RUPTURED and entries["rupture"].text:
                what = f"it is '{quoted(entry.text, 60)}', and a rupture time is stated"
                raise HistoryError(f"{entry.location}: {what}; correct one of them")
            yield "ended", replace(entry, text=RUPTURED if said == RUPTURED else STOPPED)
        elif entry.text and what not in ("kind of loading", "end", "series", "second series"):
            yield what, replace(entry, text=meant or entry.text)


def _history(
    entries: Mapping[str, SourceText], path: Path, table: CellTable | None = None, extension: str = CREEP_EXTENSION
) -> History:
    """The history; table : its series, None for a rupture time alone; extension : one of EXTENSIONS, of the series."""
    stated, name, vocabulary = dict(_stated(entries)), entries["name"].text or path.stem, HeaderVocabulary()
    stated["strain_measure"] = SourceText("engineering", str(path))
    if table is None:
        for quantity in ("temperature", "stress"):
            if quantity not in stated:
                raise HistoryError(f"{entries[quantity].location}: it is not stated; a test needs its {quantity}")
        if not {"rupture", "ended"} & stated.keys():
            found = "the test piece broke" if entries["end"].text else "it is not stated"
            what = f"{found}, and there is no creepRuptureTime; state it, or the criterion by which it was stopped"
            raise HistoryError(f"{entries['end'].location}: {what}")
        for key in ("name", "loading_strain", "strain_measure", *(["end_time"] if "rupture" in stated else [])):
            stated.pop(key, None)
        return assemble_without_frames(name, stated, vocabulary, location=str(path), source=str(path))
    # What loading left of the plastic extension is its first value; the total extension is another.
    for key in ("end_time", *(["loading_strain"] if extension == PLASTIC_EXTENSION else [])):
        stated.pop(key, None)
    if extension == CREEP_EXTENSION:
        stated["includes_elastic"] = SourceText("no", str(path))
    stated["includes_loading"] = SourceText("no" if extension == CREEP_EXTENSION else "yes", str(path))
    table = table.keeping([k for k, column in enumerate(table.columns) if not column.startswith("Corrected")])
    return assemble_history(name, stated, table, vocabulary, location=str(path), source=str(path))


def _text(path: Path, first: int | None = None) -> str:
    """The text of a file in UTF-8, else in the code page of Windows, in which the first LIS files were written."""
    content = read_bytes(path, SERIES, first=first)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _read_series(path: Path) -> tuple[dict[str, SourceText], CellTable, str]:
    """Entries of the head of a LIS file, its table, and its extension."""
    cells = [[cell.strip().strip('"') for cell in line.rstrip().split("\t")] for line in _text(path).splitlines()]
    start = next((k for k, row in enumerate(cells) if row[0].casefold() == "[data]"), None)
    if start is None or len(cells) < start + 5:
        raise HistoryError(f"{path}: no line '[data]' with rows of names, symbols and units below it; {SERIES.advice}")
    found = {name: SourceText("", f"{path}: {name}") for _, name in ENTRIES.values() if name}
    for row in cells[:start]:
        name = " ".join(row[0].casefold().split()).removeprefix("(digital) ")
        if len(row) > 3 and name in found:
            entry = _entry(row[3], row[2], f"{path}: {name}")
            if found[name].text and found[name] != entry:
                raise HistoryError(f"{path}: '{name}' stands there twice, with other values; keep one of them")
            found[name] = entry
    names, units, columns = cells[start + 1], cells[start + 3], list[str]()
    for k, name in enumerate(names):
        plain, unit = name.casefold(), unit_suffix(units[k]) if k < len(units) else None
        if plain.startswith("elapsed time from end of loading") and unit in TIME.units:
            columns.append(f"time_{unit}")
        elif plain in EXTENSIONS and unit == "pct":
            columns.append("strain_pct")
        elif name.startswith("Corrected measured temperature") and unit == "C":
            columns.append(name)
        else:
            what = f"column '{name}' in '{units[k] if k < len(units) else ''}' is not understood"
            raise HistoryError(f"{path}:{start + 2}: {what}; correct it or leave it out")
    table = CellTable(path, (), columns=columns, columns_line=start + 2)
    numbered = [TableRow(k, row) for k, row in enumerate(cells[start + 4 :], start + 5) if any(row)]
    rows = [TableRow(row.line, cells_of_width(table, row, len(columns))) for row in numbered]
    extension = next((name.casefold() for name in names if name.casefold() in EXTENSIONS), CREEP_EXTENSION)
    entries = {what: found.get(name, SourceText("", str(path))) for what, (_, name) in ENTRIES.items()}
    return entries, replace(table, rows=rows), extension


CREEP_SCHEMA = CreepSchemaReader()
