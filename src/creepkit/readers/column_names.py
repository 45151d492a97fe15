"""Names of columns and conditions as laboratories write them, `Time (h)`, `Strain [%]`, `T_F`, in creepkit's form."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from creepkit.readers.vocabulary import HeaderVocabulary, Terms, split_unit
from creepkit.records.quantities import LENGTH, QuantityKind

UNIT_SPELLINGS: Mapping[str, str] = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), "min"),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours"), "h"),
    **dict.fromkeys(("d", "day", "days"), "d"),
    **dict.fromkeys(("%", "pct", "percent", "per cent"), "pct"),
    **dict.fromkeys(("1", "-", "mm/mm", "m/m", "in/in", "fraction"), "1"),
    **dict.fromkeys(("microstrain", "µstrain", "μstrain", "ustrain", "µm/m", "μm/m", "um/m"), "microstrain"),
    **dict.fromkeys(("k", "kelvin"), "K"),
    **dict.fromkeys(("c", "°c", "ºc", "℃", "degc", "deg c", "deg. c", "celsius"), "C"),
    **dict.fromkeys(("f", "°f", "ºf", "℉", "degf", "deg f", "deg. f", "fahrenheit"), "F"),
    **dict.fromkeys(("mpa", "n/mm2", "n/mm²", "n/mm^2", "mn/m2"), "MPa"),
    **{"pa": "Pa", "kpa": "kPa", "gpa": "GPa", "bar": "bar", "psi": "psi", "ksi": "ksi", "msi": "Msi"},
    **dict.fromkeys(("mm", "millimetre", "millimeter"), "mm"),
    **dict.fromkeys(("um", "µm", "μm", "micron", "microns"), "um"),
    **dict.fromkeys(("in", "inch", "inches"), "in"),
    **{"m": "m", "n": "N", "kn": "kN", "lbf": "lbf", "nmm": "Nmm", "nm": "Nm"},
    **{"rad": "rad", "deg": "deg", "°": "deg"},
}
"""{spelling in small letters: creepkit's suffix}. Capitals do not matter but where they tell units apart."""


_CAPITALS_THAT_MATTER = frozenset(("mPa", "M", "nm", "mN", "Mn", "Pct"))
"""Spellings that in other capitals mean another unit, millipascal or nanometre: they are not understood."""


NAME_SYNONYMS: Mapping[str, str] = {
    **dict.fromkeys(("elapsed time", "time elapsed", "test time", "creep time"), "time"),
    **dict.fromkeys(("temp", "temp.", "test temperature", "test temp", "creep temperature"), "temperature"),
    **dict.fromkeys(("applied stress", "nominal stress", "initial stress", "creep stress"), "stress"),
    **dict.fromkeys(
        ("creep strain", "total strain", "engineering strain", "true strain", "logarithmic strain"), "strain"
    ),
    **dict.fromkeys(("young's modulus", "youngs modulus", "elastic modulus"), "modulus"),
    **dict.fromkeys(("poisson's ratio", "poissons ratio", "poisson ratio"), "poisson"),
    **dict.fromkeys(("rupture time", "time to rupture", "rupture life"), "rupture"),
    **dict.fromkeys(("standard deviation of strain", "strain standard deviation"), "strain_sd"),
    **{"material": "alloy", "test name": "name", "test id": "name", "test": "name"},
}
"""{name in small letters: quantity or text key}."""


SYMBOLS: Mapping[str, str] = {
    **{"t": "time", "T": "temperature", "σ": "stress", "sigma": "stress", "ε": "strain", "epsilon": "strain"},
    **{"p": "pressure", "P": "pressure", "E": "modulus", "ν": "poisson", "nu": "poisson"},
}
"""{symbol: quantity}; capitals matter."""


STATED_BY_NAME: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(("true strain", "logarithmic strain"), ("strain_measure", "logarithmic")),
    "engineering strain": ("strain_measure", "engineering"),
    "total strain": ("includes_elastic", "yes"),
    "creep strain": ("includes_elastic", "no"),
}
"""{name of a column in small letters: key and text of the condition that it states}."""


_IN_BRACKETS = re.compile(r"([^()\[\]]*)[(\[]([^()\[\]]*)[)\]]\s*([^()\[\]]*)")


def unit_suffix(text: str) -> str | None:
    """creepkit's suffix of a unit as it is written, None where it is no unit that is known."""
    text = text.strip().strip("()[]").strip()
    return None if text in _CAPITALS_THAT_MATTER else UNIT_SPELLINGS.get(text.lower())


