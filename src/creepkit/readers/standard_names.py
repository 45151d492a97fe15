"""What a file states in creepkit's names and with units: `Stress: 120 MPa` as stress_MPa, a strain as what it is.

A strain without a unit may be a fraction or in per cent. It is decided by, in this order: the key `strain_unit` (1, %);
its values: above 1, up to 100, they are per cent, for few creep tests are stretched to twice their length; below 0.001
they are fractions, for no extensometer resolves 0.001 %. Else it is asked for. What was decided by values is recorded
in the label "assumed".

Columns of time may hold no numbers: elapsed times `1:02:30`, and time stamps, as seconds.

An elapsed time counts from the beginning of the test. Of time stamps and times of day the first row is time zero, which
is recorded in the label "assumed". `18:51:22` may be either: the name of the column decides, `Elapsed time (h:mm:ss)`
or `Time of day`, or the values: elapsed are times that begin below one hour or pass 24 hours.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, is_number, without_uncertainty
from creepkit.files.time_stamps import (
    DATE_ORDERS,
    DAY,
    ClockColumn,
    check_increasing,
    is_clock_time,
    resolve,
    through_midnight,
)
from creepkit.readers.conditions import is_control
from creepkit.readers.names import STATED_BY_NAME
from creepkit.readers.questions import Question
from creepkit.readers.table import CellTable, SourceText, TableRow, cells_of
from creepkit.readers.vocabulary import (
    HeaderVocabulary,
    Terms,
    plain_name,
    split_unit,
    split_written_name,
    unit_suffix,
    words_of,
)

SURELY_PER_CENT, SURELY_FRACTION = 1.0, 1e-3
"""Largest strain above which, and below which, a strain without unit is decided by its values."""


LARGEST_PER_CENT = 100.0
"""Largest strain without unit that may be in per cent; above, it may be microstrain."""


STRAIN_UNITS: Mapping[str, str] = {"1": "1", "pct": "pct", "microstrain": "microstrain"}
"""Units that the key `strain_unit` may name, as a suffix or in any other spelling of it."""


_VALUE_WITH_UNIT = re.compile(r"([+-]?[\d.,]+(?:[eEdD][+-]?\d+)?)\s*([^\d\s.,;:+-][^;:]{0,10})", re.ASCII)
_NOTED = re.compile(r"(.*[^\s(])\s*\(([^()]*[^\W\d_]{3}[^()]*)\)")


def in_standard_names(
    entries: Mapping[str, SourceText], table: CellTable, vocabulary: HeaderVocabulary
) -> tuple[dict[str, SourceText], CellTable]:
    """Entries and columns of one test under creepkit's names, with units, and a strain whose unit is decided."""
    known = vocabulary.terms(specimen_named(entries, vocabulary))
    told = {key for key, entry in entries.items() if _tells(known.condition(key), entry.text)}
    entries = {f"label {key}" if key in told else key: entry for key, entry in entries.items()}
    stated = in_standard_keys(entries, known)
    table = _with_creep_strain_alone(table, known)
    by_titles = [one for key, title in entries.items() for one in _stated_by_title(key, title) if one[0] not in stated]
    table = table.assuming(*(f"{key} {entry.text} by the title in {entry.location}" for key, entry in by_titles))
    for key, entry in [*_stated_by_columns(table), *by_titles]:
        if key not in vocabulary.stated and stated.setdefault(key, entry).text != entry.text:
            what = f"{key} is '{stated[key].text}', but {entry.location} says {entry.text}; which holds?"
            choices = (stated[key].text, entry.text)
            raise Question(table.path, stated[key].location, what, key, choices, is_free=False)
    columns = [known.column(name) for name in table.columns]
    table = replace(table, columns=columns, written=table.columns) if columns != list(table.columns) else table
    table = with_elapsed_times(stated, table, known)
    table = _with_decided_temperature(stated, table, known)
    return _with_decided_strains(stated, _without_per_cent_signs(table, known), known)


_OF_CREEP = re.compile(r"\b(?:creep|kriech\w*|fluage|kruip\w*)\b|\b[eε](?:ps)? cr?\b")


