"""The vocabulary of headers: quantities, their units, and how a laboratory's own terms map to them.

A name such as `stress_MPa` states quantity and unit; inside there are only MPa, mm, s and K.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property

from creepkit.readers.column_names import TEST_NAME_COLUMNS, NameTable, plain_name, split_unit, words_of
from creepkit.records import TENSOR_COMPONENTS, dimensions_of, known_specimens, loads_of, outputs_of
from creepkit.records.quantities import (
    AREA,
    COUNT,
    FLAG,
    LENGTH,
    MODULUS,
    POISSON,
    RATE,
    SIGNED_STRESS,
    STRAIN,
    TEMPERATURE,
    TIME,
    QuantityKind,
)


def is_misspelling(name: str, known: str) -> bool:
    """Whether a name is a known one but for few letters that were left out, added, changed or swapped.

    One letter of three to six, two of seven to nine, three of more (a swap over a missing letter counts as three).
    """
    allowed = 0 if len(known) < 3 else 1 if len(known) < 7 else 2 if len(known) < 10 else 3
    if name == known or abs(len(name) - len(known)) > allowed or len(set(name) ^ set(known)) > 2 * allowed:
        return False
    return _edit_distance(name, known, allowed) <= allowed


def _edit_distance(first: str, second: str, limit: int) -> int:
    """Letters left out, added, changed, or swapped with their neighbour; more than `limit` where it is more."""
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, letter in enumerate(first, 1):
        last, before, row = before, row, [i]
        for j, other in enumerate(second, 1):
            cost = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == second[j - 2] and first[i - 2] == other:
                cost = min(cost, last[j - 2] + 1)
            row.append(cost)
        if min(row) > limit and min(before) > limit:
            return limit + 1
    return row[-1]


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
    *("includes_elastic", "includes_loading", "ended", "noise_correlation", "steps_taken_off"),
    *("decimal", "columns", "ignore", "strain_unit", "date_order", "time_zone"),
)
"""Words that stand once for a whole test, beside steps and programs; the last line says how its table is written."""


LABEL_KEYS: Mapping[str, str] = {
    **dict.fromkeys(("heat", "cast", "batch", "charge", "schmelze"), "heat"),
    **dict.fromkeys(("laboratory", "lab", "labor"), "laboratory"),
    **dict.fromkeys(("prüfer", "tester"), "operator"),
}
"""{key: label} of what tests share with others: a forecast tells the scatter between heats and laboratories apart."""


HIGHEST_STEP = 9
"""Levels of a load that keys may number, `stress_1_MPa` to `stress_9_MPa`."""


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
    averaged_columns : {label: columns} whose mean over the whole test is kept as a label, such as thermocouples.
    outputs : {specimen: {output: kind}} that its files hold beside those of the registered specimens.
    end_of_test_terms : {its word: "ruptured" or "stopped"} for how a test ended, beside these two themselves; in a
        column of rupture times such a word may stand in the place of a number.
    labels : its keys and columns that are kept as labels though nothing is known of them.
    ignored : columns, as they are written in its files, that are left out.
    stated : {key: text and place} of conditions that a file of answers beside a file states of its tests.
    """

    synonyms: Mapping[str, str] = field(default_factory=dict)
    default_texts: Mapping[str, str] = field(default_factory=lambda: CREEP_MACHINE_DEFAULTS)
    averaged_columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: Mapping[str, Mapping[str, QuantityKind]] = field(default_factory=dict)
    end_of_test_terms: Mapping[str, str] = field(default_factory=dict)
    labels: Collection[str] = ()
    ignored: Collection[str] = ()
    stated: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def terms(self, specimen: str = "") -> Terms:
        """What headers and columns of a file may say; specimen : that the file names, whose own terms then count most.

        A file that names none may use the terms of every registered specimen.
        """
        known, specimen = known_specimens(), specimen or self.default_texts.get("specimen", "")
        outputs = {name: {str(o): o.kind for o in outputs_of(one)} for name, one in known.items()} | dict(self.outputs)
        named = {specimen: known[specimen]} if specimen in known else dict(known)
        loads = {load.name: load.kind for one in (*known.values(), *named.values()) for load in loads_of(one)}
        return Terms(
            vocabulary=self,
            outputs=outputs,
            own_outputs=outputs.get(specimen, {}),
            loads={specimen: [load.name for load in loads_of(one)] for specimen, one in known.items()},
            load_kinds={name: kind for name, kind in loads.items() if name != "components"},
            own_loads=[load.name for one in named.values() for load in loads_of(one) if specimen in known],
            dimensions={name: d.name for one in named.values() for d in dimensions_of(one) for name in d.names},
            own_dimensions=[name for d in dimensions_of(known.get(specimen)) for name in d.names],
        )


