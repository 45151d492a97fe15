"""The vocabulary: names of quantities and conditions, their units, and how a laboratory's own terms map to them.

Names as laboratories write them, `Time (h)`, `Strain [%]`, `T_F`, are brought into creepkit's form, such as
`stress_MPa`, which states quantity and unit; inside there are only MPa, mm, s and K.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher, get_close_matches
from functools import cached_property, lru_cache

from creepkit.readers.names import NAME_SYNONYMS, NAMES_OF, SYMBOLS
from creepkit.records import TENSOR_COMPONENTS, dimensions_of, known_specimens, loads_of, outputs_of
from creepkit.records.quantities import (
    AREA,
    FLAG,
    LENGTH,
    MODULUS,
    POISSON,
    RATE,
    SIGNED_STRESS,
    STRAIN,
    STRESS,
    TEMPERATURE,
    TIME,
    QuantityKind,
)
from creepkit.records.specimen_record import Output
from creepkit.records.units import CAPITALS_THAT_MATTER, UNITS, spellings


@lru_cache(maxsize=4096)
def plain_name(name: str) -> str:
    """A name in small letters, with underscores for blanks, hyphens, points and what sets a unit apart."""
    return re.sub(r"[\s_\-.()\[\],]+", "_", name.strip().casefold().replace("’", "'")).strip("_")


def split_unit(name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str] | None:
    """Split `stress_MPa` into the longest known quantity and the unit behind it; None when it begins with none."""
    found = max((one for one in kinds if name == one or name.startswith(f"{one}_")), key=len, default=None)
    return None if found is None else (found, name[len(found) + 1 :])


UNIT_SPELLINGS: Mapping[str, str] = {spelling.lower(): symbol for spelling, symbol in spellings(*UNITS).items()}
"""{spelling in small letters: creepkit's suffix}. Capitals do not matter but where they tell units apart."""


_IN_BRACKETS = re.compile(r"([^()\[\]]*)[(\[]((?:[^()\[\]]|\(\w*\))*)[)\]]\s*([^()\[\]]*)")


_PARTS_OF_UNIT = 8
"""Into which a unit may be divided by a separator, as `mm / mm` is."""


_RATE_UNIT = re.compile(
    r"(1|-|%|pct|percent|mm/mm|m/m|)\s*(?:(/|per )\s*)?([a-z]+|(?:1000|10\^?3) ?h(?:rs?|ours)?)(\^?[({]?-1[)}]?)?"
)
_ON_THE_LINE = str.maketrans("⁻⁰¹²³⁶·*", "-01236  ")
"""Exponents and products in a unit as they are typed."""


@lru_cache(maxsize=4096)
def unit_suffix(text: str) -> str | None:
    """creepkit's suffix of a unit as it is written, None where it is no unit that is known."""
    text = text.strip().strip("()[]").strip()
    if text in CAPITALS_THAT_MATTER:
        return None
    plain = text.lower()
    rate = _RATE_UNIT.fullmatch(plain.translate(_ON_THE_LINE))
    if (
        rate
        and ((rate[4] and not rate[2]) or rate[2] == "per " or (rate[1] and rate[2]))
        and (time := UNIT_SPELLINGS.get(rate[3])) in TIME.units
    ):
        return f"{'pct' if UNIT_SPELLINGS.get(rate[1]) == 'pct' else '1'}/{time}"
    return UNIT_SPELLINGS.get(plain)


_MEASURED = re.compile(r"\s*([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?) ?([^\s\d].*?)?\s*")


def value_in(text: str, kind: QuantityKind, unit: str = "") -> float | None:
    """A number with its unit, `36.75 h`, in creepkit's; None for any other text. unit : where the text has none."""
    match = _MEASURED.fullmatch(text)
    conversion = kind.units.get(unit_suffix(match[2] or unit) or "?") if match else None
    return conversion.factor * float(match[1].replace(",", ".")) + conversion.offset if match and conversion else None


_NUMBER_AND_UNIT = re.compile(
    r"(?P<before>[<>≥~≈]?\s*)(?P<number>[+-]?[\d.,]+(?:[eEdD][+-]?\d+)?)\s*(?P<unit>[^\s\d.,;()+-][^\s,;()]*)"
    r"(?P<after>[\s(].*)?"
)


def unit_behind(cell: str, kind: QuantityKind) -> str:
    """The unit of a kind that stands behind the number of a cell, `>3 days`; "" for none."""
    match = _NUMBER_AND_UNIT.fullmatch(cell)
    suffix = unit_suffix(match["unit"]) if match else None
    return suffix if suffix and suffix in kind.units else ""


def in_unit(cell: str, kind: QuantityKind, unit: str, decimal: str) -> str:
    """A cell such as `>3 days` in a unit of the kind, >72 in hours, without it; "" where that cannot be."""
    match, suffix = _NUMBER_AND_UNIT.fullmatch(cell), unit_behind(cell, kind)
    if match is None or not suffix or unit not in kind.units:
        return ""
    number = match["number"].replace(decimal, ".")
    if number.count(".") > 1 or "," in number:
        return ""
    one, other = kind.units[suffix], kind.units[unit]
    value = (one.factor * float(number) + one.offset - other.offset) / other.factor
    return f"{match['before']}{value:.10g}{match['after'] or ''}".replace(".", decimal)


def split_written_name(text: str, is_unit: Callable[[str], object] = unit_suffix) -> tuple[str, str]:
    """Name and unit as written, ("Time", "h") of `Time (h)`, `Time [h]`, `Time / h`, `Time, h`, `Time_h`, `Time in h`.

    The unit is "" where there is none; what stands in brackets at the end is one even where it is not known. is_unit :
    whether a text is a unit elsewhere.
    """
    text = " ".join(text.split())
    if match := _IN_BRACKETS.fullmatch(text):
        name, unit, rest = (part.strip() for part in match.groups())
        if not rest or is_unit(unit):
            return f"{name} {rest}".strip(" /"), unit
    for separator in (",", " in ", "_", " ", "/"):
        parts = text.split(separator)
        for k in range(max(1, len(parts) - _PARTS_OF_UNIT), len(parts)):
            name, unit = separator.join(parts[:k]), separator.join(parts[k:])
            # A blank before 1 sets a number apart, as of a sensor, and no unit.
            if name and is_unit(unit) and not (separator in " _" and unit.casefold() in ("1", "-", "std")):
                return name.strip(" ,_/"), unit.strip()
    return text, ""


def is_symbol(text: str, unit: str) -> bool:
    """Whether what stands behind a name as its unit may be its symbol, as in `Prüfkraft F`."""
    return len(unit) == 1 and unit.isupper() and text.rstrip(": ").endswith(f" {unit}")


def words_of(name: str) -> str:
    """A name in small letters, with single blanks between its words."""
    return plain_name(name).replace("_", " ")


@dataclass(frozen=True)
class NameTable:
    """What names may mean: quantities with their units, and texts.

    kinds : {quantity: kind}. texts : keys of texts. synonyms : {name in small letters: quantity or key}. symbols :
    {symbol: quantity}, whose capitals matter.
    """

    kinds: Mapping[str, QuantityKind]
    texts: Collection[str] = ()
    synonyms: Mapping[str, str] = field(default_factory=lambda: NAME_SYNONYMS)
    symbols: Mapping[str, str] = field(default_factory=lambda: SYMBOLS)

    @cached_property
    def _plain_names(self) -> dict[str, str]:
        """{name without its unit, in small letters: what it means}."""
        own = {plain_name(name): name for name in (*self.texts, *self.kinds)}
        return {**{plain_name(name): meaning for name, meaning in self.synonyms.items()}, **own}

    @cached_property
    def _plain_keys(self) -> dict[str, str]:
        """{name with its unit, in small letters with underscores: the same as creepkit writes it}."""
        return {
            plain_name(f"{name}_{unit}"): f"{name}_{unit}" for name in self.kinds for unit in self.kinds[name].units
        }

    def meaning(self, name: str) -> str | None:
        """The quantity, or the key of a text, that a name without its unit means; None when it means none.

        A name may have its symbol behind it, `Durchmesser d0`.
        """
        meant = self.symbols.get(name) or self._plain_names.get(plain_name(name))
        words, _, symbol = name.rpartition(" ")
        if meant is None and symbol in self.symbols:
            meant = self._plain_names.get(plain_name(words))
            meant = meant if meant == self.symbols[symbol] else None
        return meant if meant in self.kinds or meant in self.texts else None

    def standard(self, text: str) -> str:
        """creepkit's name, `time_h` of `Time (h)`, where one is meant; else the text as it is."""
        exact = split_unit(text, self.kinds)
        if text in self.texts or (exact and exact[1] in self.kinds[exact[0]].units):
            return text
        whole = self._plain_names.get(plain_name(text))  # `Time of day` is no time in days
        if not whole and len(text) > 3 and "time" in self.kinds and (suffix := unit_suffix(text)) in TIME.units:
            return f"time_{suffix}"
        name, unit = (text, "") if whole else split_written_name(text)
        quantity = self.meaning(name) if name != "D" or unit_suffix(unit) in LENGTH.units else None
        if quantity == "elongation" and unit_suffix(unit) in STRAIN.units:
            quantity = "strain"  # of its gauge length
        elif quantity == "strain" and unit_suffix(unit) in LENGTH.units and "elongation" in self.kinds:
            quantity = "elongation"
        elif quantity == "force" and unit_suffix(unit) in STRESS.units and "stress" in self.kinds:
            quantity = "stress"
        elif quantity and is_symbol(text, unit) and quantity in self.kinds and unit not in self.kinds[quantity].units:
            unit = ""
        if quantity is None or (unit and quantity not in self.kinds):
            last = re.split(r"[\s_\-()\[\],]+", text.strip(" )]"))[-1]
            return text if last in ("1", *CAPITALS_THAT_MATTER) else self._plain_keys.get(plain_name(text), text)
        return f"{quantity}_{unit_suffix(unit) or unit}" if unit else quantity


_NUMBERING = (
    r"names?|ids?|no|nr|(?<!\w)n|num(?:ber|mer|[ée]ro)?|nom|code|label|bezeichnung|kennung|r[ée]f[ée]rence|identif\w+"
    r"|sigla|codice|c[óo]digo|naam"
)
_OF_TESTS = re.compile(
    rf"(?:(?:{_NUMBERING}) )*(?:tests?|test piece|samples?|specimens?|proben?|pr[uü]fling|versuchs?|essai|[ée]prouvette"
    rf"|[ée]chantillon|rep[èe]re|provino|provetta|prova|campione|probeta|ensayo|muestra"
    rf"|proef(?:stuk|staaf)?|monster|staaf)(?: ?(?:{_NUMBERING}))*"
)


def names_tests(name: str) -> bool:
    """Whether a column or row of this name tells which test it is where a table holds several."""
    words = words_of(re.sub("[°º]", " ", name))
    return words != "specimen" and _OF_TESTS.fullmatch(words) is not None


# ---- what a laboratory and a specimen add ----------------------------------------------------------------------


def is_misspelling(name: str, known: str) -> bool:
    """Whether a name is a known one but for few letters that were left out, added, changed or swapped.

    One letter of three to six, two of seven to nine, three of more (a swap over a missing letter counts as three).
    """
    allowed = 0 if len(known) < 3 else 1 if len(known) < 7 else 2 if len(known) < 10 else 3
    if name == known or abs(len(name) - len(known)) > allowed or len(set(name) ^ set(known)) > 2 * allowed:
        return False
    matching = SequenceMatcher(None, name, known, autojunk=False).get_matching_blocks()
    return sum(block.size for block in matching) >= max(len(name), len(known)) - allowed


COMPONENT_LOADING_KINDS: Mapping[str, QuantityKind] = {
    **{f"stress_{c}": SIGNED_STRESS for c in TENSOR_COMPONENTS},
    **{f"strain_{c}": STRAIN for c in TENSOR_COMPONENTS},
}
"""What is prescribed at a material point: `_steps` or a `_program`."""


CONDITION_KINDS: Mapping[str, QuantityKind] = {
    "temperature": TEMPERATURE,
    **dict.fromkeys(("jump_time", "end_time", "ramp", "rupture", "loading_time"), TIME),
    "loading_strain": STRAIN,
    "area": AREA,
    "modulus": MODULUS,
    "poisson": POISSON,
    "minimum_rate": RATE,
    "minimum_rate_sd": RATE,
}
"""Numbers that stand once for a whole test, beside its loads."""


TEXT_KEYS = (
    *("name", "alloy", "specimen", "operator", "control", "strain_measure", "stress_measure"),
    *("includes_elastic", "includes_loading", "ended", "noise_correlation", "steps_taken_off", "thermal_expansion"),
    "modulus_by_temperature",
    *("decimal", "columns", "ignore", "strain_unit", "date_order", "time_zone"),
)
"""Words that stand once for a whole test, beside steps and programs; the last line says how its table is written."""


CLOSE_SPELLING = 0.8
"""Similarity above which an unknown name is a misspelt one."""


SPECIMEN_NAME_PATTERN = re.compile(r"[a-z][a-z0-9_-]*")
"""Pattern of the name of a specimen; any other text after `specimen` is a label, unless it is nearly such a name."""


CREEP_MACHINE_DEFAULTS: Mapping[str, str] = {
    "control": "load",
    "strain_measure": "engineering",
    "includes_elastic": "no",
}
"""Defaults of a creep machine with a dead load and an extensometer."""


@dataclass(frozen=True)
class HeaderVocabulary:
    """How a laboratory names things.

    synonyms : {its name: ours}, for columns and conditions alike, such as {"youngs_MPa": "modulus_MPa"}.
    default_texts : {text: value} for what its files leave out; recorded in the label "assumed".
    outputs : {specimen: {output: kind}} that its files hold beside those of the registered specimens.
    end_of_test_terms : {its word: "ruptured" or "stopped"} for how a test ended, beside these two themselves; in a
        column of rupture times such a word may stand in the place of a number.
    labels : its keys and columns that are kept as labels though nothing is known of them.
    ignored : columns, as they are written in its files, that are left out.
    stated : {key: text and place} of conditions that a file of answers beside a file states of its tests. of_tests :
        {name of a test: the same of that test alone}, `exclude` among its keys.
    """

    synonyms: Mapping[str, str] = field(default_factory=dict)
    default_texts: Mapping[str, str] = field(default_factory=lambda: CREEP_MACHINE_DEFAULTS)
    outputs: Mapping[str, Mapping[str, QuantityKind]] = field(default_factory=dict)
    end_of_test_terms: Mapping[str, str] = field(default_factory=dict)
    labels: Collection[str] = ()
    ignored: Collection[str] = ()
    stated: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    of_tests: Mapping[str, Mapping[str, tuple[str, str]]] = field(default_factory=dict)

    def terms(self, specimen: str = "") -> Terms:
        """What headers and columns of a file may say; specimen : that the file names, whose own terms then count most.

        A file that names none may use the terms of every registered specimen.
        """
        known, specimen = known_specimens(), specimen or self.default_texts.get("specimen", "")
        outputs = {name: {str(o): o.kind for o in outputs_of(one)} for name, one in known.items()} | dict(self.outputs)
        named = {specimen: known[specimen]} if specimen in known else dict(known)
        pieces = named if dimensions_of(known.get(specimen)) else known  # those of a bar give its stress and strain
        loads = {load.name: load.kind for one in (*known.values(), *named.values()) for load in loads_of(one)}
        return Terms(
            vocabulary=self,
            outputs=outputs,
            own_outputs=outputs.get(specimen, {}),
            loads={specimen: [load.name for load in loads_of(one)] for specimen, one in known.items()},
            load_kinds={name: kind for name, kind in loads.items() if name != "components"},
            own_loads=[load.name for one in named.values() for load in loads_of(one) if specimen in known],
            dimensions={name: d.name for one in pieces.values() for d in dimensions_of(one) for name in d.names},
            own_dimensions=[name for d in dimensions_of(known.get(specimen)) for name in d.names],
            changes=[(name, o) for name in named for o in outputs_of(known[name]) if o.change_of],
        )


_AT_TEMPERATURE = re.compile(
    r"(?P<name>.+?)[\s,(\[@]+(?:(?:at|bei|à|a)\s+)?(?P<number>\d+(?:[.,]\d+)?) ?(?P<degrees>(?:°|º|deg\.?)? ?[CKF])"
    r"[)\]]?(?:[\s,/(\[]+(?P<unit>[GM]Pa|ksi|Msi)[)\]]?)?"
)
"""A quantity at a temperature, `E (650 °C)`, `Young's modulus at 650 °C [GPa]`."""


@dataclass(frozen=True)
class Terms:
    """What the heads and columns of one file may say, and what names in it mean.

    outputs : {specimen: {output: kind}}; own_outputs : those of the specimen that the file names, {} where it names
    none. loads : {specimen: names}. load_kinds : {load: kind} of those that are stated by one number or program;
    own_loads : those of the specimen that the file names, none where it names none.
    dimensions : {name or alias: length of a test piece}; own_dimensions : of the specimen that the file names.
    changes : specimens and their outputs that are the change of a length.
    """

    vocabulary: HeaderVocabulary
    outputs: Mapping[str, Mapping[str, QuantityKind]]
    own_outputs: Mapping[str, QuantityKind]
    loads: Mapping[str, Sequence[str]]
    load_kinds: Mapping[str, QuantityKind]
    own_loads: Sequence[str]
    dimensions: Mapping[str, str]
    own_dimensions: Sequence[str]
    changes: Sequence[tuple[str, Output]]

    @cached_property
    def number_kinds(self) -> dict[str, QuantityKind]:
        """Loads whose column is a record of what was imposed, whichever specimen it was: none of those without unit."""
        return {name: kind for name, kind in self.load_kinds.items() if "" not in kind.units}

    @cached_property
    def condition_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all numbers that stand once for a test."""
        stepped = {**self.number_kinds, "temperature": TEMPERATURE}
        levels = {f"{name}_{k}": kind for name, kind in stepped.items() for k in (1, 2)}
        return {**CONDITION_KINDS, **self.load_kinds, **levels, **self._standard_deviation_kinds()}

    @cached_property
    def column_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all columns of frames."""
        return {
            **{"time": TIME, **self.output_kinds(), **self._standard_deviation_kinds(), **self.number_kinds},
            **self.own_outputs,
            **{"temperature": TEMPERATURE, "used": FLAG, **self.length_kinds},
        }

    @cached_property
    def length_kinds(self) -> dict[str, QuantityKind]:
        """Lengths of a test piece that a column may hold over time, and the relative change of a diameter."""
        lengths = dict.fromkeys((output.change_of.lstrip("-") for _, output in self.changes), LENGTH)
        return {**lengths, "diameter": LENGTH, "diametral_strain": STRAIN}

    @cached_property
    def text_keys(self) -> set[str]:
        """Words that stand once for a whole test."""
        programs = (*self.load_kinds, "temperature", *COMPONENT_LOADING_KINDS)
        forms = {f"{name}_{form}" for name in programs for form in ("steps", "program")}
        return {*TEXT_KEYS, *forms, *(f"stated_{name}_program" for name in (*self.number_kinds, "temperature"))}

    @cached_property
    def columns(self) -> NameTable:
        """What names of columns may mean."""
        return NameTable(self.column_kinds)

    @cached_property
    def conditions(self) -> NameTable:
        """What names of conditions may mean."""
        return NameTable({**dict.fromkeys(self.dimensions, LENGTH), **self.condition_kinds}, self.text_keys)

    def column(self, name: str) -> str:
        """A name of a column in creepkit's form, where it is understood."""
        return name if name in self.vocabulary.synonyms else self.columns.standard(name)

    def quantity(self, name: str) -> str | None:
        """The quantity of a column, None where its name means none."""
        found = split_unit(self.column(self.vocabulary.synonyms.get(name, name)), self.columns.kinds)
        return found[0] if found else None

    def may_state(self, name: str) -> bool:
        """Whether a column of frames may hold a condition, the same in all of them."""
        return self.quantity(name) in (None, "temperature", *self.number_kinds, *self.length_kinds)

    def condition(self, name: str) -> str:
        """A name of a condition in creepkit's form, where it is understood."""
        written, unit = split_written_name(name)
        label = NAME_SYNONYMS.get(words_of(written), "")
        if name in self.vocabulary.synonyms or name in self.vocabulary.labels:
            return name
        if name.startswith(("label ", "geometry ")):
            return name
        if (at := _AT_TEMPERATURE.fullmatch(name)) and self.conditions.meaning(at["name"].strip()) == "modulus":
            return f"modulus_at {at['number']} {at['degrees']}|{at['unit'] or ''}"
        if names_tests(name):
            return "name"
        is_label = label.startswith("label ") and unit_suffix(unit) == ("pct" if unit else None)
        return label if is_label else self.conditions.standard(name)

    def is_condition(self, name: str) -> bool:
        """Whether a name is that of a condition."""
        standard = self.condition(name)
        return (
            standard in (*self.conditions.texts, *self.vocabulary.synonyms)
            or split_unit(standard, self.conditions.kinds) is not None
            or standard.startswith(("label ", "geometry "))
        )

    def misspelt(self, name: str) -> str:
        """The key of which an unknown name is a misspelling; "" for none."""
        plain, keys = plain_name(name), self._keys_by_name
        written = {plain, name.casefold()}  # with what stands before a unit that was left out
        if misspelt := [known for known in keys if any(is_misspelling(one, known) for one in written)]:
            return keys[get_close_matches(plain, misspelt, 1, cutoff=0.0)[0]]
        words = {plain, plain.rpartition("_")[0]}
        names = (name for name in self.condition_kinds for word in words if is_misspelling(word, name.casefold()))
        return next(names, "")

    def suggestion(self, name: str) -> str:
        """The key that an unknown name may have meant, "" where it resembles none."""
        near = get_close_matches(plain_name(name), self._keys_by_name, 1, cutoff=CLOSE_SPELLING)
        return self.misspelt(name) or (self._keys_by_name[near[0]] if near else "")

    @cached_property
    def _keys_by_name(self) -> dict[str, str]:
        """{name in small letters: key}."""
        return {plain_name(key): key for key in self.head_keys()}

    def head_keys(self) -> Iterator[str]:
        """Keys of numbers with their units, of texts, of lengths and of labels, creepkit's own units first."""
        for quantity, kind in self.condition_kinds.items():
            yield from (f"{quantity}_{unit}" if unit else quantity for unit in kind.units)
        yield from sorted(self.text_keys)
        yield from (name for key in ("heat", "laboratory", "operator") for name in NAMES_OF[f"label {key}"])
        for dimension in self.dimensions:
            yield from (f"{dimension}_{unit}" for unit in LENGTH.units)

    def specimens_with(self, columns: Collection[str]) -> list[str]:
        """The specimens of which some output is among the columns."""
        return [name for name, outputs in self.outputs.items() if not outputs.keys().isdisjoint(columns)]

    def output_kinds(self) -> dict[str, QuantityKind]:
        """The outputs of all specimens."""
        return {name: kind for outputs in self.outputs.values() for name, kind in outputs.items()}

    def _standard_deviation_kinds(self) -> dict[str, QuantityKind]:
        kinds = {**self.output_kinds(), **self.own_outputs}
        return {f"{name}_sd": kind.standard_deviation() for name, kind in kinds.items()}
