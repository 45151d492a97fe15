"""What a file states in creepkit's names and with units: `Stress: 120 MPa` as stress_MPa, a strain as what it is.

A strain without a unit may be a fraction or in per cent. It is decided by, in this order: the key `strain_unit` (1, %),
the head of a file that earlier versions of creepkit wrote (fractions), and its values: above 1, up to 100, they are per
cent, for few creep tests are stretched to twice their length; below 0.001 they are fractions, for no extensometer
resolves 0.001 %. Else it is asked for. What was decided by head or values is recorded in the label "assumed".
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from creepkit.errors import HistoryError, quoted
from creepkit.readers.clock_times import with_elapsed_times
from creepkit.readers.column_names import (
    STATED_BY_NAME,
    plain_name,
    split_unit,
    split_written_name,
    unit_suffix,
    words_of,
)
from creepkit.readers.questions import Question
from creepkit.readers.table import CellTable, NumberRows, SourceText, TableRow
from creepkit.readers.vocabulary import HeaderVocabulary, Terms

SURELY_PER_CENT, SURELY_FRACTION = 1.0, 1e-3
"""Largest strain above which, and below which, a strain without unit is decided by its values."""


LARGEST_PER_CENT = 100.0
"""Largest strain without unit that may be in per cent; above, it may be microstrain."""


STRAIN_UNITS: Mapping[str, str] = {"1": "1", "pct": "pct", "microstrain": "microstrain"}
"""Units that the key `strain_unit` may name, as a suffix or in any other spelling of it."""


_VALUE_WITH_UNIT = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*([^\d\s.,;:+-][^;:]{0,10})", re.ASCII)


_WRITTEN_HEAD = ("name", "specimen", "control", "temperature_K", "strain_measure", "includes_elastic")
"""Keys that stand in the head of every creep curve that write_history wrote when it left out the unit of strain."""


def in_standard_names(
    entries: Mapping[str, SourceText], table: CellTable, vocabulary: HeaderVocabulary
) -> tuple[dict[str, SourceText], CellTable]:
    """Entries and columns of one test under creepkit's names, with units, and a strain whose unit is decided."""
    known = vocabulary.terms(specimen_named(entries, vocabulary))
    stated = in_standard_keys(entries, known)
    for key, entry in _stated_by_columns(table):
        if stated.setdefault(key, entry).text != entry.text:
            raise HistoryError(
                f"{stated[key].location}: {key} is '{stated[key].text}', but {entry.location} says {entry.text}"
            )
    columns = [known.column(name) for name in table.columns]
    table = replace(table, columns=columns, written=table.columns) if columns != list(table.columns) else table
    table = with_elapsed_times(stated, table, known)
    return _with_decided_strains(stated, _without_per_cent_signs(table, known), known, entries)


def specimen_named(entries: Mapping[str, SourceText], vocabulary: HeaderVocabulary) -> str:
    """The specimen that a file names, "" where it names none."""
    synonyms = vocabulary.synonyms
    named = (e.text.casefold() for key, e in entries.items() if plain_name(synonyms.get(key, key)) == "specimen")
    return next(named, "")


def in_standard_keys(entries: Mapping[str, SourceText], known: Terms) -> dict[str, SourceText]:
    """Entries under creepkit's names of their keys, with the units that stand in their texts."""
    stated: dict[str, SourceText] = {}
    for key, entry in entries.items():
        name = known.condition(key)
        found = split_unit(name, known.conditions.kinds)
        if found and (match := _VALUE_WITH_UNIT.fullmatch(entry.text)):
            suffix = unit_suffix(match[2])
            if suffix in known.conditions.kinds[found[0]].units and found[1] in ("", suffix):
                name, entry = f"{found[0]}_{suffix}", replace(entry, text=match[1])
        if name in stated:
            raise HistoryError(f"{entry.location}: '{key}' is given twice (perhaps in two units); keep one of them")
        stated[name] = entry if name == key else replace(entry, key=entry.key or key)
    return stated


def _stated_by_columns(table: CellTable) -> list[tuple[str, SourceText]]:
    """Conditions that names of columns state, as `True strain (%)` does."""
    place = table.location(table.columns_line)
    names = [(column, words_of(split_written_name(column)[0])) for column in table.columns]
    return [
        (STATED_BY_NAME[words][0], SourceText(STATED_BY_NAME[words][1], f"{place}, column '{column}'"))
        for column, words in names
        if words in STATED_BY_NAME
    ]


