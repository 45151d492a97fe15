"""Columns of a table with one row a test: what their names mean, in which rows the names stand, where the tests begin.

Names are understood in English, German and French, with their unit behind `_`, `,` or `/`, in brackets, or in a row of
its own. Rows of a head may stand in any order; a name may stand above several columns, as `Time to strain (h)` does
above `0.2 %` and `1 %`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from creepkit.files.delimited_text import Dialect, is_number
from creepkit.readers.column_names import NAMES_OF, NameTable, split_written_name, unit_suffix, words_of
from creepkit.readers.ends_of_tests import FIRM, kind_of_column, plain_words
from creepkit.readers.table import TableRow
from creepkit.readers.vocabulary import CONDITION_KINDS, plain_name, split_unit
from creepkit.records.quantities import RATE, STRESS, TEMPERATURE, TIME, QuantityKind

MEASURED = ("minimum_rate", "rupture")
"""Of which a table of tests has one at least, or a time to a strain."""


TIME_TO_STRAIN = "time_to_strain"
"""Before the strain, as a fraction, in the key of a column of times to it."""


QUANTITIES: Mapping[str, tuple[QuantityKind, tuple[str, ...]]] = {
    "stress": (STRESS, (*NAMES_OF["stress"], "stress", "sigma", "σ", "contrainte appliquée", "contrainte nominale")),
    "temperature": (TEMPERATURE, (*NAMES_OF["temperature"], "temperature", "t", "temp d essai")),
    "minimum_rate": (RATE, ("minimum rate", "minimum creep rate", "mcr", "minimale kriechrate")),
    "minimum_rate_sd": (RATE, ("minimum rate sd", "min rate sd", "minimum creep rate sd", "min creep rate sd")),
    "rupture": (
        TIME,
        (
            *(
                "rupture",
                "rupture time",
                "creep life",
                "t r",
                "tr",
                "t rupture",
                "life",
                "bruchzeit",
                "standzeit",
                "tb",
            ),
            *("t f", "tf", "ttr", "ttf", "t u", "tu", "zeitstand", "durée de vie"),
        ),
    ),
    "end_time": (
        TIME,
        (
            *(*NAMES_OF["time"], "end time", "duration", "test duration", "time", "time on test", "t", "hours on test"),
            *("prüfdauer", "versuchsdauer", "durée d essai", "temps d essai", "durée de l essai"),
        ),
    ),
}
"""{quantity: its kind, and names of a column of it in small letters, beside those that its words tell."""


TEXTS: Mapping[str, tuple[str, ...]] = {
    "name": (
        *("name", "test", "test id", "test name", "test no", "test number", "id", "no", "sample", "sample id"),
        *("specimen id", "specimen no", "specimen name", "probennummer", "versuch", "probe", "proben nr", "nr"),
        *("essai", "éprouvette", "n° essai", "repère", "probenbezeichnung", "test piece", "bar"),
    ),
    "alloy": (*NAMES_OF["alloy"], "alloy", "nuance", "steel", "grade"),
    "control": ("control",),
    "specimen": ("specimen",),
    "label heat": ("heat", "cast", "batch", "charge", "schmelze", "heat number", "heat no", "coulée", "heat id"),
    "label laboratory": ("laboratory", "lab", "labor", "laboratoire"),
    "label elongation_pct": (
        *("elongation pct", "elongation", "rupture elongation", "elongation at rupture", "a", "el", "allongement"),
        *("bruchdehnung", "allongement à rupture"),
    ),
    "label reduction_of_area_pct": (
        *("reduction of area", "area reduction", "ra", "z", "reduction in area", "roa", "brucheinschnürung"),
        *("einschnürung", "striction", "striction à rupture"),
    ),
}
"""{key of a history file: the names of a column of it in small letters}."""


def _spellings(name: str) -> tuple[str, str]:
    return name, plain_words(name).replace("|", " ")


NAMES = NameTable(
    {quantity: kind for quantity, (kind, _) in QUANTITIES.items()},
    tuple(TEXTS),
    {
        spelling: key
        for key, names in (*TEXTS.items(), *((q, names) for q, (_, names) in QUANTITIES.items()))
        for name in names
        for spelling in _spellings(name)
    },
    {},
)


_IS_TIME = re.compile(
    r"\b(?:time|temps|duree|zeit|hours?|hrs?|h|stunden|heures?|life|duration|days?|tage|jours)\b|zeit\b"
)
_RATES = re.compile(r"rate\b|geschwindigkeit\b|vitesse\b")
_OF_CREEP = re.compile(r"\b(?:min\w*|steady|second\w*|station\w*|sekund\w*|creep|fluage)\b|kriech")
_OF_RUPTURE = re.compile(r"\b(?:rupt\w*|fail\w*|fracture|break|bruch\w*|ruine)\b")
_OF_OTHERS = re.compile(r"elong|dehnung\b|strain\b|allong|parameter|ratio|log|sd\b|std|error|stress\b|date|datum")
_PER_CENT = r"(\d+(?:[.,]\d+)?)\s*(?:%|pct\b|per ?cent\b|percent\b|prozent\b|pour ?cent\b)"
_SYMBOL_TO_STRAIN = re.compile(rf"t[\s_]*\(?\s*(?:[eε]p?\s*=?\s*)?{_PER_CENT}\s*\)?(?:[\s_,/(\[].*)?", re.IGNORECASE)
_UNIT_IN_NAME = {"h": r"hours?|hrs?|stunden|heures?", "d": r"days|tage|jours", "min": r"minutes|minuten"}


@lru_cache(maxsize=4096)
def key_of_column(written: str) -> tuple[str, str]:
    """The quantity, or key, that the name of a column means, and its unit; ("", "") where it means none.

    A time to a strain is `time_to_strain 0.01`, with the strain as a fraction.
    """
    if (strain := _strain_reached(written)) is not None:
        return f"{TIME_TO_STRAIN} {strain:.6g}", _unit_of_time(written)
    name, unit = split_written_name(written)
    if re.fullmatch(r"[\w ]+(?:/[\w ]+)+|.*=.*", unit) and not unit_suffix(unit):
        return "", ""  # (yes/no), (1 = failed): no unit but the values of the column
    unit = unit_suffix(unit) or unit
    if plain_name(name) == "t":
        return "temperature" if unit in TEMPERATURE.units or (name == "T" and not unit) else "end_time", unit
    meant = _meaning(name, unit == "pct")
    if meant in QUANTITIES:
        return meant, unit or (_unit_of_time(written) if QUANTITIES[meant][0] is TIME else "")
    whole = _meaning(written, is_per_cent=False)
    text = whole if whole in TEXTS else meant if unit in ("", "pct") else ""
    if not text and (quantity := _quantity_by_words(name, unit)):
        return quantity, unit or (_unit_of_time(written) if QUANTITIES[quantity][0] is TIME else "")
    return text, ""


def _meaning(name: str, is_per_cent: bool = True) -> str:
    if name.casefold() in ("a", "el") and not is_per_cent:
        return ""
    plain = plain_words(name).replace("|", " ").replace("?", " ")
    return NAMES.meaning(name) or NAMES.meaning(plain) or ""


def _quantity_by_words(name: str, unit: str) -> str:
    """The quantity of which the words of a name speak, whatever else they say of it."""
    plain = plain_words(name)
    is_rate = _RATES.search(plain) and _OF_CREEP.search(plain) and not re.search(r"sd\b|std|err", plain)
    if is_rate and (unit in RATE.units or unit in ("", "pct")):
        return "minimum_rate"
    if _OF_OTHERS.search(plain):
        return ""
    if _OF_RUPTURE.search(plain) and _IS_TIME.search(plain):
        return "rupture"
    return ""


def _strain_reached(written: str) -> float | None:
    """The strain, as a fraction, to which a column states times; None of any other column."""
    text = " ".join(written.split())
    plain = plain_words(re.sub(_PER_CENT, " ", text))
    found = _SYMBOL_TO_STRAIN.fullmatch(text) or re.search(_PER_CENT, text, re.IGNORECASE)
    if found is None or re.search(r"rate|geschwindig|vitesse|grenze|limit|stress|spannung|contrainte|offset", plain):
        return None
    if not (_SYMBOL_TO_STRAIN.fullmatch(text) or _IS_TIME.search(plain)):
        return None
    number = float(found[1].replace(",", "."))
    return number / 100 if 0 < number <= 100 else None


def _unit_of_time(written: str) -> str:
    """The unit of a time in brackets, at the end, or among the words, as in `hours to 1 % strain`; "" for none."""
    for text in (*re.findall(r"[(\[]([^()\[\]]*)[)\]]", written), split_written_name(written)[1]):
        suffix = unit_suffix(text)
        if suffix is not None and suffix in TIME.units:
            return suffix
    words = words_of(written)
    return next((unit for unit, names in _UNIT_IN_NAME.items() if re.search(rf"\b(?:{names})\b", words)), "")


def kind_of(quantity: str) -> QuantityKind | None:
    """The kind of the numbers of a column; None of a text."""
    if quantity.startswith(TIME_TO_STRAIN):
        return TIME
    return QUANTITIES[quantity][0] if quantity in QUANTITIES else None


def quantity_of(key: str) -> str:
    """The quantity of a key, without its unit; other keys as they are."""
    if key.startswith(TIME_TO_STRAIN):
        return key.rpartition("_")[0] if key.count("_") > TIME_TO_STRAIN.count("_") else key
    found = split_unit(key, {**CONDITION_KINDS, **NAMES.kinds})
    return found[0] if found else key_of_column(key)[0] or key


def unit_of(key: str) -> str:
    """The unit of a key."""
    return key.rpartition("_")[2]


# ---- the rows of the head ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TestTableHead:
    """The names of the columns with their units; their first row, that which names most, and that of the first test."""

    names: tuple[str, ...]
    first: int
    line: int
    body: int


_NUMBER_LIKE = re.compile(
    r"(?:[<>≥≤~≈(\[]|>=|ca\.? )*\s*[+-]?\d[\d.,'’\s]*(?:[eEdD][+-]?\d+)?\s*(?:[+*)\]†‡#→h]|->|\.\.\.|…)*"
)
_SEARCHED, _DEEPEST = 60, 5
"""Rows within which the tests must begin, and rows of a head."""


def is_number_like(cell: str, dialect: Dialect) -> bool:
    """Whether a cell holds a number, perhaps marked as a run-out."""
    return is_number(cell, dialect) or _NUMBER_LIKE.fullmatch(cell) is not None


def _is_measured(cell: str, dialect: Dialect) -> bool:
    """Whether a cell holds a number, perhaps with a unit behind it."""
    with_unit = re.fullmatch(r"[<>≥]?\s*[\d.,]+(?:[eE][+-]?\d+)?\s*(\S{1,6})", cell)
    has_unit = with_unit is not None and unit_suffix(with_unit[1]) not in (None, "pct")
    return has_unit or is_number_like(cell, dialect)


def only_text(row: TableRow, dialect: Dialect) -> str:
    """The one text of a row that holds nothing else, in one cell or merged ones; "" of any other row."""
    filled = [cell for cell in row.cells if cell]
    if len(set(filled)) != 1 or len(filled) not in (1, len(row.cells)):
        return ""
    return "" if is_number_like(filled[0], dialect) or unit_suffix(filled[0]) else filled[0]


def head_of_tests(rows: Sequence[TableRow], dialect: Dialect, meant: Mapping[str, str]) -> TestTableHead | None:
    """The head of a table with one row a test; None where the rows are no such table.

    meant : {name as written: what it is} of columns that were named otherwise.
    """
    body = next(
        (k for k, row in enumerate(rows[:_SEARCHED]) if sum(_is_measured(c, dialect) for c in row.cells if c) > 1), None
    )
    if not body:
        return None
    while body > 1 and only_text(rows[body - 1], dialect):  # sections above the first test
        body -= 1
    first = body
    while first > max(0, body - _DEEPEST) and _may_name(rows[first - 1], dialect):
        first -= 1
    for start in range(body - 1, first - 1, -1):
        names = _joined([row.cells for row in rows[start:body]], meant)
        if is_test_table([meant.get(name, name) for name in names]):
            # A further row above may hold units, or what stands above several columns.
            for higher in range(first, start):
                if sum(bool(key_of_column(cell)[0]) for cell in rows[higher].cells if cell) > 1:
                    return TestTableHead(tuple(names), higher, start, body)  # the same names in another language
                wider = _joined([row.cells for row in rows[higher:body]], meant)
                if _understood(wider, meant) > _understood(names, meant):
                    return TestTableHead(tuple(wider), higher, start, body)
            return TestTableHead(tuple(names), start, start, body)
    return None


def _may_name(row: TableRow, dialect: Dialect) -> bool:
    filled = [cell for cell in row.cells if cell]
    return (len(set(filled)) > 1 or bool(unit_suffix(filled[0]))) and not any(
        _is_measured(cell, dialect) for cell in filled
    )


def _understood(names: Sequence[str], meant: Mapping[str, str]) -> int:
    keys = [key_of_column(meant.get(name, name)) for name in names]
    return sum(bool(key) + bool(key in QUANTITIES and unit in QUANTITIES[key][0].units) for key, unit in keys)


def _joined(rows: Sequence[Sequence[str]], meant: Mapping[str, str]) -> list[str]:
    """One name a column, with its unit, of the rows of a head."""
    width = max(len(cells) for cells in rows)
    padded = [[*cells, *[""] * (width - len(cells))] for cells in rows]
    above = [list(_filled_right(cells)) for cells in padded[:-1]]
    return [_name_of(k, padded, above, meant) for k in range(width)]


def _filled_right(cells: Sequence[str]) -> Iterator[str]:
    last = ""
    for cell in cells:
        last = cell or last
        yield last


def _name_of(k: int, rows: Sequence[Sequence[str]], above: Sequence[Sequence[str]], meant: Mapping[str, str]) -> str:
    """The name of one column: of its texts together, or of one of them, the first that is understood."""
    cells = list(dict.fromkeys(cells[k] for cells in rows if cells[k]))
    texts = [cell for cell in cells if not unit_suffix(cell)] or cells[:1]
    units = [cell.strip("()[] ") for cell in cells if cell not in texts and cell != "-"]
    if len(rows) == 1 or not texts:
        return "".join(texts)
    wide = list(dict.fromkeys(filter(None, (*(cells[k] for cells in above), rows[-1][k]))))
    options = [" ".join(texts), *reversed(texts), " ".join(wide)]
    for text in options:
        own = unit_suffix(split_written_name(text)[1])
        is_reached = own == "pct" and bool(units) and unit_suffix(units[0]) in TIME.units
        name = f"{text} ({units[0]})" if units and (not own or is_reached) else text
        if text in meant or key_of_column(name)[0]:
            return name
    return f"{options[0]} ({units[0]})" if units else options[0]


def is_test_table(names: Sequence[str]) -> bool:
    """Whether names are those of tests: a stress or a temperature, and a rate, a rupture time or a time to a strain."""
    keys = [key_of_column(name)[0] for name in names if name]
    measured = any(key in MEASURED or key.startswith(TIME_TO_STRAIN) for key in keys)
    measured |= "end_time" in keys and any(kind_of_column(name) in FIRM for name in names)
    return measured and not {"stress", "temperature"}.isdisjoint(keys) and not has_frames(names)


def has_frames(names: Sequence[str]) -> bool:
    """Whether a column is a strain over time, and no rate, no time to it and none at rupture."""
    for name in names:
        words = set(words_of(name).split())
        is_strain = "strain" in words and words.isdisjoint(("rate", "rupture", "fracture", "failure", "final"))
        if is_strain and not key_of_column(name)[0].startswith(TIME_TO_STRAIN):
            return True
    return False