def _with_creep_strain_alone(table: CellTable, known: Terms) -> CellTable:
    """The table without total, elastic and plastic strains beside the one creep strain."""
    strains = [k for k, name in enumerate(table.columns) if known.quantity(name) == "strain"]
    creep = [k for k in strains if _OF_CREEP.search(words_of(split_written_name(table.columns[k])[0]))]
    others = [k for k in strains if k not in creep]
    if len(creep) != 1 or not others or {table.columns[k] for k in strains} & known.vocabulary.synonyms.keys():
        return table
    listed = " and ".join(f"'{table.columns[k]}'" for k in others)
    table = table.assuming(f"'{table.columns[creep[0]]}' counts and not {listed}")
    return table.keeping([k for k in range(len(table.columns)) if k not in others])


def _with_decided_temperature(stated: Mapping[str, SourceText], table: CellTable, known: Terms) -> CellTable:
    """The table with a column of temperatures without a unit in that of the one stated temperature that is like it."""
    if "temperature" not in table.columns:
        return table
    written, middle = table.as_written(table.column("temperature")), float(np.median(table.numbers("temperature")))
    texts = [f"{one.text} {key[12:]}" for key, one in stated.items() if key.startswith("temperature_")]
    for text in (*texts, *(one.text for one in table.sources if one.key == "temperature")):
        number, _, unit = text.partition(" ")
        if (suffix := unit_suffix(unit)) and is_number(number, Dialect()) and abs(float(number) - middle) < 5.0:
            columns = [f"temperature_{suffix}" if name == "temperature" else name for name in table.columns]
            return table.renamed(columns).assuming(f"'{written}' in {suffix} as stated")
    return table


def specimen_named(entries: Mapping[str, SourceText], vocabulary: HeaderVocabulary) -> str:
    """The specimen that a file names, "" where it names none."""
    synonyms = vocabulary.synonyms
    named = (e.text.casefold() for key, e in entries.items() if plain_name(synonyms.get(key, key)) == "specimen")
    return next(named, "")


def in_standard_keys(entries: Mapping[str, SourceText], known: Terms) -> dict[str, SourceText]:
    """Entries under creepkit's names of their keys, with the units that stand in their texts."""
    stated, moduli = dict[str, SourceText](), list[SourceText]()
    for key, entry in entries.items():
        name = known.condition(key)
        if name.startswith("modulus_at "):
            at, _, unit = name.removeprefix("modulus_at ").partition("|")
            moduli.append(replace(entry, text=f"{at} = {entry.text} {unit}".strip(), key=entry.key or key))
            continue
        found = split_unit(known.vocabulary.synonyms.get(key, name), known.conditions.kinds)
        value, note = _without_note(without_uncertainty(entry.text)) if found else (entry.text, "")
        if found and (match := _VALUE_WITH_UNIT.fullmatch(value)):
            suffix = unit_suffix(match[2])
            if suffix in known.conditions.kinds[found[0]].units and found[1] in ("", suffix):
                if note:
                    control = found[0] == "stress" and is_control(note)
                    stated.setdefault("control" if control else f"label {key} (note)", replace(entry, text=note))
                name, entry = f"{found[0]}_{suffix}", replace(entry, text=match[1])
        if name == "strain_measure":
            said = [STATED_BY_NAME.get(f"{words_of(entry.text)}{rest}", ("", "")) for rest in ("", " strain")]
            entry = replace(entry, text=next((text for key, text in said if key == name), entry.text))
        if name in stated and stated[name].says_the_same(entry):
            continue
        if name in stated:
            raise HistoryError(f"{entry.location}: '{key}' is given twice (perhaps in two units); keep one of them")
        stated[name] = entry if name == key else replace(entry, key=entry.key or key)
    if moduli:
        stated["modulus_by_temperature"] = replace(moduli[0], text="; ".join(one.text for one in moduli))
    return stated