def _without_per_cent_signs(table: CellTable, known: Terms) -> CellTable:
    """The table without the signs in cells such as `1.2 %`, whose columns are in per cent, as their names must say."""
    if isinstance(table.rows, NumberRows):
        return table
    signed = [k for k, cell in enumerate(table.rows[0].cells) if cell.endswith("%") and _kind(table.columns[k], known)]
    if not signed:
        return table
    columns = list(table.columns)
    for k in signed:
        name, suffix = split_unit(columns[k], known.columns.kinds) or (columns[k], "")
        if suffix not in ("", "pct", "percent"):
            place = table.location(table.columns_line, k)
            raise HistoryError(f"{place}: '{columns[k]}' is not in per cent, but its cells are; correct one of them")
        columns[k] = f"{name}_pct"
    rows = list(_rows_without_signs(replace(table, columns=columns), signed))
    return replace(table, columns=columns, rows=rows, written=table.written or table.columns)


def _rows_without_signs(table: CellTable, signed: Collection[int]) -> Iterator[TableRow]:
    for row in table.rows:
        cells = list(row.cells)
        for k in signed:
            if not cells[k].endswith("%"):
                place = table.location(row.line, k)
                raise HistoryError(
                    f"{place}: '{table.columns[k]}' is '{quoted(cells[k])}' without the sign % of others"
                )
            cells[k] = cells[k].removesuffix("%").rstrip()
        yield TableRow(row.line, cells)


def _kind(name: str, known: Terms) -> bool:
    """Whether a column holds a quantity that may be in per cent."""
    found = split_unit(name, known.columns.kinds)
    return found is not None and "pct" in known.columns.kinds[found[0]].units


def _with_decided_strains(
    stated: dict[str, SourceText], table: CellTable, known: Terms, written: Mapping[str, SourceText]
) -> tuple[dict[str, SourceText], CellTable]:
    """The columns and entries that have no unit, though it matters, under names with one."""
    unit = stated.pop("strain_unit", None)
    suffix = None if unit is None else unit_suffix(unit.text)
    if unit is not None and suffix not in STRAIN_UNITS:
        raise HistoryError(f"{unit.location}: strain_unit is '{unit.text}'; allowed: 1, %, microstrain")
    undecided = {name for name in table.columns if _is_undecided(name, known)}
    deviations = {name for name in (*table.columns, *stated) if name.endswith("_sd") and _is_undecided(name, known)}
    names, assumptions = dict[str, str](), list(table.assumptions)
    if not any(known.quantity(column) == "time" for column in table.columns):
        return stated, table  # no frames at all, which is told first
    for name in sorted(undecided - deviations):
        if suffix is None:
            decided, assumption = _decided_by_table(name, table, written)
            assumptions.append(assumption)
        names[name] = f"{name}_{suffix or decided}"
    for name in sorted(deviations):
        base = names.get(name.removesuffix("_sd"), "")
        if not (suffix or base):
            place = stated[name].location if name in stated else table.location(table.columns_line)
            raise HistoryError(f"{place}: '{name}' has no unit; allowed: {name}_1, {name}_pct, {name}_microstrain")
        names[name] = f"{name}_{suffix or base.rpartition('_')[2]}"
    if not names:
        return stated, table
    columns = [names.get(name, name) for name in table.columns]
    return (
        {names.get(key, key): entry for key, entry in stated.items()},
        replace(table, columns=columns, written=table.written or table.columns, assumptions=tuple(assumptions)),
    )


def _is_undecided(name: str, known: Terms) -> bool:
    if name in known.declared:
        return False
    kinds = known.columns.kinds
    found = split_unit(name, kinds)
    return bool(found) and found == (name, "") and kinds[name].is_ambiguous_without_unit


def _decided_by_table(name: str, table: CellTable, written: Mapping[str, SourceText]) -> tuple[str, str]:
    """The unit of a column that states none, and how it was decided; HistoryError where it cannot be."""
    if set(_WRITTEN_HEAD) <= written.keys() and "time_s" in table.columns:
        return "1", f"{name} a fraction as in files of write_history"
    largest = float(np.abs(table.numbers(name)).max())
    if largest > LARGEST_PER_CENT:
        place = table.location(table.columns_line, table.column(name))
        raise Question(
            table.path,
            place,
            f"'{name}' has no unit, and values up to {largest:g} are no fractions and hardly per cent; name it "
            f"{name}_microstrain or {name}_pct, or write '# strain_unit: microstrain' or '# strain_unit: %' above",
            "strain_unit",
            ("microstrain", "%"),
        )
    if largest > SURELY_PER_CENT:
        return "pct", f"{name} in per cent (up to {largest:g})"
    if largest < SURELY_FRACTION:
        return "1", f"{name} a fraction (up to {largest:g})"
    place = table.location(table.columns_line, table.column(name))
    raise Question(
        table.path,
        place,
        f"'{name}' has no unit, and values up to {largest:g} may be fractions or per cent; name it {name}_1 or "
        f"{name}_pct, or write '# strain_unit: 1' or '# strain_unit: %' above",
        "strain_unit",
        ("%", "1"),
    )