def split_written_name(text: str) -> tuple[str, str]:
    """Name and unit as written, ("Time", "h") of `Time (h)`, `Time [h]`, `Time / h`, `Time, h`, `Time_h`, `Time in h`.

    The unit is "" where there is none; what stands in brackets at the end is one even where it is not known.
    """
    text = " ".join(text.split())
    if match := _IN_BRACKETS.fullmatch(text):
        name, unit, rest = (part.strip() for part in match.groups())
        if not rest or unit_suffix(unit):
            return f"{name} {rest}".strip(), unit
    for separator in ("/", ",", " in ", " ", "_"):
        name, found, unit = text.partition(separator) if separator == "/" else text.rpartition(separator)
        if found and name and unit_suffix(unit):
            return name.strip(" ,_/"), unit.strip()
    return text, ""


def words_of(name: str) -> str:
    """A name in small letters, with single blanks between its words."""
    return " ".join(name.replace("_", " ").lower().split())


def quantity_named(name: str, known: Collection[str]) -> str | None:
    """The quantity, or the key of a text, that a name without its unit means; None when it means none."""
    if name in known:
        return name
    meaning = SYMBOLS.get(name) or NAME_SYNONYMS.get(words_of(name))
    if meaning in known:
        return meaning
    return next((one for one in known if words_of(one) == words_of(name)), None)


def standard_name(text: str, kinds: Mapping[str, QuantityKind], text_keys: Collection[str] = ()) -> str:
    """creepkit's name, `time_h` of `Time (h)`, where one is meant; else the text as it is."""
    exact = split_unit(text, kinds)
    if text in text_keys or (exact and exact[1] in kinds[exact[0]].units):
        return text
    name, unit = split_written_name(text)
    quantity = quantity_named(name, {*kinds, *text_keys})
    if quantity is None or (unit and quantity not in kinds):
        return text
    return f"{quantity}_{unit_suffix(unit) or unit}" if unit else quantity


TEST_NAME_COLUMNS = ("test", "test id", "test name", "test no", "test number", "sample", "sample id", "specimen id")
"""Names, in small letters, of columns and rows that tell which test it is where a table holds several."""


LABEL_NAMES = ("heat", "laboratory")
"""Labels that are understood without the word `label`."""


@dataclass(frozen=True)
class KnownNames:
    """What names of columns and conditions in one file may mean."""

    vocabulary: HeaderVocabulary
    terms: Terms
    column_kinds: Mapping[str, QuantityKind]
    condition_kinds: Mapping[str, QuantityKind]
    text_keys: Collection[str]

    @classmethod
    def of(cls, vocabulary: HeaderVocabulary, specimen: str = "") -> KnownNames:
        """The names of a file; specimen : that it states."""
        terms = vocabulary.terms(specimen or vocabulary.default_texts.get("specimen", ""))
        lengths = dict.fromkeys(terms.dimensions, LENGTH)
        return cls(vocabulary, terms, terms.column_kinds, {**lengths, **terms.condition_kinds}, terms.text_keys)

    def column(self, name: str) -> str:
        """A name of a column in creepkit's form, where it is understood."""
        return name if name in self.declared else standard_name(name, self.column_kinds)

    def quantity(self, name: str) -> str | None:
        """The quantity of a column, None where its name means none."""
        found = split_unit(self.column(self.vocabulary.synonyms.get(name, name)), self.column_kinds)
        return found[0] if found else None

    def condition(self, name: str) -> str:
        """A name of a condition in creepkit's form, where it is understood."""
        words = words_of(name)
        if name in self.vocabulary.synonyms or name.startswith(("label ", "geometry ")):
            return name
        if words in (*TEST_NAME_COLUMNS, "specimen name"):
            return "name"
        if words in LABEL_NAMES:
            return f"label {words}"
        return "strain_unit" if words == "strain unit" else standard_name(name, self.condition_kinds, self.text_keys)

    def is_condition(self, name: str) -> bool:
        """Whether a name is that of a condition."""
        standard = self.condition(name)
        return (
            standard in (*self.text_keys, "strain_unit", *self.vocabulary.synonyms)
            or split_unit(standard, self.condition_kinds) is not None
            or standard.startswith(("label ", "geometry "))
        )

    @property
    def declared(self) -> set[str]:
        """Names of columns that the vocabulary declares, which mean what it says."""
        averaged = (name for names in self.vocabulary.averaged_columns.values() for name in names)
        return {*self.vocabulary.synonyms, *averaged}
