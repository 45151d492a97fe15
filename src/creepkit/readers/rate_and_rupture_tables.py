"""Tables of creep tests, one row a test: stress, temperature, minimum creep rate, rupture time or run-out.

    test,stress_MPa,temperature_C,min creep rate (1/h),t_r (h),heat
    A1,120,750,2.1e-6,8200,X7
    A2,100,750,,>10000,X7

Names of columns may be spelled as QUANTITIES and TEXTS list them, with their unit behind `_`, `,` or `/`, or in
brackets. A rupture time `>10000`, or a row that `ended` calls stopped, is a run-out: the test lasted so long, unbroken.
Other columns are labels. What all rows share may stand above them as `# key: value`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, is_number
from creepkit.readers.assembly import assemble_without_frames
from creepkit.readers.cell_grids import CellGrid, table_of, without_ignored
from creepkit.readers.column_names import NameTable, split_written_name, unit_suffix, words_of
from creepkit.readers.cut_files import CutNumber
from creepkit.readers.silent_rows import without_silent_rows
from creepkit.readers.table_rows import TableRow
from creepkit.readers.text_grids import peek_columns, read_text_grid
from creepkit.readers.text_tables import SourceText, TextTable, unknown_text
from creepkit.readers.unbroken_words import UNBROKEN_WORDS
from creepkit.readers.vocabulary import CONDITION_KINDS, HeaderVocabulary, plain_name, split_unit
from creepkit.records import History
from creepkit.records.quantities import RATE, STRESS, TEMPERATURE, TIME, QuantityKind

MEASURED = ("minimum_rate", "rupture")
"""Of which a table of tests has one at least."""


QUANTITIES: Mapping[str, tuple[QuantityKind, tuple[str, ...]]] = {
    "stress": (
        STRESS,
        (
            "stress",
            "sigma",
            "nominal stress",
            "applied stress",
            "initial stress",
            "creep stress",
            "spannung",
            "prüfspannung",
        ),
    ),
    "temperature": (
        TEMPERATURE,
        ("temperature", "temp", "t", "test temperature", "creep temperature", "temperatur", "prüftemperatur"),
    ),
    "minimum_rate": (
        RATE,
        (
            *("minimum rate", "min rate", "minimum creep rate", "min creep rate", "minimum strain rate", "mcr"),
            *("steady state creep rate", "steady state rate", "secondary creep rate", "steady creep rate"),
            *("kriechrate", "minimale kriechrate", "min kriechrate", "kriechgeschwindigkeit"),
            *("minimale kriechgeschwindigkeit", "min kriechgeschwindigkeit", "stationäre kriechgeschwindigkeit"),
            *("stationäre kriechrate", "sekundäre kriechrate", "sekundäre kriechgeschwindigkeit"),
        ),
    ),
    "minimum_rate_sd": (RATE, ("minimum rate sd", "min rate sd", "minimum creep rate sd", "min creep rate sd")),
    "rupture": (
        TIME,
        (
            *("rupture", "rupture time", "time to rupture", "creep rupture time", "rupture life", "creep life"),
            *("t r", "tr", "t rupture", "time to failure", "failure time", "life", "bruchzeit", "standzeit"),
        ),
    ),
    "end_time": (TIME, ("end time", "duration", "test duration", "time", "test time", "time on test", "t")),
}
"""{quantity: its kind, and the names of a column of it in small letters}."""


TEXTS: Mapping[str, tuple[str, ...]] = {
    "name": (
        *("name", "test", "test id", "test name", "test no", "test number", "id", "no", "sample", "sample id"),
        *("specimen id", "specimen no", "specimen name", "probennummer", "versuch", "probe"),
    ),
    "ended": ("ended", "end", "end of test", "outcome", "status", "state", "result"),
    "alloy": ("alloy", "material", "werkstoff"),
    "control": ("control",),
    "specimen": ("specimen",),
    "label heat": ("heat", "cast", "batch", "charge", "schmelze", "heat number", "heat no"),
    "label laboratory": ("laboratory", "lab"),
    "label elongation_pct": ("elongation pct", "elongation", "rupture elongation", "elongation at rupture"),
    "label reduction_of_area_pct": ("reduction of area", "area reduction", "ra", "z", "reduction in area"),
}
"""{key of a history file: the names of a column of it in small letters}."""


ENDED: Mapping[str, str] = {
    **dict.fromkeys(("ruptured", "rupture", "broken", "failed", "failure", "fractured", "r", "f"), "ruptured"),
    **dict.fromkeys(("gebrochen", "bruch"), "ruptured"),
    **dict.fromkeys(UNBROKEN_WORDS, "stopped"),
}
"""{word in small letters: how a test ended}."""


_NAMES = NameTable(
    {quantity: kind for quantity, (kind, _) in QUANTITIES.items()},
    tuple(TEXTS),
    {
        name: key
        for key, names in (*TEXTS.items(), *((q, names) for q, (_, names) in QUANTITIES.items()))
        for name in names
    },
    {},
)


RUN_OUT = re.compile(r">=?|\N{GREATER-THAN OR EQUAL TO}")


@dataclass(frozen=True)
class RowPerTestReader:
    """Reader of tables of minimum creep rates and of rupture times, one row a test."""

    name: str
    title: str
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is such a table: a minimum rate or a rupture time beside a stress, and no strain."""
        suffix = path.suffix.lower()
        if suffix not in (*TEXT_SUFFIXES, *SPREADSHEET_SUFFIXES) or not path.is_file():
            return False
        if suffix in TEXT_SUFFIXES:
            return _is_test_table(peek_columns(path))
        try:
            sheets = [grid.rows[0].cells for grid in _grids(path)]
        except HistoryError:
            return False
        return any(_is_test_table(names) for names in sheets) and not any(_has_frames(names) for names in sheets)

    def read(self, path: Path) -> list[History]:
        """Return one history a row, in the order of the rows; of a spreadsheet those of all its tables of tests."""
        places: dict[str, str] = {}
        histories = []
        for table, cut in _tables(path, self.vocabulary.ignored):
            keys = _keys(table)
            if self.vocabulary.ignored:
                table = without_silent_rows(table, [_quantity(key) for key in keys])
            for row in table.rows:
                history, place = self._history(table, row, keys, cut), table.location(row.line)
                if history.name in places:
                    raise HistoryError(
                        f"{place}: test '{history.name}' already stands in {places[history.name]}; give each row its "
                        "own name"
                    )
                places[history.name] = place
                histories.append(history)
        return histories

    def _history(self, table: TextTable, row: TableRow, keys: Sequence[str], cut: CutNumber | None) -> History:
        """The test of a row. cut : the number in which the file may have been cut."""
        location = table.location(row.line)
        written = table.entries(row).items()
        cells = {keys[table.columns.index(name)]: replace(_with_point(entry), key=name) for name, entry in written}
        entries = {**table.header, **_with_end(cells, location)}
        empty = [_quantity(keys[table.columns.index(name)]) for name in table.empty_columns(row)]
        assumptions = (*table.assumptions, *filter(None, (_assumed_of_empty(one, entries) for one in empty)))
        if cut is not None and cut.line == row.line:
            assumptions += (
                f"{cut.text} in line {cut.line} is whole (the file ends there without a line end and with fewer digits "
                "than the numbers above have)",
            )
        if assumptions and "label assumed" not in entries:
            entries["label assumed"] = SourceText(", ".join(assumptions), location)
        name = f"{table.sheet or table.path.stem} {row.line}"
        where = f"sheet {table.sheet}, " if table.sheet else ""
        source = f"{table.path} ({where}{cells['name'].text if 'name' in cells else f'line {row.line}'})"
        return assemble_without_frames(name, entries, self.vocabulary, location=location, source=source)