def _without_note(text: str) -> tuple[str, str]:
    """A value, and what stands in brackets behind its unit, `180 MPa (constant load)`; "" where nothing does."""
    match = _NOTED.fullmatch(text)
    return (match[1], match[2]) if match else (text, "")


def _stated_by_columns(table: CellTable) -> list[tuple[str, SourceText]]:
    """Conditions that names of columns state, as `True strain (%)` does."""
    place = table.location(table.columns_line)
    names = [(column, words_of(split_written_name(column)[0])) for column in table.columns]
    return [
        (STATED_BY_NAME[words][0], SourceText(STATED_BY_NAME[words][1], f"{place}, column '{column}'"))
        for column, words in names
        if words in STATED_BY_NAME
    ]


def _stated_by_title(key: str, title: SourceText) -> list[tuple[str, SourceText]]:
    """Conditions that a title states, as `Specimen 7C, TOTAL STRAIN` does; a creep strain rate is none."""
    words = words_of(title.text) if key.startswith("label line ") or _tells(key[6:].casefold(), title.text) else ""
    found = (re.search(rf"\b{name}\b(?! (?:rate|test|curve|range|vs)\b)", words) and one for name, one in _IN_TITLES)
    return [(one[0], replace(title, text=one[1])) for one in found if one]


def _tells(quantity: str, text: str) -> bool:
    """Whether a text says of a stress or strain what it is, and not how large."""
    return quantity in ("stress", "strain") and not re.search(r"\d", text) and bool(text)


_IN_TITLES = [one for one in STATED_BY_NAME.items() if " " in one[0] or "dehnung" in one[0]]


def _without_per_cent_signs(table: CellTable, known: Terms) -> CellTable:
    """The table without the signs in cells such as `1.2 %`, whose columns are in per cent, as their names must say."""
    kinds, cells = known.columns.kinds, table.rows[0].cells if table.rows else ()
    found = [split_unit(name, kinds) for name in table.columns]
    signed = [k for k, one in enumerate(found) if one and cells[k].endswith("%") and "pct" in kinds[one[0]].units]
    if not signed:
        return table
    columns = list(table.columns)
    for k in signed:
        name, suffix = split_unit(columns[k], known.columns.kinds) or (columns[k], "")
        if suffix not in ("", "pct", "percent"):
            place = table.location(table.columns_line, k)
            raise HistoryError(f"{place}: '{columns[k]}' is not in per cent, but its cells are; correct one of them")
        columns[k] = f"{name}_pct"
    for row in table.rows:
        if odd := [k for k in signed if not row.cells[k].endswith("%")]:
            what = f"'{columns[odd[0]]}' is '{quoted(row.cells[odd[0]])}' without the sign % of others"
            raise HistoryError(f"{table.location(row.line, odd[0])}: {what}")
    rows = [TableRow(r.line, [c.rstrip("% ") if k in signed else c for k, c in enumerate(r.cells)]) for r in table.rows]
    return replace(table, columns=columns, rows=rows, written=table.written or table.columns)


def _with_decided_strains(
    stated: dict[str, SourceText], table: CellTable, known: Terms
) -> tuple[dict[str, SourceText], CellTable]:
    """The columns and entries that have no unit, though it matters, under names with one."""
    unit, names, assumptions = stated.pop("strain_unit", None), dict[str, str](), list[str]()
    suffix = unit_suffix(unit.text) if unit else None
    if unit and suffix not in STRAIN_UNITS:
        raise HistoryError(f"{unit.location}: strain_unit is '{unit.text}'; allowed: 1, %, microstrain")
    if not any(known.quantity(column) == "time" for column in table.columns):
        return stated, table  # no frames at all, which is told first
    undecided = {name for name in (*table.columns, *stated) if _is_undecided(name, known)}
    for name in sorted(undecided.intersection(table.columns)):
        if not name.endswith("_sd"):
            decided, assumption = (suffix, "") if suffix else _decided_by_table(name, table)
            names[name] = f"{name}_{decided}"
            assumptions += [assumption] if assumption else []
    for name in sorted(name for name in undecided if name.endswith("_sd")):
        decided = suffix or names.get(name.removesuffix("_sd"), "").rpartition("_")[2]
        if not decided:
            place = stated[name].location if name in stated else table.location(table.columns_line)
            raise HistoryError(f"{place}: '{name}' has no unit; allowed: {name}_1, {name}_pct, {name}_microstrain")
        names[name] = f"{name}_{decided}"
    columns = [names.get(name, name) for name in table.columns]
    table = table.renamed(columns).assuming(*assumptions) if names else table
    return {names.get(key, key): entry for key, entry in stated.items()}, table


