"""Names of columns and conditions as laboratories write them, `Time (h)`, `Strain [%]`, `T_F`, in creepkit's form."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

from creepkit.records.quantities import (
    ANGLE,
    AREA,
    FORCE,
    LENGTH,
    MODULUS,
    MOMENT,
    STRAIN,
    STRESS,
    TEMPERATURE,
    TIME,
    QuantityKind,
)
from creepkit.records.units import CAPITALS_THAT_MATTER, UNITS, spellings


@lru_cache(maxsize=4096)
def plain_name(name: str) -> str:
    """A name in small letters, with underscores for blanks, hyphens, points and what sets a unit apart."""
    return re.sub(r"[\s_\-.()\[\],]+", "_", name.strip().casefold()).strip("_")


def split_unit(name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str] | None:
    """Split `stress_MPa` into the longest known quantity and the unit behind it; None when it begins with none."""
    found = max((one for one in kinds if name == one or name.startswith(f"{one}_")), key=len, default=None)
    return None if found is None else (found, name[len(found) + 1 :])


_READ = dict.fromkeys(
    suffix
    for kind in (TIME, STRAIN, TEMPERATURE, STRESS, MODULUS, LENGTH, FORCE, MOMENT, ANGLE, AREA)
    for suffix in kind.units
    if suffix in UNITS
)
"""Units that some column or condition may be in."""


UNIT_SPELLINGS: Mapping[str, str] = {spelling.lower(): symbol for spelling, symbol in spellings(*_READ).items()}
"""{spelling in small letters: creepkit's suffix}. Capitals do not matter but where they tell units apart."""


NAMES_OF: Mapping[str, tuple[str, ...]] = {
    "time": (
        *("elapsed time", "time elapsed", "test time", "creep time", "time under load", "zeit", "prüfzeit", "laufzeit"),
        *("belastungszeit", "beanspruchungsdauer", "versuchszeit", "temps", "durée", "temps écoulé", "x_value"),
        *("timestamp", "time stamp", "datetime", "date time", "date/time", "time of day", "uhrzeit"),
    ),
    "temperature": (
        *("temp", "test temperature", "test temp", "creep temperature", "specimen temperature", "sample temperature"),
        *("furnace", "furnace temperature", "oven temperature", "temperatur", "prüftemperatur", "versuchstemperatur"),
        *("probentemperatur", "ofen", "ofentemperatur", "température", "température d'essai", "four", "temp ctrl"),
    ),
    "stress": (
        *("applied stress", "nominal stress", "initial stress", "creep stress", "test stress", "engineering stress"),
        *("remaining stress", "residual stress", "relaxed stress", "restspannung", "spannung", "prüfspannung"),
        *("nennspannung", "anfangsspannung", "contrainte", "contrainte initiale"),
    ),
    "pressure": ("druck", "prüfdruck", "innendruck", "pression"),
    "strain": (
        *("creep strain", "total strain", "engineering strain", "true strain", "logarithmic strain", "dehnung"),
        *("kriechdehnung", "gesamtdehnung", "zeitdehnung", "plastische dehnung", "bleibende dehnung", "déformation"),
        *("déformation de fluage", "allongement relatif", "deformation relative"),
    ),
    "loading_strain": ("anfangsdehnung",),
    "force": (
        *("load", "applied load", "axial load", "axial force", "tensile load", "tensile force", "load cell", "kraft"),
        *("prüfkraft", "standardkraft", "last", "zugkraft", "effort", "force axiale"),
    ),
    "elongation": (
        *("extension", "creep extension", "extensometer", "gauge extension", "axial extension", "verlängerung"),
        *("tensile extension", "axial extensometer", "strain gauge extension", "extensometer extension"),
        *("längenänderung", "allongement"),
    ),
    "modulus": (
        *("young's modulus", "youngs modulus", "elastic modulus", "e modul", "elastizitätsmodul", "module d'young"),
    ),
    "poisson": ("poisson's ratio", "poissons ratio", "poisson ratio"),
    "rupture": ("rupture time", "time to rupture", "rupture life", "bruchzeit", "standzeit", "temps à rupture"),
    "strain_sd": ("standard deviation of strain", "strain standard deviation"),
    "diameter": (
        *("specimen diameter", "sample diameter", "initial diameter", "gauge diameter", "durchmesser"),
        *("probendurchmesser", "anfangsdurchmesser", "diamètre", "diamètre initial"),
    ),
    "gauge_length": (
        *("gage length", "initial gauge length", "original gauge length", "reference length", "messlänge"),
        *("anfangsmesslänge", "messbasis", "longueur utile", "longueur de base", "longueur de référence"),
    ),
    "width": ("specimen width", "breite", "probenbreite", "largeur"),
    "thickness": ("specimen thickness", "dicke", "probendicke", "épaisseur"),
    "area": (
        *("cross section", "cross-section", "cross-sectional area", "cross section area", "initial area"),
        *("querschnitt", "querschnittsfläche", "anfangsquerschnitt", "section", "section initiale"),
    ),
    "alloy": ("material", "werkstoff", "matériau", "alliage", "legierung"),
    "name": ("test name", "test id", "test"),
}
"""{quantity or text key: its names in small letters}."""


NAME_SYNONYMS: Mapping[str, str] = {name: meaning for meaning, names in NAMES_OF.items() for name in names}
"""{name in small letters: quantity or text key}."""


SYMBOLS: Mapping[str, str] = {
    **{"t": "time", "T": "temperature", "σ": "stress", "sigma": "stress", "ε": "strain", "epsilon": "strain"},
    **{"p": "pressure", "P": "pressure", "E": "modulus", "ν": "poisson", "nu": "poisson"},
    **{"F": "force", "ΔL": "elongation", "Δl": "elongation", "ΔL0": "elongation", "dL": "elongation"},
    **dict.fromkeys(("σ0", "σo", "σ₀", "R0", "Ro", "sig"), "stress"),
    **dict.fromkeys(("eps", "ε_c", "εc", "ε_cr"), "strain"),
    **dict.fromkeys(("d0", "D0", "ø", "Ø", "⌀"), "diameter"),
    **dict.fromkeys(("L0", "l0", "Lo", "Le", "Lr0"), "gauge_length"),
    **dict.fromkeys(("S0", "A0", "So", "Ao"), "area"),
}
"""{symbol: quantity}; capitals matter."""


STATED_BY_NAME: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(("true strain", "logarithmic strain"), ("strain_measure", "logarithmic")),
    "engineering strain": ("strain_measure", "engineering"),
    **dict.fromkeys(("total strain", "gesamtdehnung"), ("includes_elastic", "yes")),
    **dict.fromkeys(("creep strain", "kriechdehnung"), ("includes_elastic", "no")),
    **dict.fromkeys(("plastische dehnung", "bleibende dehnung"), ("includes_elastic", "no")),
}
"""{name of a column in small letters: key and text of the condition that it states}."""


