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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.errors import HistoryError, nearest, quoted
from creepkit.files.json_documents import read_json
from creepkit.files.reading import FileKind, read_bytes
from creepkit.readers.assembly import assemble_history
from creepkit.readers.column_names import unit_suffix
from creepkit.readers.table import CellTable, SourceText, TableRow
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records import History, constant_stress
from creepkit.records.quantities import STRAIN, STRESS, TEMPERATURE, TIME, QuantityKind

DOCUMENT = FileKind("a creep test after the NFDI-MatWerk schema", HistoryError, "name its JSON document or LIS file")


SERIES = FileKind("a LIS file of a creep test", HistoryError, "save it as text", maximum_bytes=200_000_000)


NOT_STATED = ("", "not applicable", "n/a", "todo", "unknown")
"""Texts, in small letters, that stand for a value that is not there."""


TEST = "AdditionalMetadata/TestInfo/testParameters"


AFTER_END, DURING_TEST = "PrimaryData/TestResult/valuesRecordedAfterTestEnd", "TestResult/valuesRecordedDuringTestRun"


@dataclass(frozen=True)
class SchemaKey:
    """Where an entry stands: below MeasurementData in the document, by its name in a LIS file; kind : of a number."""

    path: str
    entry: str
    kind: QuantityKind | None = None


NAME = SchemaKey("AdditionalMetadata/TestInfo/testJobDetails/testID", "test id")
ALLOY = SchemaKey("AdditionalMetadata/MaterialHistoryAndCondition/materialIdentifier", "material identifier")
KIND_OF_LOADING = SchemaKey(f"{TEST}/typeOfLoading", "type of loading")
CONTROL = SchemaKey(f"{TEST}/loadControlType", "load control type")
END_CRITERION = SchemaKey(f"{TEST}/endOfTestCriterium/endOfTestCriteriumOptions", "end of test criterium")
NUMBERS: Mapping[str, SchemaKey] = {
    "temperature": SchemaKey(f"{TEST}/specifiedTemperature", "specified temperature", TEMPERATURE),
    "stress": SchemaKey(f"{TEST}/initialStress", "initial stress", STRESS),
    "rupture": SchemaKey(f"{AFTER_END}/creepRuptureTime", "creep rupture time", TIME),
    "duration": SchemaKey(f"PrimaryData/{DURING_TEST}/testDuration", "test duration", TIME),
    "loading_strain": SchemaKey(
        "SecondaryData/TestResult/extensionValues/percentageInitialTotalExtension",
        "percentage initial total extension",
        STRAIN,
    ),
}
"""{quantity: where it stands}."""


ENTRIES = frozenset(key.entry for key in (NAME, ALLOY, KIND_OF_LOADING, CONTROL, END_CRITERION, *NUMBERS.values()))


_DIGITAL = "(digital) "
"""What stands before the name of an entry in some versions of LIS files."""


BROKEN = ("test piece break", "break", "rupture", "fracture")
"""Criteria of the end of a test, in small letters, that say that it broke."""


SERIES_LINKS = (
    f"PrimaryData/{DURING_TEST}/elapsedTimeFromEndOfLoading",
    f"SecondaryData/{DURING_TEST}/percentageExtension",
)


CREEP_EXTENSION, PLASTIC_EXTENSION, TOTAL_EXTENSION = EXTENSIONS = (
    "percentage creep extension",
    "percentage plastic extension",
    "percentage extension",
)
"""ISO 204: that since the end of loading; with the initial plastic extension; with the whole initial extension."""


_NUMBER_AND_UNIT = re.compile(r"([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*(\D*)", re.ASCII)


_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)


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
            head, table, extension = _read_series(path)
            return [_history(_Entries(str(path), head), path, table, extension)]
        document = read_json(path, DOCUMENT)
        data = _member(document, "measurementdata") if isinstance(document, dict) else None
        if not isinstance(data, dict):
            raise HistoryError(f"{path}: no object 'MeasurementData'; {DOCUMENT.advice}")
        entries = _Entries(str(path), data)
        series = _series_of(entries, path)
        if series is None:
            return [_without_frames(entries, path)]
        head, table, extension = _read_series(series)
        named, here = _Entries(str(series), head).text(NAME), entries.text(NAME)
        if named and here and _plain(named) != _plain(here):
            raise HistoryError(f"{series}: it is of the test '{named}', and {path} of '{here}'; correct one of them")
        return [_history(entries, path, table, extension)]