def _with_point(entry: SourceText) -> SourceText:
    """A number with a decimal comma as one with a point, as labels are compared."""
    is_comma = entry.decimal == "," and "," in entry.text and is_number(entry.text, Dialect("\t", ","))
    return replace(entry, text=entry.text.replace(",", "."), decimal=".") if is_comma else entry


TEST_TABLE = RowPerTestReader(
    "test-table", "one row a test: stress, temperature, and minimum creep rate or rupture time, with run-outs"
)


TEXT_SUFFIXES, SPREADSHEET_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc"), (".xlsx", ".xlsm")


def _grids(path: Path) -> list[CellGrid]:
    """The cells of a text file, or of the sheets of a spreadsheet."""
    if path.suffix.lower() not in SPREADSHEET_SUFFIXES:
        return [read_text_grid(path)]
    from creepkit.readers.spreadsheets import read_sheets

    return read_sheets(path)


def _tables(path: Path, ignored: Collection[str]) -> list[tuple[TextTable, CutNumber | None]]:
    """The tables of tests in a file, each with the number in which it may have been cut.

    ignored : columns that are left out.
    """
    grids = [grid for grid in _grids(path) if not grid.sheet or _is_test_table(grid.rows[0].cells)]
    return [
        (replace(table_of(without_ignored(grid, 0, ignored)), assumptions=grid.remarks), grid.cut) for grid in grids
    ]


