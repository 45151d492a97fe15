"""Columns of a table with one row a test: what their names mean, in which rows the names stand, where the tests begin.

Names are understood in English, German, French, Italian, Spanish and Dutch, with their unit behind `_`, `,` or `/`, in
brackets, or in a row of its own. Rows of a head may stand in any order; a name may stand above several columns, as
`Time to strain (h)` does above `0.2 %` and `1 %`.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate

from creepkit.files.delimited_text import Dialect, is_number, without_uncertainty
from creepkit.readers.ends_of_tests import FIRM, LABEL, kind_of_column, plain_words
from creepkit.readers.names import NAME_SYNONYMS, NAMES_OF, SYMBOLS
from creepkit.readers.table import CellTable, TableRow
from creepkit.readers.vocabulary import (
    CONDITION_KINDS,
    NameTable,
    names_tests,
    plain_name,
    split_unit,
    split_written_name,
    unit_suffix,
    words_of,
)
from creepkit.records.quantities import RATE, STRESS, TEMPERATURE, TIME, QuantityKind

TIME_TO_STRAIN = "time_to_strain"
"""Before the strain, as a fraction, in the quantity of a column of times to it."""


QUANTITIES: Mapping[str, QuantityKind] = {
    "stress": STRESS,
    **{
        name: CONDITION_KINDS[name]
        for name in ("temperature", "minimum_rate", "minimum_rate_sd", "rupture", "end_time")
    },
}
"""{quantity of a column: its kind}."""


TEXTS = ("name", "alloy", "control", "specimen", *(key for key in NAMES_OF if key.startswith("label ")))
"""Keys of a history file that columns are."""


_OWN_NAMES: Mapping[str, tuple[str, ...]] = {
    "rupture": ("rupture", "t r", "tr", "tb", "t f", "tf", "t u", "tu", "life", "zeitstand"),
    "end_time": ("time", *NAMES_OF["time"]),
    "name": ("name", "id", "no", "nr", "nom", "bar"),
    "label elongation_pct": ("elongation pct", "elongation", "a", "el", "allongement"),
    "label reduction_of_area_pct": ("ra", "z", "roa"),
}
"""{quantity or key: names in small letters} that mean something else, or too much, anywhere but in a table of tests."""


NAMES = NameTable(
    QUANTITIES,
    TEXTS,
    {
        spelling: key
        for key in (*TEXTS, *QUANTITIES)
        for name in (*NAMES_OF.get(key, ()), *_OWN_NAMES.get(key, ()))
        for spelling in (name, plain_words(name).replace("|", " "))
    },
    {symbol: quantity for symbol, quantity in SYMBOLS.items() if quantity == "stress"},
)


@dataclass(frozen=True)
class TestColumn:
    """A column of a table of tests.

    quantity : of QUANTITIES, a time to a strain, `time_to_strain 0.01`, or a key of TEXTS; "" where its name means
    none. unit : of a number, as creepkit writes it or as it is written. factor : of numbers of `rate x 10^6 (1/h)`.
    """

    quantity: str = ""
    unit: str = ""
    factor: float = 1.0

    @property
    def kind(self) -> QuantityKind | None:
        """The kind of its numbers; None of a text."""
        return TIME if self.strain is not None else QUANTITIES.get(self.quantity)

    @property
    def strain(self) -> float | None:
        """The strain, as a fraction, to which it states times."""
        return float(self.quantity.split()[1]) if self.quantity.startswith(TIME_TO_STRAIN) else None

    @property
    def key(self) -> str:
        """The key of a history file that states the same."""
        return f"{self.quantity}_{self.unit}" if self.kind else self.quantity


_IS_TIME = re.compile(
    r"\b(?:time|temps|duree|zeit|hours?|hrs?|h|stunden|heures?|life|duration|days?|tage|jours"
    r"|tempo|tiempo|ore|horas?|durata|duracion|vita|vida|giorni|dias|tijd|duur|uur|uren|dagen|levensduur)\b|zeit\b"
)
RATES = re.compile(r"rate\b|geschw(?:indigkeit)?\b|vitesse\b|velocit(?:a|y)\b|velocidad\b|snelheid\b")
_OF_MINIMUM = re.compile(r"\b(?:min\w*|mcr|steady|second\w*|station\w*|sekund\w*|lowest|smallest|kleinste\w*)\b")
_CREEP_RATE = re.compile(
    r"(?:(?:creep|strain|rate|de|fluage|vitesse|deformation|kriech\w*|kruip\w*|velocita|velocidad|di|deformazione"
    r"|fluencia|deformacion) ?)+"
)
_ANOTHER_RATE = re.compile(
    r"\b(?:average\w*|avg|mean|mittler\w*|durchschnitt\w*|moyenne?|tertia\w*|prima\w*|initial\w*|anfang\w*|final\w*"
    r"|gemiddeld\w*|start|end|max\w*|at|bei|nach|after|apres|rupture|fracture|failure|bruch|last|first)\b"
)
"""Of a rate that is the minimum one, that may be it, and that is another one."""


_RATE_SYMBOL = re.compile("[εɛe]\u0307[ _]?(?:min|ss?|m|st|c)?")
"""A dot above the strain, its letters apart from their accents."""


_OF_RUPTURE = re.compile(r"\b(?:rupt\w*|fail\w*|fracture|break|bruch\w*|ruine|rottura|rotura|breuk|bezwijken)\b")
_OF_NO_TEST = re.compile(
    r"\b(?:specified|specification|required|requirement|expected|predict\w*|calculat\w*|computed|estimat\w*|extrapol\w*"
    r"|min(?:imum|imal\w*)?|minimale|guaranteed|design|target|theoretical|allow\w*|nominal|planned|soll\w*|mindest\w*"
    r"|gefordert\w*|vorhergesagt\w*|berechnet\w*|erwartet\w*|geschatzt\w*|geplant\w*|prev[iu]\w*|calculee?s?|estimee?s?"
    r"|previst\w*|calcolat\w*|calculad\w*|stimat\w*|estimad\w*|richiest\w*|requerid\w*|exigee?s?|requise?s?|specifiee?s?|attendue?s?|theorique"
    r"|verwacht\w*|berekend\w*|voorspeld\w*|vereist\w*|geschat)\b"
)
"""Of what was asked of a test, or is that of a model."""


_OF_OTHERS = re.compile(
    r"elong|dehnung\b|rek\b|strain\b|allong|allung|alarg|parameter|ratio|log|sd\b|std|error|stress\b|date|datum"
)
_FACTOR = re.compile(
    r"[x×*·]?\s*(?<![\d.])(?:10\s*\^?\s*([\-−]\d+|⁻[⁰¹²³⁴-⁹]+)|1[eE](-\d+)"
    r"|(?<!/)(?<!/ )(?:10\s*\^?\s*(\+\d+|(?<=\^)\d+|(?<=\^ )\d+|⁺?[⁰¹²³⁴-⁹]+)|1[eE](\+?\d+)))\s*"
)
"""A power of ten by which numbers were multiplied, or that stands in their unit; rates are small, so it divides. A
positive one behind a stroke belongs to the time there: %/10^3 h."""


_PER_CENT = (
    r"(\d+(?:[.,]\d+)?)\s*(?:%|pct\b|per ?cent\b|percent\b|prozent\b|procent\b|pour ?cent\b|per ?cento\b|por ?ciento\b)"
)
_SYMBOL_TO_STRAIN = re.compile(
    rf"t[\s_]*\(?\s*(?:[eε]p?\s*=?\s*)?{_PER_CENT}\s*\)?(?:[\s_,/(\[].*)?"
    r"|t[\s_]?[pf][\s_]?(\d+(?:[.,]\d+)?)(?:\s*%)?(?:[\s_,/]+\w+|\s*[(\[]\w+[)\]])?",
    re.IGNORECASE,
)
"""Also t_p and t_f of ISO 204, to a plastic and to a creep elongation in per cent."""
_UNIT_IN_NAME = {
    "h": r"hours?|hrs?|stunden|heures?|ore|horas|uur|uren",
    "d": r"days|tage|jours|giorni|dias|dagen",
    "min": r"minutes|minuten",
}


@lru_cache(maxsize=4096)
def column_called(written: str) -> TestColumn:
    """The column that a name means."""
    if power := _FACTOR.search(written):
        plain = " ".join(_FACTOR.sub(" ", written).split())
        rate = column_called(
            re.sub(r"(?<=[(\[]) (?=\S)| (?=[)\]])", "", plain).replace("(/", "(1/").replace("[/", "[1/")
        )
        exponent = int(unicodedata.normalize("NFKC", next(filter(None, power.groups()))).replace("−", "-"))
        if rate.kind is RATE:
            return replace(rate, factor=10.0 ** -abs(exponent))
    if (strain := _strain_reached(written)) is not None:
        return TestColumn(f"{TIME_TO_STRAIN} {strain:.6g}", unit_in(written, TIME))
    name, unit = split_written_name(written)
    if re.fullmatch(r"[\w ]+(?:/[\w ]+)+|.*=.*", unit) and not unit_suffix(unit):
        return TestColumn()  # (yes/no), (1 = failed): no unit but the values of the column
    unit = unit_suffix(unit) or unit
    if plain_name(name) == "t":
        return TestColumn(
            "temperature" if unit in TEMPERATURE.units or (name == "T" and not unit) else "end_time", unit
        )
    quantity, whole = _meaning(name, unit == "pct"), _meaning(written, is_per_cent=False)
    if NAME_SYNONYMS.get(words_of(name)) == "force" and unit in STRESS.units:
        return TestColumn("stress", unit)  # "Load (MPa)"
    text = whole if whole in TEXTS else quantity if unit in ("", "pct") else ""
    if quantity not in QUANTITIES and (text or not (quantity := _quantity_by_words(name, unit))):
        return TestColumn(text)
    if quantity == LABEL:
        return TestColumn(f"label {written}")
    return TestColumn(quantity, unit or (unit_in(written, TIME) if QUANTITIES[quantity] is TIME else ""))


def _meaning(name: str, is_per_cent: bool) -> str:
    if name.casefold() in ("a", "el") and not is_per_cent:
        return ""
    plain = re.sub(r"[|?]", " ", plain_words(name))
    return "name" if names_tests(name) else NAMES.meaning(name) or NAMES.meaning(plain) or ""


def _quantity_by_words(name: str, unit: str) -> str:
    """The quantity of which the words of a name speak, whatever else they say of it; LABEL of what no test measured."""
    plain = plain_words(name)
    if _RATE_SYMBOL.fullmatch(unicodedata.normalize("NFD", name)) and unit in RATE.units:
        return "minimum_rate"
    is_time = unit in TIME.units or (unit == "" and _IS_TIME.search(plain))
    is_rate = bool(RATES.search(plain)) and not re.search(r"sd\b|std|err", plain) and unit in (*RATE.units, "", "pct")
    is_min = _OF_MINIMUM.search(plain)
    is_of_no_test = (is_rate or is_time) and _OF_NO_TEST.search(_OF_MINIMUM.sub("", plain) if is_rate else plain)
    if is_of_no_test or (is_rate and not is_min and _ANOTHER_RATE.search(plain)):
        return LABEL
    if is_rate and (is_min or is_bare_rate(name) or (RATES.fullmatch(plain) and unit in RATE.units)):
        return "minimum_rate"
    is_rupture = _OF_RUPTURE.search(plain) and _IS_TIME.search(plain) and not _OF_OTHERS.search(plain)
    return "rupture" if is_rupture else ""


def is_bare_rate(name: str) -> bool:
    """Whether a name is that of a creep rate of which it does not say that it is the smallest."""
    plain = plain_words(name)
    return (
        _CREEP_RATE.fullmatch(plain) is not None and re.search("creep|fluage|kriech|kruip|fluencia", plain) is not None
    )


def _strain_reached(written: str) -> float | None:
    """The strain, as a fraction, to which a column states times; None of any other column."""
    text = " ".join(written.split())
    plain = plain_words(re.sub(_PER_CENT, " ", text))
    found = _SYMBOL_TO_STRAIN.fullmatch(text) or re.search(_PER_CENT, text, re.IGNORECASE)
    if found is None or re.search(r"rate|geschwindig|vitesse|grenze|limit|stress|spannung|contrainte|offset", plain):
        return None
    if not (plain.strip() == "" or _SYMBOL_TO_STRAIN.fullmatch(text) or _IS_TIME.search(plain)):
        return None
    if _OF_NO_TEST.search(plain_words(split_written_name(text)[0])):
        return None
    number = float(next(filter(None, found.groups())).replace(",", "."))
    return number / 100 if 0 < number <= 100 else None


def unit_in(text: str, kind: QuantityKind, before: str = "") -> str:
    """The unit of a kind in brackets, at the end, behind a comma, or of a time among the words, `hours to 1 % strain`.

    "" for none. before : pattern of what must stand before such a word.
    """
    places = [*re.findall(r"[(\[]([^()\[\]]*)[)\]]", text), split_written_name(text)[1]]
    places += re.findall(r"(?:\bin|,|_)\s*([^\s,_]+)", text)
    found = [unit_suffix(one) for one in places if unit_suffix(one) in kind.units and not before]
    words = _UNIT_IN_NAME.items() if kind is TIME else ()
    found += [unit for unit, names in words if re.search(rf"\b{before}(?:{names})\b", words_of(text))]
    return next((one for one in found if one), "")


def quantity_of(key: str) -> str:
    """The quantity that a key or a name states, without its unit; other keys as they are."""
    found = split_unit(key, {**CONDITION_KINDS, **NAMES.kinds})
    return found[0] if found else column_called(key).quantity or key


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
_WITH_UNIT = re.compile(r"[<>≥]?\s*[\d.,]+(?:[eEdD][+-]?\d+)?\s*(\S{1,6})")
_ASSIGNED = re.compile(r"[^()\[\]=]+=\s*[\d.,]+\s*\S{1,6}")  # "E = 170 GPa"
SEARCHED, _DEEPEST, _MOST_IN_COLUMNS = 60, 5, 30
"""Rows within which the tests must begin; rows of a head; and of a table whose tests stand in columns."""


def is_number_like(cell: str, dialect: Dialect) -> bool:
    """Whether a cell holds a number, perhaps marked as a run-out."""
    return is_number(cell, dialect) or _NUMBER_LIKE.fullmatch(without_uncertainty(cell)) is not None


def is_measured(cell: str, dialect: Dialect) -> bool:
    """Whether a cell holds a number, perhaps marked or with a unit behind it."""
    with_unit = _WITH_UNIT.fullmatch(cell)
    has_unit = with_unit is not None and unit_suffix(with_unit[1]) not in (None, "pct")
    return has_unit or is_number_like(cell, dialect)


def only_text(row: TableRow, dialect: Dialect) -> str:
    """The one text of a row that holds nothing else, in one cell or merged ones; "" of any other row."""
    filled = [cell for cell in row.cells if cell]
    if len(set(filled)) != 1 or len(filled) not in (1, len(row.cells)):
        return ""
    return "" if is_number_like(filled[0], dialect) or unit_suffix(filled[0]) else filled[0]


def head_of_tests(table: CellTable, meant: Mapping[str, str]) -> TestTableHead | None:
    """The head of a table with one row a test; None where the rows are no such table.

    meant : {name as written: what it is} of columns that were named otherwise.
    """
    rows, dialect = table.rows, table.dialect
    searched = enumerate(rows[:SEARCHED])
    body = next((k for k, row in searched if sum(is_measured(c, dialect) for c in row.cells if c) > 1), 0)
    while body > 1 and only_text(rows[body - 1], dialect):  # sections above the first test
        body -= 1
    first = body
    while first > max(0, body - _DEEPEST) and _may_name(rows[first - 1], dialect) and _is_of_one_head(rows, first):
        first -= 1
    for start in range(body - 1, first - 1, -1):
        names = _joined([row.cells for row in rows[start:body]], meant)
        said = (table.sheet, table.path.stem, *(cell for row in rows[:start] for cell in row.cells))
        if any(map(SAYS_RUPTURE.search, said)):
            names = _with_rupture_times(names, meant)
        if not is_test_table([meant.get(name, name) for name in names], rows[body:]):
            continue
        # A further row above may hold units, or what stands above several columns.
        for higher in range(first, start):
            if sum(bool(column_called(cell).quantity) for cell in rows[higher].cells if cell) > 1:
                return TestTableHead(tuple(names), higher, start, body)  # the same names in another language
            wider = _joined([row.cells for row in rows[higher:body]], meant)
            if _understood(wider, meant) > _understood(names, meant):
                return TestTableHead(tuple(wider), higher, start, body)
        return TestTableHead(tuple(names), start, start, body)
    return None


SAYS_RUPTURE = re.compile(r"rupture|zeitstand|bruchzeit|standzeit|time to failure|rott?ura", re.IGNORECASE)
"""In a title, or the name of a sheet or file, of a table whose times are those to rupture."""


def _with_rupture_times(names: Sequence[str], meant: Mapping[str, str]) -> list[str]:
    """The names of columns below a title that speaks of rupture: a time behind a stress is then that to rupture."""
    columns = [column_called(meant.get(name, name)) for name in names]
    at = _time_behind_stress(names, columns)
    return [f"rupture {name}" if k == at and name not in meant else name for k, name in enumerate(names)]


def _time_behind_stress(names: Sequence[str], columns: Sequence[TestColumn]) -> int | None:
    """The time in a table of nothing else but stresses, temperatures and what tests are called, behind the stress."""
    quantities = [one.quantity if name else None for name, one in zip(names, columns, strict=True)]
    if not {"stress", "end_time"} <= {*quantities} <= _BESIDE_A_TIME:
        return None
    at = quantities.index("end_time")
    return at if quantities.index("stress") < at else None


_BESIDE_A_TIME = frozenset((None, "stress", "temperature", "end_time", "name", "specimen", "alloy", "label heat"))


def _is_of_one_head(rows: Sequence[TableRow], below: int) -> bool:
    """Whether the row above another one belongs to its head: no empty line parts them, and it is no remark."""
    above = [cell for cell in rows[below - 1].cells if cell]
    is_remark = len(above) == 2 < sum(map(bool, rows[below].cells)) and kind_of_column(above[0]) == "remark"
    return rows[below].line - rows[below - 1].line == 1 and not is_remark


def _may_name(row: TableRow, dialect: Dialect) -> bool:
    filled = [cell for cell in row.cells if cell]
    is_head = len(set(filled)) > 1 or bool(unit_suffix(filled[0]))
    return is_head and not any(is_measured(cell, dialect) or _ASSIGNED.fullmatch(cell) for cell in filled)


def _understood(names: Sequence[str], meant: Mapping[str, str]) -> int:
    columns = [column_called(meant.get(name, name)) for name in names]
    is_in_unit = (one.quantity in QUANTITIES and one.unit in QUANTITIES[one.quantity].units for one in columns)
    return sum(bool(one.quantity) for one in columns) + sum(is_in_unit)


def _joined(rows: Sequence[Sequence[str]], meant: Mapping[str, str]) -> list[str]:
    """One name a column, with its unit, of the rows of a head."""
    width = max(len(cells) for cells in rows)
    padded = [[*cells, *[""] * (width - len(cells))] for cells in rows]
    above = [list(accumulate(cells, _filled)) for cells in padded[:-1]]
    return [_name_of(k, padded, above, meant) for k in range(width)]


def _filled(last: str, cell: str) -> str:
    return cell or last


def _name_of(k: int, rows: Sequence[Sequence[str]], above: Sequence[Sequence[str]], meant: Mapping[str, str]) -> str:
    """The name of one column: of its texts together, or of one of them, the first that is understood."""
    cells = list(dict.fromkeys(cells[k] for cells in rows if cells[k]))
    texts = [cell for cell in cells if not unit_suffix(cell)] or cells[:1]
    units = [cell.strip("()[] ") for cell in cells if cell not in texts and cell != "-"]
    if len(rows) == 1 or not texts:
        return "".join(texts)
    wide = dict.fromkeys(filter(None, (*(cells[k] for cells in above), rows[-1][k])))
    options = [" ".join(texts), *reversed(texts), " ".join(wide)]
    for text in options:
        own = unit_suffix(split_written_name(text)[1])
        is_reached = own == "pct" and bool(units) and unit_suffix(units[0]) in TIME.units
        name = f"{text} ({units[0]})" if units and (not own or is_reached) else text
        if text in meant or column_called(name).quantity:
            return name
    return f"{options[0]} ({units[0]})" if units else options[0]


def is_test_table(names: Sequence[str], rows: Sequence[TableRow] = ()) -> bool:
    """Whether names are those of tests: a stress or a temperature, and a rate, a rupture time or a time to a strain.

    Where each of the rows has its own name of a test, a strain beside its time is that at its end.
    """
    columns = [column_called(name) for name in names]
    found = {one.quantity for one in columns}
    is_named = any(_differ(rows, k) for k, one in enumerate(columns) if one.quantity in ("name", "specimen"))
    measured = not {"minimum_rate", "rupture"}.isdisjoint(found) or any(one.strain is not None for one in columns)
    rates = [unit for name, unit in map(split_written_name, names) if is_unit_of_rate(unit) or _is_rate(name)]
    measured |= any(unit_suffix(unit) in RATE.units for unit in rates) and "end_time" not in found
    measured |= any(one.quantity == f"label {name}" for one, name in zip(columns, names, strict=True))
    measured |= "end_time" in found and (is_named or any(kind_of_column(name) in FIRM for name in names))
    if (at := _time_behind_stress(names, columns)) is not None:  # no record begins after time zero so
        measured |= len(rows) > 1 and not any(
            re.fullmatch(r"0*[.,]?0*", row.cells[at]) for row in rows if len(row.cells) > at
        )
    is_framed = "end_time" in found and has_frames(names)
    return measured and not {"stress", "temperature"}.isdisjoint(found) and (is_named or not is_framed)


def _is_rate(name: str) -> bool:
    return RATES.search(plain_words(name)) is not None


def is_unit_of_rate(unit: str) -> bool:
    """Whether a unit is one of a rate alone, such as %/h."""
    return "/" in unit and unit_suffix(unit) in RATE.units


def _differ(rows: Sequence[TableRow], column: int) -> bool:
    """Whether no two of several rows have the same cell of a column."""
    cells = [row.cells[column] for row in rows if column < len(row.cells) and sum(map(bool, row.cells)) > 1]
    return len(cells) > 1 and len(set(cells)) == len(cells) and sum(map(bool, cells)) >= len(cells) - 1


def has_frames(names: Sequence[str]) -> bool:
    """Whether a column is a strain over time, and no rate, no time to it and none at rupture."""
    others = ("rate", "rupture", "fracture", "failure", "final")
    words = {name: set(words_of(name).split()) for name in names}
    strains = (name for name, one in words.items() if "strain" in one and one.isdisjoint(others))
    return any(column_called(name).strain is None for name in strains)


def stands_in_columns(table: CellTable, meant: Mapping[str, str]) -> bool:
    """Whether the first cells of the rows name what is known of tests, each of which stands in a column."""
    rows = table.rows[:_MOST_IN_COLUMNS]
    names = [row.cells[0] for row in rows if row.cells[0]]
    known = [bool(column_called(meant.get(name, name)).quantity) for name in names]
    filled = sum(sum(map(bool, row.cells)) > 2 for row in rows)
    return 2 * sum(known) > len(known) and 2 * filled > len(rows) and is_test_table(names)