@dataclass(frozen=True)
class _Entries:
    """What is stated of a test. data : nested objects of a document, or {entry: (text, unit)} of a LIS file."""

    source: str
    data: Mapping[str, Any]

    def location(self, key: SchemaKey) -> str:
        place = key.entry if self._is_flat else f"MeasurementData/{key.path}"
        return f"{self.source}: {place}"

    @property
    def _is_flat(self) -> bool:
        return all(isinstance(value, tuple) for value in self.data.values())

    def text(self, key: SchemaKey) -> str:
        """The text of an entry without a unit, "" where it is not stated."""
        return self._value_and_unit(key)[0]

    def number(self, key: SchemaKey) -> tuple[str, str] | None:
        """Number as text, with a decimal point, and creepkit's unit; None where it is not stated."""
        text, unit = self._value_and_unit(key)
        if not text:
            return None
        match = _NUMBER_AND_UNIT.fullmatch(text)
        if match is None:
            raise HistoryError(
                f"{self.location(key)}: '{text}' is no number; write one such as 980, and its unit apart"
            )
        number, own_unit = match.groups()
        if _THOUSANDS.fullmatch(number):
            raise HistoryError(
                f"{self.location(key)}: '{number}' may be a thousand or a decimal; write a decimal point"
            )
        written = own_unit.strip() or unit
        units = key.kind.units if key.kind else {}
        suffix = unit_suffix(written)
        if suffix is None or suffix not in units:
            raise HistoryError(
                f"{self.location(key)}: the unit '{written}' is not understood; {nearest(written, units)}"
            )
        return number.replace(",", "."), suffix

    def choice(self, key: SchemaKey, meanings: Mapping[str, str]) -> str:
        """What one of the allowed texts means; "" where it is not stated."""
        text = self.text(key)
        if text and text.casefold() not in meanings:
            raise HistoryError(f"{self.location(key)}: '{text}' is not understood; allowed: {', '.join(meanings)}")
        return meanings[text.casefold()] if text else ""

    def _value_and_unit(self, key: SchemaKey) -> tuple[str, str]:
        value: Any
        if self._is_flat:
            value, unit = self.data.get(key.entry, ("", ""))
        else:
            value, unit = self._nested(key)
        if not isinstance(value, (str, int, float)) or isinstance(value, bool) or not isinstance(unit, str):
            raise HistoryError(f"{self.location(key)}: it is {type(value).__name__}; write a text or a number")
        text = value if isinstance(value, str) else repr(value)
        text = " ".join(text.replace("*", "").split())
        return ("" if text.casefold() in NOT_STATED else text), unit.strip()

    def _nested(self, key: SchemaKey) -> tuple[Any, Any]:
        found: Any = self.data
        for name in key.path.split("/"):
            found = _member(found, name.casefold()) if isinstance(found, dict) else None
        if isinstance(found, dict):
            return _member(found, "value") or "", _member(found, "unit") or ""
        return ("" if found is None else found), ""


def _member(found: Mapping[str, Any], name: str) -> Any:
    """A member by its name in small letters: versions of the schema differ in capitals."""
    return next((value for key, value in found.items() if key.casefold() == name), None)


def _plain(name: str) -> str:
    return re.sub(r"[\s_\-]+", "_", name.casefold())


def _series_of(entries: _Entries, path: Path) -> Path | None:
    """The LIS file that a document names, beside it; None where it names none."""
    for link in SERIES_LINKS:
        text = entries.text(SchemaKey(link, ""))
        name = _FILE_NAME.search(text)
        if name is None:
            continue
        series = path.parent / name[0].strip()
        if not series.is_file():
            raise HistoryError(f"{entries.source}: its series stand in '{series.name}', which is not beside it")
        return series
    return None


def _broke(entries: _Entries) -> bool | None:
    """Whether the test broke, None where nothing says so."""
    criterion, place = entries.text(END_CRITERION).casefold(), entries.location(END_CRITERION)
    if entries.number(NUMBERS["rupture"]) is None:
        return criterion in BROKEN if criterion else None
    if criterion and criterion not in BROKEN:
        raise HistoryError(
            f"{place}: it is '{quoted(criterion, 60)}', and a rupture time is stated; correct one of them"
        )
    return True


def _control(entries: _Entries) -> str:
    """What was held constant, "" where it is not stated; HistoryError for a test that is none in tension."""
    entries.choice(KIND_OF_LOADING, {"tension": "tension"})
    return entries.choice(CONTROL, {"constant force": "load", "constant stress": "stress"})


def _history(entries: _Entries, path: Path, table: CellTable, extension: str) -> History:
    """The history; `extension` : one of EXTENSIONS, that of the series."""
    stated: dict[str, SourceText] = {}

    def state(key: str, text: str, where: SchemaKey) -> None:
        stated[key] = SourceText(text, entries.location(where))

    for quantity, where in NUMBERS.items():
        number = entries.number(where)
        if number is not None and quantity != "duration":
            state(f"{quantity}_{number[1]}", number[0], where)
    if _broke(entries) is False:
        state("ended", "stopped", END_CRITERION)
    control = _control(entries)
    for key, text, where in (("control", control, CONTROL), ("alloy", entries.text(ALLOY), ALLOY)):
        if text:
            state(key, text, where)
    origin = NUMBERS["loading_strain"]
    if extension == PLASTIC_EXTENSION:  # what loading left of it is its first value; the total extension is another
        stated = {key: entry for key, entry in stated.items() if not key.startswith("loading_strain")}
    state("strain_measure", "engineering", origin)
    if extension == CREEP_EXTENSION:
        state("includes_elastic", "no", origin)
    state("includes_loading", "no" if extension == CREEP_EXTENSION else "yes", origin)
    temperatures = tuple(name for name in table.columns if name.startswith("Corrected"))
    vocabulary = HeaderVocabulary(averaged_columns={"measured_temperature_C": temperatures} if temperatures else {})
    name = entries.text(NAME) or path.stem
    return assemble_history(name, stated, table, vocabulary, location=entries.source, source=str(path))