@dataclass(frozen=True)
class Terms:
    """What the heads and columns of one file may say, and what names in it mean.

    outputs : {specimen: {output: kind}}; own_outputs : those of the specimen that the file names, {} where it names
    none. loads : {specimen: names}. load_kinds : {load: kind} of those that are stated by one number or program;
    own_loads : those of the specimen that the file names, none where it names none.
    dimensions : {name or alias: length of a test piece}; own_dimensions : of the specimen that the file names.
    """

    vocabulary: HeaderVocabulary
    outputs: Mapping[str, Mapping[str, QuantityKind]]
    own_outputs: Mapping[str, QuantityKind]
    loads: Mapping[str, Sequence[str]]
    load_kinds: Mapping[str, QuantityKind]
    own_loads: Sequence[str]
    dimensions: Mapping[str, str]
    own_dimensions: Sequence[str]

    @cached_property
    def number_kinds(self) -> dict[str, QuantityKind]:
        """Loads whose column is a record of what was imposed, whichever specimen it was: none of those without unit."""
        return {name: kind for name, kind in self.load_kinds.items() if "" not in kind.units}

    @cached_property
    def condition_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all numbers that stand once for a test."""
        stepped = {**self.number_kinds, "temperature": TEMPERATURE}
        levels = {f"{name}_{k}": kind for name, kind in stepped.items() for k in range(1, HIGHEST_STEP + 1)}
        return {**CONDITION_KINDS, **self.load_kinds, **levels, **self._standard_deviation_kinds()}

    @cached_property
    def column_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of all columns of frames."""
        return {
            **{"time": TIME, **self.output_kinds(), **self._standard_deviation_kinds(), **self.number_kinds},
            **self.own_outputs,
            **{"temperature": TEMPERATURE, "used": FLAG, "step": COUNT},
        }

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
        return name if name in self.declared else self.columns.standard(name)

    def quantity(self, name: str) -> str | None:
        """The quantity of a column, None where its name means none."""
        found = split_unit(self.column(self.vocabulary.synonyms.get(name, name)), self.columns.kinds)
        return found[0] if found else None

    def condition(self, name: str) -> str:
        """A name of a condition in creepkit's form, where it is understood."""
        words = words_of(name)
        if name in self.vocabulary.synonyms or name in self.vocabulary.labels:
            return name
        if name.startswith(("label ", "geometry ")):
            return name
        if words in (*TEST_NAME_COLUMNS, "specimen name"):
            return "name"
        return f"label {LABEL_KEYS[words]}" if words in LABEL_KEYS else self.conditions.standard(name)

    def is_condition(self, name: str) -> bool:
        """Whether a name is that of a condition."""
        standard = self.condition(name)
        return (
            standard in (*self.conditions.texts, *self.vocabulary.synonyms)
            or split_unit(standard, self.conditions.kinds) is not None
            or standard.startswith(("label ", "geometry "))
        )

    @property
    def declared(self) -> set[str]:
        """Names of columns that the vocabulary declares, which mean what it says."""
        averaged = (name for names in self.vocabulary.averaged_columns.values() for name in names)
        return {*self.vocabulary.synonyms, *averaged}

    def misspelt(self, name: str) -> str:
        """The key of which an unknown name is a misspelling, first of those of the file's own specimen; "" for none."""
        plain = plain_name(name)
        for keys in self._keys_by_name():
            misspelt = [known for known in keys if is_misspelling(plain, known)]
            if misspelt:
                return keys[get_close_matches(plain, misspelt, 1, cutoff=0.0)[0]]
        words = {plain, plain.rpartition("_")[0]}
        names = (name for name in self.condition_kinds for word in words if is_misspelling(word, name.casefold()))
        return next(names, "")

    def suggestion(self, name: str) -> str:
        """The key that an unknown name may have meant, "" where it resembles none."""
        keys = {plain: key for one in self._keys_by_name() for plain, key in one.items()}
        near = get_close_matches(plain_name(name), keys, 1, cutoff=CLOSE_SPELLING)
        return self.misspelt(name) or (keys[near[0]] if near else "")

    def _keys_by_name(self) -> list[dict[str, str]]:
        """{name in small letters: key} of the file's own specimen, then of all."""
        own = self.head_keys(self._own_kinds(), self.own_dimensions)
        return [{plain_name(key): key for key in keys} for keys in (own, self.head_keys())]

    def _own_kinds(self) -> dict[str, QuantityKind]:
        """The kinds of numbers that mean something for the specimen that the file names; of all where it names none."""
        foreign = self.load_kinds.keys() - set(self.own_loads) if self.own_loads else set()
        outputs = self.own_outputs or self.output_kinds()
        return {
            name: kind
            for name, kind in self.condition_kinds.items()
            if re.sub("_[0-9]$", "", name) not in foreign and not (name.endswith("_sd") and name[:-3] not in outputs)
        }

    def head_keys(
        self, kinds: Mapping[str, QuantityKind] | None = None, dimensions: Collection[str] | None = None
    ) -> Iterator[str]:
        """Keys of numbers with their units, of texts, of lengths and of labels, creepkit's own units first.

        kinds, dimensions : those that are meant; all by default.
        """
        for quantity, kind in (self.condition_kinds if kinds is None else kinds).items():
            yield from (f"{quantity}_{unit}" if unit else quantity for unit in kind.units)
        yield from sorted(self.text_keys)
        yield from LABEL_KEYS
        for dimension in self.dimensions if dimensions is None else dimensions:
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
