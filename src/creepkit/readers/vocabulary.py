"""The vocabulary of headers: quantities, their units, and how a laboratory's own terms map to them.

A name such as `stress_MPa` states quantity and unit; inside there are only MPa, mm, s and K.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from creepkit.errors import HistoryError
from creepkit.records import TENSOR_COMPONENTS, ZERO_CELSIUS


@dataclass(frozen=True)
class UnitConversion:
    """How a number in some unit becomes creepkit's own: factor * number + shift."""

    factor: float
    offset: float = 0.0


@dataclass(frozen=True)
class QuantityKind:
    """A kind of quantity: the unit suffixes it may carry (creepkit's own first) and the values that make sense.

    low, high : the values, in creepkit's unit, that bound the sensible ones; both excluded when `open`.
    """

    name: str
    units: Mapping[str, UnitConversion]
    low: float = -1e30
    high: float = 1e30
    open_interval: bool = False

    def unit(self, suffix: str, location: str, name: str) -> UnitConversion:
        """Return the unit that a suffix means; `name` and `place` say in the error what was read and where."""
        if suffix not in self.units:
            raise HistoryError(
                f"{location}: {self._unit_error(name, suffix)}; allowed: {self._spellings(name, suffix)}"
            )
        return self.units[suffix]

    def convert(self, number: float, suffix: str, location: str, name: str) -> float:
        """Return `number` in creepkit's unit."""
        unit = self.unit(suffix, location, name)
        value = unit.factor * number + unit.offset
        is_inside = self.low < value < self.high if self.open_interval else self.low <= value <= self.high
        if not (math.isfinite(value) and is_inside):
            raise HistoryError(f"{location}: '{name}' is {number:g}; a {self.name} must lie {self.range_text}")
        return value

    @property
    def range_text(self) -> str:
        """The sensible values in words."""
        unit = next(iter(self.units))
        template = ("above {} and below {}" if self.open_interval else "from {} to {}").format(
            f"{self.low:g}", f"{self.high:g}"
        )
        return f"{template} {unit}".rstrip()

    def standard_deviation(self) -> QuantityKind:
        """The kind of a standard deviation of this quantity: same units, above zero."""
        units = {suffix: UnitConversion(unit.factor) for suffix, unit in self.units.items()}
        return replace(self, name=f"standard deviation of a {self.name}", units=units, low=0.0, open_interval=True)

    def _unit_error(self, name: str, suffix: str) -> str:
        return f"the unit '{suffix}' of '{name}' is not understood" if suffix else f"'{name}' has no unit"

    def _spellings(self, name: str, suffix: str) -> str:
        if not name.endswith(suffix):  # the unit stood apart from the name
            return ", ".join(self.units)
        stem = name.removesuffix(suffix).rstrip("_")
        return ", ".join(f"{stem}_{unit}" if unit else stem for unit in self.units)


TIME = QuantityKind(
    "time",
    {"s": UnitConversion(1.0), "min": UnitConversion(60.0), "h": UnitConversion(3600.0), "d": UnitConversion(86400.0)},
    low=0.0,
)


LENGTH = QuantityKind("length", {"mm": UnitConversion(1.0), "um": UnitConversion(1e-3), "m": UnitConversion(1e3)})


STRAIN = QuantityKind("strain", {"": UnitConversion(1.0), "pct": UnitConversion(1e-2), "percent": UnitConversion(1e-2)})


NUMBER = QuantityKind("number", {"": UnitConversion(1.0)})


STRESS = QuantityKind(
    "stress",
    {
        "MPa": UnitConversion(1.0),
        "kPa": UnitConversion(1e-3),
        "GPa": UnitConversion(1e3),
        "bar": UnitConversion(0.1),
        "ksi": UnitConversion(6.894757293168361),
    },
    low=0.0,
    high=1e5,
)


SIGNED_STRESS = replace(STRESS, low=-1e5)


MODULUS = QuantityKind(
    "modulus",
    {"MPa": UnitConversion(1.0), "GPa": UnitConversion(1e3), "ksi": UnitConversion(6.894757293168361)},
    0.0,
    1e8,
    open_interval=True,
)


POISSON = QuantityKind("Poisson's ratio", NUMBER.units, low=-1.0, high=0.5, open_interval=True)


TEMPERATURE = QuantityKind(
    "temperature",
    {"K": UnitConversion(1.0), "C": UnitConversion(1.0, ZERO_CELSIUS)},
    low=0.0,
    high=1e4,
    open_interval=True,
)