def _without_frames(entries: _Entries, path: Path) -> History:
    """A rupture time, or how long a test lasted that was stopped."""
    values = {}
    for quantity in ("temperature", "stress", "rupture", "duration"):
        where = NUMBERS[quantity]
        number, place = entries.number(where), entries.location(where)
        if number is not None and where.kind is not None:
            values[quantity] = where.kind.convert(float(number[0]), number[1], place, quantity)
            if not values[quantity] > 0:
                raise HistoryError(f"{place}: it is {number[0]} {number[1]}; it must be above zero")
        elif quantity in ("temperature", "stress"):
            raise HistoryError(f"{place}: it is not stated; a test needs its {quantity}")
    end, broke = values.get("rupture", values.get("duration")), _broke(entries)
    if end is None:
        raise HistoryError(
            f"{path}: it names no series, no creepRuptureTime and no testDuration; a test needs one of them"
        )
    if "rupture" not in values and broke is not False:
        found = "the test piece broke" if broke else "it is not stated"
        raise HistoryError(
            f"{entries.location(END_CRITERION)}: {found}, and there is no creepRuptureTime; state it, or the criterion "
            "by which the test was stopped"
        )
    control = _control(entries)
    return History(
        name=entries.text(NAME) or path.stem,
        times=np.array([end]),
        outputs={},
        loading=constant_stress(values["stress"], control="stress" if control == "stress" else "load"),
        temperature=values["temperature"],
        strain_measure="engineering",
        alloy=entries.text(ALLOY),
        source=str(path),
        rupture_time=values.get("rupture"),
        unruptured="rupture" not in values,
        labels={} if control else {"assumed": "control load"},
    )


def _text(path: Path, first: int | None = None) -> str:
    """The text of a file in UTF-8, else in the code page of Windows, in which the first LIS files were written."""
    content = read_bytes(path, SERIES, first=first)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _read_series(path: Path) -> tuple[dict[str, tuple[str, str]], CellTable, str]:
    """Entries of the head of a LIS file, {name in small letters: (value, unit)}, its table, its extension."""
    lines = _text(path).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    start = next((k for k, line in enumerate(lines) if line.strip().casefold() == "[data]"), None)
    if start is None or len(lines) < start + 4:
        raise HistoryError(f"{path}: no line '[data]' with rows of names, symbols and units below it; {SERIES.advice}")
    head: dict[str, tuple[str, str]] = {}
    for number, line in enumerate(lines[:start], 1):
        cells = [cell.strip().strip('"') for cell in line.split("\t")]
        if len(cells) < 4 or not cells[0]:
            continue
        name, entry = " ".join(cells[0].casefold().split()).removeprefix(_DIGITAL), (cells[3], cells[2])
        if name in ENTRIES and head.get(name, entry) != entry:
            raise HistoryError(f"{path}:{number}: '{name}' stands there twice, with other values; keep one of them")
        head.setdefault(name, entry)
    columns, width = _columns(path, start, lines)
    rows = []
    for number, line in enumerate(lines[start + 4 :], start + 5):
        if not line.strip():
            continue
        cells = [cell.strip() for cell in line.rstrip().split("\t")]
        if len(cells) != width:
            raise HistoryError(f"{path}:{number}: number of cells {len(cells)}, of columns {width}; write one a column")
        rows.append(TableRow(number, cells))
    if not rows:
        raise HistoryError(f"{path}:{start + 4}: no rows below the units; a test needs at least two")
    names = [cell.strip().casefold() for cell in lines[start + 1].split("\t")]
    extension = next((name for name in names if name in EXTENSIONS), CREEP_EXTENSION)
    return head, CellTable(path, tuple(rows), columns=columns, columns_line=start + 2), extension


def _columns(path: Path, start: int, lines: Sequence[str]) -> tuple[tuple[str, ...], int]:
    """Names of the columns in creepkit's words, and how many there are."""
    names = [cell.strip() for cell in lines[start + 1].rstrip().split("\t")]
    units = [cell.strip() for cell in lines[start + 3].rstrip().split("\t")]
    if len(units) != len(names):
        raise HistoryError(f"{path}:{start + 4}: {len(units)} units for {len(names)} columns; write one for each")
    columns = []
    for name, written in zip(names, units, strict=True):
        plain, unit = name.casefold(), unit_suffix(written) or written
        if plain.startswith("elapsed time from end of loading") and unit in TIME.units:
            columns.append(f"time_{unit}")
        elif plain in EXTENSIONS and unit == "pct":
            columns.append("strain_pct")
        elif name.startswith("Corrected measured temperature") and unit == "C":
            columns.append(name)
        else:
            raise HistoryError(
                f"{path}:{start + 2}: column '{name}' in '{written}' is not understood; correct it or leave it out"
            )
    return tuple(columns), len(names)


CREEP_SCHEMA = CreepSchemaReader()
