"""The vocabulary of headers: quantities, their units, and how a laboratory's own terms map to them.

A name such as `stress_MPa` states quantity and unit; inside there are only MPa, mm, s and K.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from creepkit.records import TENSOR_COMPONENTS, dimensions_of, known_specimens, loads_of, outputs_of
from creepkit.records.quantities import FLAG, MODULUS, POISSON, SIGNED_STRESS, STRAIN, TEMPERATURE, TIME, QuantityKind


def split_unit(name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str] | None:
    """Split `stress_MPa` into the longest known quantity and the unit behind it; None when it begins with none."""
    for quantity in sorted(kinds, key=len, reverse=True):
        if name == quantity or name.startswith(f"{quantity}_"):
            return quantity, name[len(quantity) + 1 :]
    return None


COMPONENT_LOADING_KINDS: Mapping[str, QuantityKind] = {
    **{f"stress_{c}": SIGNED_STRESS for c in TENSOR_COMPONENTS},
    **{f"strain_{c}": STRAIN for c in TENSOR_COMPONENTS},
}
"""What is prescribed at a material point: `_steps` or a `_program`."""


CONDITION_KINDS: Mapping[str, QuantityKind] = {
    "temperature": TEMPERATURE,
    **dict.fromkeys(("jump_time", "end_time", "ramp", "rupture"), TIME),
    "modulus": MODULUS,
    "poisson": POISSON,
}
"""Numbers that stand once for a whole test, beside its loads."""


TEXT_KEYS = (
    *("name", "alloy", "specimen", "operator", "control", "strain_measure", "includes_elastic", "ended"),
    "noise_correlation",
)
"""Words that stand once for a whole test, beside steps and programs; every other key becomes a label."""


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
    outputs : {specimen: {output: kind}} that its files hold beside those of the registered specimens.
    end_of_test_terms : {its word: "ruptured" or "stopped"} for how a test ended, beside these two themselves; in a
        column of rupture times such a word may stand in the place of a number.
    """

    synonyms: Mapping[str, str] = field(default_factory=dict)
    default_texts: Mapping[str, str] = field(default_factory=lambda: CREEP_MACHINE_DEFAULTS)
    averaged_columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: Mapping[str, Mapping[str, QuantityKind]] = field(default_factory=dict)
    end_of_test_terms: Mapping[str, str] = field(default_factory=dict)

    def terms(self, specimen: str = "") -> Terms:
        """What headers and columns of a file may say; specimen : that the file names, whose own terms then count most.

        A file that names none may use the terms of every registered specimen.
        """
        known = known_specimens()
        outputs = {name: {str(o): o.kind for o in outputs_of(one)} for name, one in known.items()} | dict(self.outputs)
        named = {specimen: known[specimen]} if specimen in known else dict(known)
        loads = {load.name: load.kind for one in (*known.values(), *named.values()) for load in loads_of(one)}
        return Terms(
            outputs=outputs,
            own_outputs=outputs.get(specimen, {}),
            loads={specimen: [load.name for load in loads_of(one)] for specimen, one in known.items()},
            load_kinds={name: kind for name, kind in loads.items() if name != "components"},
            dimensions={name: d.name for one in named.values() for d in dimensions_of(one) for name in d.names},
            own_dimensions=[name for d in dimensions_of(known.get(specimen)) for name in d.names],
        )


@dataclass(frozen=True)
class Terms:
    """What the headers and columns of one file may say.

    outputs : {specimen: {output: kind}}; own_outputs : those of the specimen that the file names, {} where it names
    none. loads : {specimen: names}. load_kinds : {load: kind} of those that are stated by one number or program.
    dimensions : {name or alias: length of a test piece}; own_dimensions : of the specimen that the file names.
    """

    outputs: Mapping[str, Mapping[str, QuantityKind]]
    own_outputs: Mapping[str, QuantityKind]
    loads: Mapping[str, Sequence[str]]
    load_kinds: Mapping[str, QuantityKind]
    dimensions: Mapping[str, str]
    own_dimensions: Sequence[str]

    @property
    def number_kinds(self) -> dict[str, QuantityKind]:
        """Loads that a number may state; without a unit in its key it would be taken for a label or an output."""
        return {name: kind for name, kind in self.load_kinds.items() if "" not in kind.units}

    @property
    def condition_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all numbers that stand once for a test."""
        levels = {f"{name}_{k}": kind for name, kind in self.number_kinds.items() for k in (1, 2)}
        return {**CONDITION_KINDS, **self.number_kinds, **levels, **self._standard_deviation_kinds()}

    @property
    def column_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all columns of frames."""
        return {
            **{"time": TIME, **self.output_kinds(), **self._standard_deviation_kinds(), **self.number_kinds},
            **self.own_outputs,
            **{"temperature": TEMPERATURE, "used": FLAG},
        }

    @property
    def text_keys(self) -> set[str]:
        """Words that stand once for a whole test."""
        programs = (*self.load_kinds, "temperature", *COMPONENT_LOADING_KINDS)
        forms = {f"{name}_{form}" for name in programs for form in ("steps", "program")}
        return {*TEXT_KEYS, *forms, *(f"stated_{name}_program" for name in (*self.number_kinds, "temperature"))}

    def specimens_with(self, columns: Collection[str]) -> list[str]:
        """The specimens of which some output is among the columns."""
        return [name for name, outputs in self.outputs.items() if not outputs.keys().isdisjoint(columns)]

    def output_kinds(self) -> dict[str, QuantityKind]:
        """The outputs of all specimens."""
        return {name: kind for outputs in self.outputs.values() for name, kind in outputs.items()}

    def _standard_deviation_kinds(self) -> dict[str, QuantityKind]:
        kinds = {**self.output_kinds(), **self.own_outputs}
        return {f"{name}_sd": kind.standard_deviation() for name, kind in kinds.items()}
