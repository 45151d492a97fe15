"""Test conditions stated beside the frames: numbers, texts and labels, the loading and the temperature.

Nothing that a file states goes unread.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal, TypeVar

import numpy as np

from creepkit.errors import CreepkitError, HistoryError, nearest
from creepkit.readers.text_tables import SourceText, TableFrames
from creepkit.readers.vocabulary import (
    COMPONENT_LOADING_KINDS,
    SPECIMEN_NAME_PATTERN,
    HeaderVocabulary,
    Terms,
    split_unit,
)
from creepkit.records import Loading, PointLoading, Program, TwoLevels, loading_of
from creepkit.records.quantities import LENGTH, TEMPERATURE, TIME, QuantityKind
from creepkit.records.recorded_programs import LOAD_RECORD_TOLERANCE, TEMPERATURE_RECORD_TOLERANCE, recorded_program

_ALLOWED_COMBINATIONS = (
    "give one of stress, stress_steps, stress_program, or stress_1 with stress_2 and jump_time (the same for other "
    "loads; with ramp for a pressure)"
)


_PROGRAM_FORMS = ("steps", "program")


_LOADING_SUFFIXES = ("", "_1", *(f"_{form}" for form in _PROGRAM_FORMS))


END_OF_TEST_TERMS = ("ruptured", "stopped")
"""How a test may have ended: by rupture, or before it."""


_T = TypeVar("_T")


CLOSE_SPELLING = 0.8
"""Similarity above which an unknown name is a misspelt one."""


TimeValuePairs = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class StatedNumber:
    """A number in creepkit's unit, and the key and place that it came from."""

    value: float
    key: str
    location: str