def _is_undecided(name: str, known: Terms) -> bool:
    found = None if name in known.vocabulary.synonyms else split_unit(name, known.column_kinds)
    return found == (name, "") and known.column_kinds[name].is_ambiguous_without_unit


def _decided_by_table(name: str, table: CellTable) -> tuple[str, str]:
    """The unit of a column that states none, and how it was decided; HistoryError where it cannot be."""
    largest = float(np.abs(table.numbers(name)).max())
    if SURELY_PER_CENT < largest <= LARGEST_PER_CENT:
        return "pct", f"{name} in per cent (up to {largest:g})"
    if largest < SURELY_FRACTION:
        return "1", f"{name} a fraction (up to {largest:g})"
    is_large = largest > LARGEST_PER_CENT
    other = "microstrain" if is_large else "1"
    why = "are no fractions and hardly per cent" if is_large else "may be fractions or per cent"
    what = f"'{name}' has no unit, and values up to {largest:g} {why}; name it {name}_{other} or {name}_pct, or write"
    choices = (other, "%") if is_large else ("%", other)
    raise table.question(f"{what} '# strain_unit: {other}' or '# strain_unit: %' above", "strain_unit", *choices)


# ---- times of a clock ------------------------------------------------------------------------------------------------


_ELAPSED = re.compile(r"(\d{1,6}):([0-5]\d)(?::([0-5]\d(?:[.,]\d{1,9})?))?", re.ASCII)


_ELAPSED_WORD = re.compile(r"elapsed|test time|creep time|laufzeit", re.IGNORECASE)
_ELAPSED_NAME = re.compile(rf"{_ELAPSED_WORD.pattern}|h:mm|\[h|hh:mm|h:m", re.IGNORECASE)


OF_DAY, ELAPSED = ("time of day", "clock", "clock time", "uhrzeit"), "elapsed time"
"""Names of times of the day; and of a time that is none, as an answer says it."""


def with_elapsed_times(stated: dict[str, SourceText], table: CellTable, known: Terms) -> CellTable:
    """The table with its times as numbers; takes `date_order` and `time_zone` from what is stated."""
    order, zone = stated.pop("date_order", None), stated.pop("time_zone", None)
    if order is not None and order.text not in DATE_ORDERS:
        raise HistoryError(f"{order.location}: date_order is '{quoted(order.text)}'; allowed: {', '.join(DATE_ORDERS)}")
    times = [k for k, name in enumerate(table.columns) if known.quantity(name) == "time"]
    if len(times) != 1 or not is_clock_time(table.rows[0].cells[times[0]]):
        if order is not None or zone is not None:
            key, entry = ("date_order", order) if order is not None else ("time_zone", zone)
            assert entry is not None
            raise HistoryError(f"{entry.location}: {key} says nothing here, for no times are dates; leave it out")
        return table
    clock, kinds, columns = times[0], known.columns.kinds, list(table.columns)
    cells, written = list(cells_of(table.rows, clock)), table.as_written(clock)
    suffix = (split_unit(columns[clock], kinds) or ("", ""))[1]
    if suffix and suffix in kinds["time"].units:
        what = f"'{written}' is in {suffix}, and its first cell is '{quoted(cells[0])}', a time of a clock"
        place = table.location(table.columns_line, clock)
        raise HistoryError(f"{place}: {what}; leave the unit out of the name, or write numbers")
    pattern = _PATTERN.search(written)
    units = [_SECONDS[one[0]] for one in pattern[0].lower().split(":")] if pattern else []
    if units and units != _H_MM_SS and words_of(split_written_name(written)[0]) not in OF_DAY:
        seconds, assumption = _seconds_of(table, clock, units), ""
    elif _ELAPSED.fullmatch(cells[0]):
        seconds, assumption = _times_of(table, clock, known.vocabulary.synonyms)
    else:
        table, seconds, assumption = _of_stamps(table, clock, order.text if order else "", zone.text if zone else "")
    texts = [repr(float(time)).replace(".", table.dialect.decimal) for time in seconds]
    return table.renamed(columns).with_cells(clock, "time_s", texts).assuming(*filter(None, (assumption,)))