_IN_BRACKETS = re.compile(r"([^()\[\]]*)[(\[]([^()\[\]]*)[)\]]\s*([^()\[\]]*)")


_PARTS_OF_UNIT = 8
"""Into which a unit may be divided by a separator, as `mm / mm` is."""


_RATE_UNIT = re.compile(r"(1|-|%|pct|percent|mm/mm|m/m|)\s*(?:(/|per )\s*)?([a-z]+|(?:1000|10\^?3|10³) ?h)(\^?-1)?")


@lru_cache(maxsize=4096)
def unit_suffix(text: str) -> str | None:
    """creepkit's suffix of a unit as it is written, None where it is no unit that is known."""
    text = text.strip().strip("()[]").strip()
    if text in CAPITALS_THAT_MATTER:
        return None
    plain = text.lower()
    rate = _RATE_UNIT.fullmatch(plain)
    if (
        rate
        and (rate[4] or rate[2] == "per " or (rate[1] and rate[2]))
        and (time := UNIT_SPELLINGS.get(rate[3])) in TIME.units
    ):
        return f"{'pct' if UNIT_SPELLINGS.get(rate[1]) == 'pct' else '1'}/{time}"
    return UNIT_SPELLINGS.get(plain)


def split_written_name(text: str) -> tuple[str, str]:
    """Name and unit as written, ("Time", "h") of `Time (h)`, `Time [h]`, `Time / h`, `Time, h`, `Time_h`, `Time in h`.

    The unit is "" where there is none; what stands in brackets at the end is one even where it is not known.
    """
    text = " ".join(text.split())
    if match := _IN_BRACKETS.fullmatch(text):
        name, unit, rest = (part.strip() for part in match.groups())
        if not rest or unit_suffix(unit):
            return f"{name} {rest}".strip(), unit
    for separator in (",", " in ", "_", " ", "/"):
        parts = text.split(separator)
        for k in range(max(1, len(parts) - _PARTS_OF_UNIT), len(parts)):
            name, unit = separator.join(parts[:k]), separator.join(parts[k:])
            # A blank before 1 sets a number apart, as of a sensor, and no unit.
            if name and unit_suffix(unit) and not (separator in " _" and unit.casefold() in ("1", "-", "std")):
                return name.strip(" ,_/"), unit.strip()
    return text, ""


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
        name, unit = (text, "") if whole else split_written_name(text)
        quantity = self.meaning(name)
        if quantity == "elongation" and unit_suffix(unit) in STRAIN.units:
            quantity = "strain"  # of its gauge length
        elif quantity == "strain" and unit_suffix(unit) in LENGTH.units and "elongation" in self.kinds:
            quantity = "elongation"
        if quantity is None or (unit and quantity not in self.kinds):
            last = re.split(r"[\s_\-()\[\],]+", text.strip(" )]"))[-1]
            return text if last in ("1", *CAPITALS_THAT_MATTER) else self._plain_keys.get(plain_name(text), text)
        return f"{quantity}_{unit_suffix(unit) or unit}" if unit else quantity


TEST_NAME_COLUMNS = (
    *("test", "test id", "test name", "test no", "test number", "sample", "sample id", "specimen id", "versuch"),
    *("probe", "probennummer", "proben nr", "specimen label"),
)
"""Names, in small letters, of columns and rows that tell which test it is where a table holds several."""