class StatedConditions:
    """The entries of one test: numbers, texts, geometry and labels; numbers and texts are taken, one by one."""

    def __init__(self, entries: Mapping[str, SourceText], vocabulary: HeaderVocabulary, location: str) -> None:
        self.location = location
        self.geometry: dict[str, float] = {}
        self.labels: dict[str, str] = {}
        self.stated: dict[str, Program] = {}
        self._vocabulary = vocabulary
        self.terms = vocabulary.terms(_stated_specimen(entries, vocabulary))
        self.default_specimen = vocabulary.default_texts.get("specimen", "")
        self._kinds = self.terms.condition_kinds
        self._text_keys = self.terms.text_keys
        self._end_of_test_terms = {**{word: word for word in END_OF_TEST_TERMS}, **vocabulary.end_of_test_terms}
        self._numbers: dict[str, StatedNumber] = {}
        self._texts: dict[str, SourceText] = {}
        self._assumptions: list[str] = []
        self._locations: dict[str, str] = {}
        for key, entry in entries.items():
            self._classify(key, entry)

    def take_number(self, quantity: str) -> StatedNumber | None:
        """Take a number, if it was given."""
        return self._numbers.pop(quantity, None)

    def take_text(self, key: str, default: str = "") -> str:
        """Take a text; the default stands in for a missing or empty one."""
        entry = self._texts.pop(key, None)
        return default if entry is None else entry.text or default

    def take_choice(self, key: str, allowed: Sequence[str], required: bool) -> str:
        """Take one of the allowed texts; '' when it was not given, or what the layout assumes when it is needed."""
        entry = self._texts.pop(key, None)
        if entry is None and required and key in self._vocabulary.default_texts:
            entry = SourceText(self._vocabulary.default_texts[key], "assumed by the layout")
            self._assumptions.append(f"{key} {entry.text}")
        if entry is None:
            return ""
        if entry.text not in allowed:
            raise HistoryError(f"{entry.location}: {key} is '{entry.text}'; allowed: {', '.join(allowed)}")
        return entry.text

    def take_pairs(self, key: str, kind: QuantityKind) -> TimeValuePairs | None:
        """Take times and values written as `0 s 100 MPa; 1 h 120 MPa`, from time zero on; s and creepkit's unit."""
        entry = self._texts.pop(key, None)
        if entry is None:
            return None
        pairs = tuple(_time_value_pair(item, key, kind, entry.location) for item in entry.text.split(";"))
        times = [time for time, _ in pairs]
        if times[0] != 0.0 or times != sorted(times):
            description = f"the times of {key} are {', '.join(f'{time:g}' for time in times)} s"
            raise HistoryError(f"{entry.location}: {description}; they must start at 0 and never decrease")
        return pairs

    def record_assumption(self, what: str) -> None:
        """Record in the label "assumed" what the file leaves unsaid."""
        self._assumptions.append(what)

    def location_of(self, *keys: str) -> str:
        """The place of the first of these numbers and texts that was given, else that of the test."""
        return next((self._locations[key] for key in keys if key in self._locations), self.location)

    def missing_error(self, what: str, advice: str) -> HistoryError:
        """The error that says what is missing, and which keys were kept as labels (perhaps misspelt)."""
        label_note = f" (keys not understood: {', '.join(self.labels)})" if self.labels else ""
        return HistoryError(f"{self.location}: no {what}{label_note}; {advice}")

    def all_labels(self) -> dict[str, str]:
        """The labels, with what was assumed; refuses numbers and texts that nothing has used."""
        unread = [(number.location, number.key) for number in self._numbers.values()]
        unread += [(entry.location, key) for key, entry in self._texts.items()]
        for location, key in unread:
            raise HistoryError(
                f"{location}: '{key}' has no meaning beside the other conditions; {_ALLOWED_COMBINATIONS}"
            )
        assumed = {"assumed": ", ".join(self._assumptions)} if self._assumptions else {}
        return {**self.labels, **assumed}

    def _classify(self, key: str, entry: SourceText) -> None:
        name = self._vocabulary.synonyms.get(key, key)
        result = split_unit(name, self._kinds)
        if name.startswith("label "):
            _put_once(self.labels, name.removeprefix("label ").strip(), entry.text, entry.location)
        elif name.startswith("geometry "):
            _put_once(self.geometry, *_specimen_dimension(name, entry), entry.location)
        elif name == "ended" or (result and result[0] == "rupture" and entry.text in self._end_of_test_terms):
            _put_once(
                self._texts,
                "ended",
                SourceText(self._end_of_test_terms.get(entry.text, entry.text), entry.location),
                entry.location,
            )
        elif name in self._text_keys and (name != "specimen" or SPECIMEN_NAME_PATTERN.fullmatch(entry.text)):
            _put_once(self._texts, name, entry, entry.location)
            self._locations[name] = entry.location
        elif dimension := _dimension_with_unit(name, self.terms.dimensions):
            value = LENGTH.convert(entry.number(key), dimension[1], entry.location, key)
            _put_once(self.geometry, dimension[0], value, entry.location)
        elif result is None:
            _refuse_misread_length(name, entry, self.terms)
            _put_once(self.labels, name, entry.text, entry.location)
        else:
            _put_once(self._numbers, result[0], self._stated_number(result, key, entry), entry.location)
            self._locations[result[0]] = entry.location

    def _stated_number(self, found: tuple[str, str], key: str, entry: SourceText) -> StatedNumber:
        quantity, suffix = found
        kind = self._kinds[quantity]
        kind.unit(suffix, entry.location, key)
        return StatedNumber(kind.convert(entry.number(key), suffix, entry.location, key), key, entry.location)


def _stated_specimen(entries: Mapping[str, SourceText], vocabulary: HeaderVocabulary) -> str:
    """The specimen that a file names, "" where it names none."""
    named = [e.text for key, e in entries.items() if vocabulary.synonyms.get(key, key) == "specimen"]
    return named[0] if named else vocabulary.default_texts.get("specimen", "")


def _dimension_with_unit(name: str, dimensions: Mapping[str, str]) -> tuple[str, str] | None:
    """A length of a test piece and its unit, where a key is one, such as `apex_thickness_mm`."""
    base, _, suffix = name.rpartition("_")
    return (dimensions[base], suffix) if base in dimensions and suffix in LENGTH.units else None


def _refuse_misread_length(name: str, entry: SourceText, terms: Terms) -> None:
    """HistoryError for what looks like a length of the test piece, in another unit or misspelt; not for a label."""
    base, _, suffix = name.rpartition("_")
    lengths, units = terms.own_dimensions, ", ".join(LENGTH.units)
    for known in lengths:
        if name == known or (base == known and suffix not in LENGTH.units):
            raise HistoryError(f"{entry.location}: '{name}' needs a unit of length: write {known}_mm (or {units})")
    if suffix in LENGTH.units and lengths and get_close_matches(base, lengths, 1, cutoff=CLOSE_SPELLING):
        raise HistoryError(
            f"{entry.location}: no length of the test piece is called '{base}'; {nearest(base, lengths)}"
        )