def columns_of_tests(path: Path, ignored: Collection[str]) -> list[tuple[Sequence[str], int]]:
    """Names of columns, and number of rows, of each table of tests in a file."""
    return [(table.columns, len(table.rows)) for table, _ in _tables(path, ignored)]


def _is_test_table(names: Sequence[str]) -> bool:
    keys = [key_of_column(name)[0] for name in names]
    return "stress" in keys and any(name in keys for name in MEASURED) and not _has_frames(names)


def _has_frames(names: Sequence[str]) -> bool:
    """Whether a column is a strain, and no rate of it."""
    words = [set(words_of(name).split()) for name in names]
    return any("strain" in one and "rate" not in one for one in words)


def key_of_column(written: str) -> tuple[str, str]:
    """The quantity, or key, that the name of a column means, and its unit; ("", "") where it means none."""
    name, unit = split_written_name(written)
    unit = unit_suffix(unit) or unit
    if plain_name(name) == "t":
        return "temperature" if unit in TEMPERATURE.units else "end_time", unit
    meant = _NAMES.meaning(name) or ""
    if meant in QUANTITIES:
        return meant, unit
    whole = _NAMES.meaning(written) or ""
    text = whole if whole in TEXTS else meant if unit in ("", "pct") else ""
    return text, ""


def _keys(table: TextTable) -> list[str]:
    """The key of each column in a history file; HistoryError for units and names that are not understood."""
    location, keys = table.location(table.columns_line), list[str]()
    for written in table.columns:
        quantity, unit = key_of_column(written)
        if quantity in QUANTITIES:
            _check_unit(quantity, unit, written, location)
            quantity = f"{quantity}_{unit}"
        elif not quantity:
            _refuse_misspelt(written, location)
            quantity = written if written.startswith(("label ", "geometry ")) else f"label {written}"
        first = next((k for k, key in enumerate(keys) if _quantity(key) == _quantity(quantity)), None)
        if first is not None:
            names = f"'{quoted(table.columns[first], 60)}' and '{quoted(written, 60)}'"
            raise HistoryError(f"{location}: {names} mean the same; keep one of them")
        key_in_header = next((key for key in table.header if _quantity(key) == _quantity(quantity)), None)
        if key_in_header is not None:
            place = table.header[key_in_header].location
            raise HistoryError(
                f"{place}: '{quoted(key_in_header, 60)}' is also a column, '{quoted(written, 60)}'; keep one of them"
            )
        keys.append(quantity)
    return _named_by_specimen(table, keys)


def _named_by_specimen(table: TextTable, keys: list[str]) -> list[str]:
    """The keys, with a column of specimens as the tests' names where it tells all of them apart and nothing else does.

    A column of kinds of specimens, such as uniaxial, has the same word in several rows, or words that are registered.
    """
    if "specimen" not in keys or "name" in keys:
        return keys
    column = keys.index("specimen")
    cells = [table.entries(row).get(table.columns[column]) for row in table.rows]
    texts = [cell.text for cell in cells if cell is not None]
    terms = HeaderVocabulary().terms("")
    if len(set(texts)) < len(cells) or {text.casefold() for text in texts} & set(terms.outputs):
        return keys
    return ["name" if k == column else key for k, key in enumerate(keys)]


def _check_unit(quantity: str, unit: str, written: str, location: str) -> None:
    units = QUANTITIES[quantity][0].units
    if unit not in units:
        found = f"the unit '{quoted(unit)}', which is not understood" if unit else "no unit"
        raise HistoryError(
            f"{location}: column '{quoted(written.strip(), 60)}' has {found}; allowed: {', '.join(units)}, such as "
            f"'{quantity} ({next(iter(units))})'"
        )


def _quantity(key: str) -> str:
    """The quantity of a key, without its unit; other keys as they are."""
    found = split_unit(key, {**CONDITION_KINDS, **_NAMES.kinds})
    return found[0] if found else key_of_column(key)[0] or key