_PATTERN = re.compile(r"(?<![a-z])(?:d+|h+|mm?|min):(?:hh?|mm?|min|ss?)(?::(?:mm?|min|ss?))?(?![a-z])", re.IGNORECASE)
_SECONDS = {"d": DAY, "h": 3600.0, "m": 60.0, "s": 1.0}
_H_MM_SS = [3600.0, 60.0, 1.0]
"""Of what the name of a column says that its cells show, as `hh:mm`, `mm:ss` and `dd:hh:mm`; and by default."""


def _seconds_of(table: CellTable, clock: int, units: Sequence[float]) -> Floats:
    """(rows,) s of cells such as 4:04:00; units : s, of each of their parts, all less than one before."""
    seconds, most = list[float](), [np.inf, *(a / b for a, b in pairwise(units))]
    for row in table.rows:
        parts = [part.replace(",", ".") for part in row.cells[clock].split(":")]
        numbers = [float(part) for part in parts if is_number(part, Dialect())]
        if len(numbers) != len(units) or any(one >= limit for one, limit in zip(numbers, most, strict=True)):
            what = f"'{table.as_written(clock)}' is '{quoted(row.cells[clock])}'"
            form = "h:mm:ss as above" if units == _H_MM_SS[: len(units)] else "all cells as its name says"
            raise HistoryError(f"{table.location(row.line, clock)}: {what}; write {form}")
        seconds.append(sum(unit * number for unit, number in zip(units, numbers, strict=True)))
    return np.array(seconds)


def _times_of(table: CellTable, clock: int, synonyms: Mapping[str, str]) -> tuple[Floats, str]:
    """(rows,) s of times h:mm:ss, elapsed or of the day, and what was assumed of them."""
    name, count = table.as_written(clock), table.rows[0].cells[clock].count(":") + 1
    times, form = _seconds_of(table, clock, _H_MM_SS[:count]), "h:mm:ss"[: 3 * count - 2]
    meant = synonyms.get(name, name)
    if words_of(meant) in OF_DAY:
        times = through_midnight(times)[0]
        check_increasing(times, _place_of_rows(table), table.lines, _AT_MIDNIGHT)
        return times - times[0], f"time since the first row at {table.rows[0].cells[clock]}"
    if _ELAPSED_NAME.search(meant):
        return times, f"times such as {table.rows[-1].cells[clock]} in {form}" * (count == 2)
    if count > 2 and (times[0] < 3600.0 or times.max() >= DAY):
        return times, f"times such as {table.rows[-1].cells[clock]} elapsed"
    what = f"'{name}' begins at {table.rows[0].cells[clock]}, which may be elapsed or of the day; name the column"
    choices = ({name: words.replace(" ", "_")} for words in (OF_DAY[0], ELAPSED))
    raise table.question(f"{what} 'Elapsed time ({form})' or 'Time of day'", "columns", *choices)


def _of_stamps(table: CellTable, clock: int, order: str, zone: str) -> tuple[CellTable, Floats, str]:
    """The table, oldest row first, with (rows,) s of its time stamps and what was assumed of them."""
    try:
        return table, *_since_first_row(table, clock, order, zone)
    except HistoryError as error:
        with suppress(HistoryError):
            if len(table.rows) > 2:  # of two one may have a wrong digit
                return (turned := oldest_first(table)), *_since_first_row(turned, clock, order, zone)
        raise error from None