@contextmanager
def errors_located_at(location: str) -> Iterator[None]:
    """Give a complaint of a record about its fields the place in the file that they came from."""
    try:
        yield
    except HistoryError:  # names a place already
        raise
    except CreepkitError as error:
        raise HistoryError(f"{location}: {error}") from error


def _put_once(target: dict[str, _T], key: str, value: _T, location: str) -> None:
    if key in target:
        raise HistoryError(f"{location}: '{key}' is given twice (perhaps in two units); keep one of them")
    target[key] = value


def _specimen_dimension(name: str, entry: SourceText) -> tuple[str, float]:
    """A measure of the specimen, `geometry apex_thickness_mm`: a length in any unit, or a bare number."""
    stem = name.removeprefix("geometry ").strip()
    base, _, suffix = stem.rpartition("_")
    number = entry.number(stem)
    if base and suffix in LENGTH.units:
        return base, LENGTH.convert(number, suffix, entry.location, stem)
    return stem, number


def _time_value_pair(item: str, key: str, kind: QuantityKind, location: str) -> tuple[float, float]:
    parts = item.split()
    if len(parts) == 3 and "" in kind.units:
        parts.append("")
    if len(parts) != 4:
        example = f"0 s 100 {next(iter(kind.units))}" if "" not in kind.units else "0 s 0.002, or 0 s 0.2 pct"
        raise HistoryError(
            f"{location}: {key} holds '{item.strip()}'; write time and value with units, such as {example}"
        )
    time, value = (SourceText(word, location).number(key) for word in (parts[0], parts[2]))
    return TIME.convert(time, parts[1], location, key), kind.convert(value, parts[3], location, key)


def read_temperature(conditions: StatedConditions, frames: TableFrames) -> float | Program:
    """The temperature, K."""
    result = _stated_loading(conditions, frames, "temperature")
    if result is None:
        raise conditions.missing_error("temperature", "write temperature_C or temperature_K, or a column of that name")
    return Program.steps(result) if isinstance(result, tuple) else result


def read_loading(conditions: StatedConditions, frames: TableFrames) -> Loading:
    """The loading: by components, by what has steps and programs alone, else by the first load that is stated."""
    terms, load_kinds = conditions.terms, conditions.terms.load_kinds
    quantities = (*load_kinds, *COMPONENT_LOADING_KINDS)
    with errors_located_at(
        conditions.location_of(*(f"{quantity}{form}" for quantity in quantities for form in _LOADING_SUFFIXES))
    ):
        loading = _component_loading(conditions)
        likely = {load for one in conditions.terms.specimens_with(frames.values) for load in terms.loads.get(one, ())}
        for name in sorted(load_kinds, key=lambda name: (name in terms.number_kinds, name not in likely)):
            loading = loading or _loading_by(name, conditions, frames)
    if loading is None:
        stated = sorted(likely) or [*load_kinds]
        wanted = " or ".join(name for name in stated if name in load_kinds)
        raise conditions.missing_error(f"loading (no {wanted})", _loading_advice(terms, stated))
    return loading


def _loading_advice(terms: Terms, loads: Sequence[str]) -> str:
    """What to write, for each of these loads."""
    forms = []
    for name in (load for load in loads if load in terms.load_kinds):
        unit = next(iter(terms.load_kinds[name].units))
        forms.append(
            f"{name}_{unit}, {name}_steps, or {name}_1_{unit}, {name}_2_{unit} and jump_time_h"
            if unit
            else f"{name}_steps"
        )
    return f"write {'; or '.join(forms)}"


def _loading_by(quantity: str, conditions: StatedConditions, frames: TableFrames) -> Loading | None:
    """The loading by one quantity, if it is stated."""
    kind = conditions.terms.load_kinds[quantity]
    if quantity not in conditions.terms.number_kinds:
        value: float | TimeValuePairs | Program | TwoLevels | None = _steps_or_program(conditions, quantity, kind)
    else:
        value = _stated_loading(conditions, frames, quantity)
    value = _step_change(conditions, quantity) if value is None else value
    return None if value is None else _loading_of(conditions, quantity, value, float(frames.times[-1]))