FLAG = QuantityKind("flag", NUMBER.units, low=0.0, high=1.0)


def split_unit(name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str] | None:
    """Split `stress_MPa` into the longest known quantity and the unit behind it; None when it begins with none."""
    for quantity in sorted(kinds, key=len, reverse=True):
        if name == quantity or name.startswith(f"{quantity}_"):
            return quantity, name[len(quantity) + 1 :]
    return None


SPECIMEN_OUTPUTS: Mapping[str, Mapping[str, QuantityKind]] = {
    "uniaxial": {"strain": STRAIN},
    "bulge": {"amplitude": LENGTH, "width": LENGTH, "shape": NUMBER},
    "relaxation": {"stress": STRESS},
    "point": {
        "strain": STRAIN,
        **{f"strain_{c}": STRAIN for c in TENSOR_COMPONENTS},
        **{f"stress_{c}": SIGNED_STRESS for c in TENSOR_COMPONENTS},
    },
}
"""Names and kinds of the outputs of each specimen."""


IDENTIFIABLE_SPECIMENS = ("uniaxial", "bulge")
"""Specimens that a file need not name: their outputs identify them."""


LOADING_KINDS: Mapping[str, QuantityKind] = {"stress": STRESS, "pressure": STRESS, "temperature": TEMPERATURE}
"""Loadings of a specimen: a number, `_steps`, a `_program`, or a column."""


CONDITION_KINDS: Mapping[str, QuantityKind] = {
    **LOADING_KINDS,
    **{f"{quantity}_{k}": STRESS for quantity in ("stress", "pressure") for k in (1, 2)},
    **dict.fromkeys(("jump_time", "end_time", "ramp", "rupture"), TIME),
    "modulus": MODULUS,
    "poisson": POISSON,
}
"""Numbers that stand once for a whole test."""


STRAIN_LOADING_KINDS: Mapping[str, QuantityKind] = {"strain": STRAIN}
"""Loadings of a bar in relaxation: `_steps` or a `_program` alone, for its number would be an output."""


COMPONENT_LOADING_KINDS: Mapping[str, QuantityKind] = {
    **{f"stress_{c}": SIGNED_STRESS for c in TENSOR_COMPONENTS},
    **{f"strain_{c}": STRAIN for c in TENSOR_COMPONENTS},
}
"""Loadings of a material point: `_steps` or a `_program`."""


TEXT_KEYS = frozenset(
    [
        f"{q}_{form}"
        for q in (*LOADING_KINDS, *STRAIN_LOADING_KINDS, *COMPONENT_LOADING_KINDS)
        for form in ("steps", "program")
    ]
    + [f"stated_{q}_program" for q in LOADING_KINDS]
    + ["name", "alloy", "specimen", "operator", "control", "strain_measure", "includes_elastic", "ended"]
)
"""Words that stand once for a whole test; every other key becomes a label."""


SPECIMEN_NAME_PATTERN = re.compile(r"[a-z][a-z0-9_-]*")
"""Pattern of the name of a specimen; any other text after `specimen` is a label."""


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
    averaged_columns : {label: columns} whose mean over the whole test is kept as a label, such as thermocouples.
    outputs : {specimen: {output: kind}}.
    end_of_test_terms : {its word: "ruptured" or "stopped"} for how a test ended, beside these two themselves; in a
        column of rupture times such a word may stand in the place of a number.
    """

    synonyms: Mapping[str, str] = field(default_factory=dict)
    default_texts: Mapping[str, str] = field(default_factory=lambda: CREEP_MACHINE_DEFAULTS)
    averaged_columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: Mapping[str, Mapping[str, QuantityKind]] = field(default_factory=lambda: SPECIMEN_OUTPUTS)
    end_of_test_terms: Mapping[str, str] = field(default_factory=dict)

    @property
    def condition_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all numbers that stand once for a test."""
        return {**CONDITION_KINDS, **self._standard_deviation_kinds()}

    @property
    def column_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all columns of frames."""
        return {"time": TIME, **self.output_kinds(), **self._standard_deviation_kinds(), **LOADING_KINDS, "used": FLAG}

    def output_kinds(self) -> dict[str, QuantityKind]:
        """The outputs of all specimens."""
        return {name: kind for outputs in self.outputs.values() for name, kind in outputs.items()}

    def _standard_deviation_kinds(self) -> dict[str, QuantityKind]:
        return {f"{name}_sd": kind.standard_deviation() for name, kind in self.output_kinds().items()}