def oldest_first(table: CellTable) -> CellTable:
    """A table whose newest row stands first, turned round."""
    return replace(table, rows=table.rows[::-1]).assuming("rows turned round as the newest stands first")


def with_clock_in_seconds(table: CellTable, clock: int, synonyms: Mapping[str, str]) -> CellTable:
    """The table with times h:mm:ss that begin anew, as behind a pause or a day, in seconds; any other as it is.

    A clock of 24 h that goes on past midnight at the pace of the readings around counts days. Question where it may
    begin anew as well.
    """
    name, cells = table.as_written(clock), list(cells_of(table.rows, clock))
    pattern, meant = _PATTERN.search(name), (synonyms.get(name, name), split_written_name(name)[0])
    is_of_hours = pattern is None or pattern[0].lower().startswith(("h:mm", "hh:mm"))
    if {*map(words_of, meant)} & {*OF_DAY} or not (is_of_hours and all(map(_ELAPSED.fullmatch, cells))):
        return table
    seconds = _seconds_of(table, clock, _H_MM_SS[: cells[0].count(":") + 1])
    falls, notes = np.flatnonzero(np.diff(seconds) < 0.0), list[str]()
    if not falls.size:
        return table
    is_of_a_day = seconds.max() < DAY and (np.diff(seconds)[falls] < -0.5 * DAY).all()
    if is_of_a_day and (seconds[falls + 1].any() or not _ELAPSED_WORD.search(name)):
        whole, is_answered = through_midnight(seconds)[0], name in synonyms
        if _keeps_its_pace(whole, falls) and seconds[falls + 1].all() and (is_answered or seconds[0] == 0.0):
            seconds, notes = whole, [f"'{name}' passes midnight {falls.size} time{'s' if falls.size > 1 else ''}"]
        elif not is_answered:
            what = f"'{name}' falls from {cells[falls[0]]} to {cells[falls[0] + 1]}"
            what = f"{what}, and may be elapsed or of the day: does it begin anew there, or pass midnight?"
            choices = ({name: words.replace(" ", "_")} for words in (OF_DAY[0], ELAPSED))
            raise table.question(what, "columns", *choices, line=table.rows[falls[0] + 1].line)
    texts = [f"{one:.12g}".replace(".", table.dialect.decimal) for one in seconds]
    return table.renamed(table.columns).with_cells(clock, "time_s", texts).assuming(*notes)


def _keeps_its_pace(times: Floats, falls: Ints) -> bool:
    """Whether steps of time after readings are about as long as one beside each; times : (readings,) s."""
    steps = np.diff(times)
    beside = [[steps[n] for n in (k - 1, k + 1) if 0 <= n < steps.size] for k in falls]
    return all(
        any(steps[k] < 1.5 * one and one < 1.5 * steps[k] for one in near)
        for k, near in zip(falls, beside, strict=True)
    )


_AT_MIDNIGHT = " (a time of day may begin anew at midnight only; of readings 12 h apart or more write the dates, too)"


def _place_of_rows(table: CellTable) -> str:
    """Before the colon and the number of a row."""
    return f"{table.path}, sheet '{table.sheet}', row" if table.sheet else str(table.path)


def _since_first_row(table: CellTable, clock: int, order: str, zone: str) -> tuple[Floats, str]:
    """(rows,) s of time stamps since that of the first row, and what was assumed of them."""
    column, cells = ClockColumn(), list(cells_of(table.rows, clock))
    column.add(cells, [table.location(row.line) for row in table.rows])
    if -1 in column.rows[0] and not all(cell[-1].isalpha() for cell in cells):  # 10:00:00 PM
        k = int(np.argmax(column.rows[0] == -1))
        place = table.location(table.rows[k].line)
        raise HistoryError(f"{place}: time is '{quoted(cells[k])}'; write h:mm:ss, a date with a time, or a number")
    times = resolve(column, _place_of_rows(table), table.lines, order, zone)
    notes = [note.removeprefix("its ") for note in times.notes if note.startswith("its dates")]
    return times.times, "; ".join([f"time since the first row at {cells[0]}", *notes]).replace(",", " -")