def _loading_of(
    conditions: StatedConditions, quantity: str, value: float | TimeValuePairs | Program | TwoLevels, end: float
) -> Loading:
    control: Literal["load", "stress"] = "load"
    if quantity == "stress" and _control(conditions) == "stress":
        control = "stress"
    ramp = None if isinstance(value, (Program, tuple)) else conditions.take_number("ramp")
    return loading_of(quantity, value, control=control, ramp=None if ramp is None else ramp.value, end=end)


def _component_loading(conditions: StatedConditions) -> Loading | None:
    """The stresses and strains of a material point."""
    programs: dict[str, dict[str, Program]] = {"stress": {}, "strain": {}}
    for name, kind in COMPONENT_LOADING_KINDS.items():
        result = _steps_or_program(conditions, name, kind)
        if result is not None:
            quantity, _, component = name.partition("_")
            programs[quantity][component] = Program.steps(result) if isinstance(result, tuple) else result
    return PointLoading(**programs) if programs["stress"] or programs["strain"] else None


def _steps_or_program(
    conditions: StatedConditions, quantity: str, kind: QuantityKind
) -> TimeValuePairs | Program | None:
    """Steps or a program that stand in the head."""
    steps, breakpoints = (conditions.take_pairs(f"{quantity}_{form}", kind) for form in ("steps", "program"))
    if steps is not None and breakpoints is not None:
        raise HistoryError(f"{conditions.location}: {quantity} has both steps and a program; keep one")
    return steps if breakpoints is None else Program(*np.array(breakpoints).T)


def _control(conditions: StatedConditions) -> str:
    return conditions.take_choice("control", ("load", "stress"), required=True)


def _step_change(conditions: StatedConditions, quantity: str) -> TwoLevels | None:
    """First value, second value and time of the change, when all three are given."""
    names = (f"{quantity}_1", f"{quantity}_2", "jump_time")
    first = conditions.take_number(names[0])
    if first is None:
        return None
    second, time = (_required_number(conditions, name, first) for name in names[1:])
    return TwoLevels(first.value, second.value, time.value)


def _required_number(conditions: StatedConditions, name: str, companion: StatedNumber) -> StatedNumber:
    result = conditions.take_number(name)
    if result is None:
        raise HistoryError(
            f"{companion.location}: '{companion.key}' needs {name} beside it (with its unit), which is missing"
        )
    return result


def _stated_loading(
    conditions: StatedConditions, frames: TableFrames, quantity: str
) -> float | TimeValuePairs | Program | None:
    """The value given for a quantity: a number, steps as (time, value), or a Program.

    A column that differs from what is stated beside it is what was recorded, and is used; the rest is kept as stated.
    """
    kind = TEMPERATURE if quantity == "temperature" else conditions.terms.load_kinds[quantity]
    number = conditions.take_number(quantity)
    steps = conditions.take_pairs(f"{quantity}_steps", kind)
    breakpoints = conditions.take_pairs(f"{quantity}_program", kind)
    forms = [form for form in (number, steps, breakpoints) if form is not None]
    if len(forms) > 1:
        raise HistoryError(
            f"{conditions.location}: the {quantity} is given {len(forms)} times over, as a number, {quantity}_steps "
            f"or {quantity}_program; keep one"
        )
    stated: float | TimeValuePairs | Program | None = number.value if number is not None else steps
    if breakpoints is not None:
        stated = Program(*np.array(breakpoints).T)
    earlier = conditions.take_pairs(f"stated_{quantity}_program", kind)
    if earlier is not None:
        conditions.stated[quantity] = Program(*np.array(earlier).T)
    column = frames.values.get(quantity)
    if column is None or (number is not None and np.allclose(column, number.value, rtol=1e-9, atol=0.0)):
        return stated
    if stated is None:
        jump = _step_change(conditions, quantity) if quantity != "temperature" else None
        stated = None if jump is None else _loading_of(conditions, quantity, jump, jump.time).program()
    if stated is not None:
        conditions.stated[quantity] = _as_program(stated)
    is_temperature = quantity == "temperature"
    tolerance = TEMPERATURE_RECORD_TOLERANCE if is_temperature else LOAD_RECORD_TOLERANCE * float(column.max())
    return float(column[0]) if np.ptp(column) == 0.0 else recorded_program(frames.times, column, tolerance)


def _as_program(stated: float | TimeValuePairs | Program) -> Program:
    if isinstance(stated, Program):
        return stated
    return Program.steps(stated) if isinstance(stated, tuple) else Program.constant(stated)