def _refuse_misspelt(written: str, location: str) -> None:
    name = words_of(split_written_name(written)[0])
    known = {one: key for key, (_, names) in QUANTITIES.items() for one in names}
    known |= {one: key for key, names in TEXTS.items() for one in names}
    near = get_close_matches(name, [one for one in known if len(one) > 3], 1, cutoff=0.8)
    if near:
        raise HistoryError(
            f"{location}: column '{quoted(written, 60)}' is not understood; did you mean '{near[0]}'? A label is "
            "written "
            f"'label {quoted(written, 60)}'"
        )


def _with_end(cells: Mapping[str, SourceText], location: str) -> dict[str, SourceText]:
    """The entries of a row, its run-out as the time at which it was stopped."""
    entries = dict(cells)
    stated = entries.pop("ended", None)
    ended = ENDED.get(stated.text.casefold(), "") if stated is not None else ""
    if stated is not None and not ended:
        words = ", ".join(dict.fromkeys((*dict.fromkeys(ENDED.values()), *ENDED)))
        raise HistoryError(f"{location}: the test ended '{stated.text}'; allowed: {words}")
    key = next((key for key in entries if _quantity(key) == "rupture"), None)
    if key is not None:
        time = entries[key]
        word = ENDED.get(time.text.casefold(), "")
        run_out = RUN_OUT.match(time.text)
        if run_out and ended == "ruptured":
            raise HistoryError(f"{location}: '{time.text}' is a time without rupture, and the test ruptured; keep one")
        if word:  # the word stands in the place of the time
            del entries[key]
            ended = ended or word
        elif run_out or ended == "stopped":
            del entries[key]
            text = time.text[run_out.end() :].strip() if run_out else time.text
            taken = next((other for other in entries if _quantity(other) == "end_time"), None)
            if taken is not None and entries[taken].text != text:
                raise HistoryError(
                    f"{location}: it was stopped at '{time.text}' and at '{entries[taken].text}'; keep one"
                )
            if taken is None:
                entries[f"end_time_{key.rpartition('_')[2]}"] = replace(time, text=text)
            ended = "stopped"
    ruptures = any(_quantity(key) == "rupture" for key in entries)
    if ended == "ruptured" and not ruptures:
        # A column of durations says when it broke.
        duration = next((other for other in entries if _quantity(other) == "end_time"), None)
        if duration is not None:
            entries[f"rupture_{duration.rpartition('_')[2]}"] = entries.pop(duration)
        elif any(_quantity(other) == "minimum_rate" for other in entries):
            entries["label ended"] = SourceText("ruptured", location)
        else:
            entries["ended"] = SourceText("ruptured", location)
    elif ruptures:
        _check_duration(entries)
        entries = {key: entry for key, entry in entries.items() if _quantity(key) != "end_time"}
        if ended == "ruptured":  # stated, whatever a remark says
            entries["ended"] = SourceText("ruptured", location)
    if ended == "stopped":
        entries["ended"] = SourceText("stopped", location)
    return entries


def _assumed_of_empty(quantity: str, entries: Mapping[str, SourceText]) -> str:
    """What an empty cell leaves unknown; "" where the rest of the row says it, or where it would be a label."""
    known = {_quantity(key) for key in entries}
    if quantity == "ended" and "rupture" in known:
        return "ended ruptured (empty cell)"
    is_stopped = "ended" in entries and entries["ended"].text == "stopped"
    said = {"rupture": is_stopped, "end_time": "rupture" in known}.get(quantity, False)
    if quantity in known or said or quantity == "name" or quantity.startswith("label "):
        return ""
    return unknown_text(quantity)


_ROUNDING = 0.01
"""Part of a rupture time by which the duration of the same test may differ."""


def _check_duration(entries: Mapping[str, SourceText]) -> None:
    """Refuse a duration of a test that is not its rupture time."""
    times = {
        quantity: (key, TIME.convert(entry.number(entry.key or key), _unit_of(key), entry.location, entry.key or key))
        for key, entry in entries.items()
        if (quantity := _quantity(key)) in ("rupture", "end_time")
    }
    if "end_time" not in times:
        return
    (rupture, broken), (end, ended) = times["rupture"], times["end_time"]
    if abs(ended - broken) > _ROUNDING * broken:
        one, other = entries[rupture], entries[end]
        raise HistoryError(
            f"{one.location}: '{one.key or rupture}' is {quoted(one.text)}, and '{other.key or end}' is "
            f"{quoted(other.text)}; "
            "a test that ruptured lasted until then; correct one of them"
        )


def _unit_of(key: str) -> str:
    return key.rpartition("_")[2]
