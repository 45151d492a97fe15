"""The vocabulary of headers: quantities, their units, and how a laboratory's own terms map to them.

A name such as `stress_MPa` states quantity and unit; inside there are only MPa, mm, s and K.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from creepkit.records import TENSOR_COMPONENTS
from creepkit.records.quantities import (
    FLAG,
    LENGTH,
    MODULUS,
    NUMBER,
    POISSON,
    SIGNED_STRESS,
    STRAIN,
    STRESS,
    TEMPERATURE,
    TIME,
    QuantityKind,
)


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
