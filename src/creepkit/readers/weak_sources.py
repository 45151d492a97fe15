"""Conditions in titles and in names of sheets and files: weaker sources, which fill in what nothing else states.

They give way to an answer of tests.toml, and must agree with all else.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import without_uncertainty
from creepkit.readers.questions import ANSWERS_FILE
from creepkit.readers.table import CellTable, SourceText
from creepkit.readers.vocabulary import HeaderVocabulary, Terms, split_unit, unit_suffix
from creepkit.records.quantities import LENGTH

_NUMBER = r"[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?"
_UNIT = r"[^\W\d_][^\W_]*(?:/[^\W_]+(?:\^2)?)?|[°º℃℉]\s?[A-Za-z]?|deg\.? ?[A-Za-z]"
_VALUE = re.compile(rf"(?<![^\W_])(?<![.,])({_NUMBER})[ _]?({_UNIT})(?![^\W_]|°)")
_ASSIGNED = re.compile(rf"([^\W\d_][\w .'-]{{0,30}}?)\s*[=:]\s*({_NUMBER})\s*({_UNIT})(?![\w°])")


_RANGE = re.compile(r"(?<![^\W_])\d[\d.,]*\s*(?:to|bis|à|and|und|et|or|oder|-|–|/|,|;|\.\.\.?|…)\s*$", re.IGNORECASE)
"""What makes a number the last one of several."""


_NUMBERED = re.compile(
    r"(?:test|versuch|essai|prova|specimen|probe|sample|bar|run|heat|charge|alloy|inconel|incoloy|nimonic|haynes|type|no|nr)\.?\s*$",
    re.IGNORECASE,
)
"""What makes a number before a comma that of a test or an alloy, and none of a range: `Alloy 617, 800 °C`."""


_OF_THE_MATERIAL = re.compile(
    r"normali[sz]|temper(?:ed|ing)|anneal|(?<![^\W_])(?:ag(?:e?ing|ed)|cur(?:ed|ing))(?![^\W\d_])|solution|reflow|sinter"
    r"|quench|forg|\brolled|\bhip(?:ped)?\b|heat.?treat"
    r"|geglüht|vergütet|angelassen|lösungs|ausgelagert|wärmebehand|abgeschreckt|gehärtet|trempe|trempé|revenu|recuit"
    r"|(?<![^\W_])ht[ _:-]+\d|stress.?reliev|spannungsarm|gealtert|ausgehärtet"
    r"|normalizz|normalizad|rinven|ricott|solubiliz|temprat|bonificat|invecchi|revenid|recocid|templad|envejec"
    r"|vieilli|traitement|yield|strength|\buts\b|\brm\b|\brp|streckgrenze|festigkeit|melting|solidus|room temp",
    re.IGNORECASE,
)
"""Words of a text whose temperatures and stresses are those of a treatment or a property."""


_LOWEST, _ROOM = 100.0, 15.0
_AT_TEST = re.compile(r"(?:creep|kriech|fluage|test|versuch|essai)\w*\b.*(?:\bat|\bbei|à|@)\s*$", re.IGNORECASE)
"""Numbers of a temperature below which a text hardly means that of a creep test, unless it says so or calls it one; and
below which the name of a file or sheet does not, as of a solder, `SAC_25C`."""


TEMPERATURE_AGREEMENT, LOAD_AGREEMENT = 3.0, 0.03
"""K, and a fraction of the load, by which a nominal value may differ from a measured one."""


def conditions_of_head(cell: str, known: Terms) -> list[tuple[str, str]]:
    """Load and temperature of a head such as `120 MPa`, or `120 MPa / 650 °C`; [] where a part of it is neither.

    A load is a stress, where the file names no specimen that takes another one.
    """
    text = " ".join(without_uncertainty(cell).split())
    found = [(_quantity_of(match[2], known), f"{match[1]} {match[2]}") for match in _VALUE.finditer(text)]
    quantities = [quantity for quantity, _ in found]
    is_all = not _VALUE.sub("", text).strip(" ,;/|@()-–")
    return found if is_all and all(quantities) and len(set(quantities)) == len(quantities) else []


def _quantity_of(unit: str, known: Terms) -> str:
    suffix, kinds = unit_suffix(unit), known.condition_kinds
    loads = known.own_loads or (("pressure",) if suffix == "bar" else ("stress",))
    names = (name for name in ("temperature", *loads) if name in kinds and suffix and suffix in kinds[name].units)
    return next(names, "")


def conditions_in_text(text: str, place: str, known: Terms, *, is_name: bool = False) -> list[SourceText]:
    """Temperature and load that a text states, once each, and lengths such as `L0 = 40 mm`, each with its key.

    [] for what is said of a heat treatment or of a strength, and for ranges such as `110 to 180 MPa`. is_name : whether
    it is the name of a file or sheet.
    """
    found, text = dict[str, list[str]](), without_uncertainty(text)
    if _OF_THE_MATERIAL.search(text):
        return []

    def take(match: re.Match[str]) -> str:
        name, suffix = known.condition(match[1].split(",")[-1].strip()), unit_suffix(match[3])
        kind = known.conditions.kinds.get(name)
        if kind is None:
            return (
                match[0] if match[0].count(":") else " ; "
            )  # "L1-1: 40 bar" names a test, "R = 40 MPa" another stress
        if suffix in kind.units:
            found.setdefault(name, []).append(f"{match[2]} {match[3]}")
        return " ; "

    rest = _ASSIGNED.sub(take, text)
    is_all = not _VALUE.sub("", rest).strip(" ,;/|@()-–_")  # a sheet called "25 °C"
    for match in _VALUE.finditer(rest):
        quantity = _quantity_of(match[2], known)
        several = _RANGE.search(rest[: match.start()])
        is_range = several is not None and not _NUMBERED.search(rest[: several.start()])
        number = float(match[1].replace(",", "."))
        is_at = is_all or _AT_TEST.search(rest[: match.start()]) is not None
        is_at |= is_name and number >= _ROOM and "temperature" not in found
        if unit_suffix(match[2]) in ("GPa", "Pa") or (quantity == "temperature" and number < _LOWEST and not is_at):
            continue
        if quantity:
            found.setdefault(quantity, []).extend([f"{match[1]} {match[2]}"] * (1 + is_range))
    return [SourceText(values[0], place, key=name) for name, values in found.items() if len(values) == 1]


def sources_of_names(grid: CellTable, vocabulary: HeaderVocabulary) -> list[SourceText]:
    """What the names of sheet and file state of a test."""
    known, path = vocabulary.terms(), grid.path
    named = ((grid.sheet, f"name of sheet '{grid.sheet}'"), (path.stem, "name of the file"))
    return [one for text, what in named for one in conditions_in_text(text, f"{path}, {what}", known, is_name=True)]


def with_weak_sources(
    entries: Mapping[str, SourceText], table: CellTable, known: Terms
) -> tuple[dict[str, SourceText], list[str]]:
    """Entries with what titles and names state beside them, and what is assumed so; HistoryError where two disagree.

    entries, table : under creepkit's names.
    """
    result, assumptions = dict(entries), list[str]()
    taken: dict[str, tuple[float, str]] = {}
    for source in table.sources:
        quantity, kind = source.key, known.conditions.kinds[source.key]
        text, unit = source.text.replace(",", ".").split(" ", 1)
        suffix = unit_suffix(unit) or unit
        value = kind.convert(float(text), suffix, source.location, quantity)
        other = taken.get(quantity) or _stated(quantity, result, table, known)
        where = source.location.removeprefix(str(table.path)).lstrip(":, ")
        if other is not None:
            if abs(value - other[0]) <= _tolerance(quantity, other[0]):
                continue
            if f"{ANSWERS_FILE} [" not in other[1]:
                what = f"states a {quantity} of {quoted(source.text, 20)}, but {other[1]}"
                raise HistoryError(f"{source.location}: {what}; correct one of them")
            assumptions.append(f"{quantity} of {ANSWERS_FILE} and not {source.text} from {where}".replace(", ", " "))
            continue
        if _is_stated_otherwise(quantity, result, table, known):
            continue
        taken[quantity] = (value, f"{source.location} states {source.text}")
        result[f"{quantity}_{suffix}"] = SourceText(text, source.location, key=quantity)
        assumptions.append(f"{quantity} {source.text} from {'line ' * where.isdigit()}{where}".replace(", ", " "))
    return result, assumptions


def _stated(
    quantity: str, entries: Mapping[str, SourceText], table: CellTable, known: Terms
) -> tuple[float, str] | None:
    """What is stated or was recorded of a quantity, with where; None for what changes or is not there."""
    kind = known.conditions.kinds[quantity]
    for key, entry in entries.items():
        found = split_unit(key, known.conditions.kinds)
        if found and found[0] == quantity and found[1] in kind.units:
            return kind.convert(
                entry.number(key), found[1], entry.location, key
            ), f"{entry.location} states {entry.text}"
    for name in table.columns:
        found = split_unit(name, known.columns.kinds)
        if found and found[0] == quantity and found[1] in kind.units:
            unit = kind.units[found[1]]
            low, middle, high = unit.factor * np.percentile(table.numbers(name), (10, 50, 90)) + unit.offset
            held = high - low <= max(_tolerance(quantity, float(middle)), 0.0)
            where = table.location(table.columns_line)
            return (float(middle), f"the column '{name}' of {where} holds {middle:g}") if held else None
    return None


_OF_AREA = ("area", "diameter", "width")
"""What lengths of a cross-section begin with."""


def _is_stated_otherwise(quantity: str, entries: Mapping[str, SourceText], table: CellTable, known: Terms) -> bool:
    """Whether steps, programs, columns or another load leave nothing to state."""
    names, terms = [*entries, *table.columns], known
    if any(name == quantity or name.startswith(f"{quantity}_") for name in names):
        return True
    if quantity not in terms.load_kinds:
        return False
    others = [(split_unit(name, terms.load_kinds) or ("", ""), name in entries) for name in names]
    if quantity == "stress" and not any(name.startswith(_OF_AREA) for name in entries):
        others = [(found, is_entry) for found, is_entry in others if found[0] != "force"]  # is none without an area
    forms = ("steps", "program", "1", *LENGTH.units)
    return any(
        load and (is_entry or load in terms.number_kinds) and (unit in forms or unit in terms.load_kinds[load].units)
        for (load, unit), is_entry in others
    )


def _tolerance(quantity: str, value: float) -> float:
    return TEMPERATURE_AGREEMENT if quantity == "temperature" else LOAD_AGREEMENT * abs(value)
