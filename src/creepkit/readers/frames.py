"""The frames of one test: the columns of a table as arrays in MPa, mm, s and K, whose times increase strictly."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from typing import Literal

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError
from creepkit.files.delimited_text import is_missing, is_number
from creepkit.readers.ends_of_tests import FIRM, LABEL, kind_of_column
from creepkit.readers.questions import Question, collected, raise_all
from creepkit.readers.table import CellTable, cells_of, some_of
from creepkit.readers.vocabulary import HeaderVocabulary, NameTable, Terms, split_unit, split_written_name, unit_suffix
from creepkit.records.quantities import FORCE, LENGTH, RATE, STRAIN, STRESS, TEMPERATURE, TIME, QuantityKind

_COMPRESSION = "magnitudes of negative stress and strain (compression)"
NOISE_OF_ZERO = 0.01
"""Of the largest reading of a load: a reading that is less below zero is one of none."""


LATEST_START = 1e9
"""s, 32 years: times that begin later are those of a calendar."""


@dataclass(frozen=True)
class TableFrames:
    """The frames of one test.

    values : {quantity: (frames,)} in MPa, mm, s, K; "time" is among them and increases strictly.
    lines : (frames,) the line of the file in which each frame stands.
    merged_count : number of frames that were merged into another one of the same time.
    marked : lines of frames at which a load or temperature changed, which a reading at the same time before each says;
    that was left out.
    """

    table: CellTable
    values: Mapping[str, Floats]
    lines: Ints
    merged_count: int = 0
    marked: frozenset[int] = frozenset()

    @property
    def times(self) -> Floats:
        """(frames,) s."""
        return self.values["time"]

    def location(self, frame: int) -> str:
        """Where a frame stands, 'file:line'."""
        return self.table.location(int(self.lines[frame]))

    def line_of(self, label: str) -> Literal["", "earlier", "last"]:
        """Of which frame a label such as `line 17` is a remark."""
        line = int(label[5:]) if label.startswith("line ") and label[5:].isdecimal() else -1
        first, last = int(self.table.lines[0]), int(self.lines[-1])
        sign = -1 if last < first else 1  # of rows that were turned round
        is_within = line >= 0 and sign * line >= sign * first
        return "" if not is_within else "last" if sign * last <= sign * line else "earlier"


def read_frames(
    table: CellTable, vocabulary: HeaderVocabulary, terms: Terms, skipped_columns: Collection[str] = ()
) -> TableFrames:
    """Read the frames in a table, except `skipped_columns` and labels."""
    kinds = terms.column_kinds
    ignored = {*skipped_columns, *vocabulary.labels}
    values, found, errors = dict[str, Floats](), dict[str, str](), list[HistoryError]()
    notes, sensors = list[str](), dict[str, dict[str, Floats]]()

    def read(k: int, name: str) -> None:
        written = table.as_written(k)
        quantity, suffix = _parsed_column(table, k, vocabulary.synonyms.get(name, name), kinds)
        if quantity in found and (quantity == "time" or not {name, found[quantity]} <= vocabulary.synonyms.keys()):
            raise column_question(
                table,
                f"'{found[quantity]}' and '{written}' both hold the {quantity}; which counts?",
                *({one: UNUSED} for one in (written, found[quantity])),
            )
        found[quantity] = written
        sensors.setdefault(quantity, {})[written] = _converted_column(table, name, quantity, kinds[quantity], suffix)
        values[quantity] = np.mean([*sensors[quantity].values()], axis=0)
        if quantity == "stress" and (table.numbers(name) < 0.0).any() and not (table.numbers(name) > 0.0).any():
            notes.append(_COMPRESSION)
        if quantity == "time" and (table.numbers(name) < 0.0).any():
            notes.append("times just below zero are zero")
        if quantity == "used":
            _check_marks(table, k, values[quantity])

    for k, name in enumerate(table.columns):
        if ignored.isdisjoint((name, table.as_written(k))):
            collected(errors, partial(read, k, name))
    raise_all(errors)
    if "time" not in values:
        place, names = table.location(table.columns_line), table.written or table.columns
        if names:
            raise head_question(table, names)
        what = "missing column: no time as every column is the same in all rows; name one time_s, time_min or time_h"
        raise HistoryError(f"{place}: {what}")
    if values["time"][0] > LATEST_START:  # s since 1970, days since 1900
        values["time"] = values["time"] - values["time"][0]
        notes.append("times since the first reading")
    if _COMPRESSION in notes and "strain" in values and values["strain"].max() <= 0.0:
        values["strain"] = -values["strain"]
    falls = -np.diff(values["time"]).min(initial=0.0)
    is_plot = "x" in map(str.casefold, found.values())
    if falls > 0.0 and (is_plot or falls <= LARGEST_FALL * np.ptp(values["time"])):
        order = np.argsort(values["time"], kind="stable")
        values = {name: one[order] for name, one in values.items()}
        what = "points of a plot" if is_plot else f"readings of which some fall by up to {falls:g} s"
        notes.append(f"{what} in order of time")
    for quantity, several in sensors.items():
        if len(several) > 1:
            apart, unit = np.ptp([*several.values()], axis=0).max(), next(iter(kinds[quantity].units))
            notes.append(f"{quantity} is the mean of {' and '.join(map(repr, several))} (within {apart:.3g} {unit})")
    table = table.assuming(*notes)
    imposed = [values[name] for name in (*terms.number_kinds, "temperature") if name in values]
    return _strictly_increasing(_without_readings_before_steps(TableFrames(table, values, table.lines), imposed))


LARGEST_FALL = 0.01
"""Of the span of the times, by which one may fall below the one before, as points of a digitised curve do."""


LARGEST_SHARE_MISSING = 0.1
"""Of the readings of a test, that may lack a load or a temperature, or one of several outputs."""


def without_missing_readings(table: CellTable, known: Terms) -> CellTable:
    """The table of one test without the rows in which a value is blank or `----`, which is listed.

    Nothing was measured in a row without any output; other values may lack in few rows.
    """
    labels = known.vocabulary.labels
    quantities = {k: known.quantity(name) for k, name in enumerate(table.columns) if name not in labels}
    values = [k for k, quantity in quantities.items() if quantity not in (None, "time")]
    outputs = [k for k in values if quantities[k] not in ("temperature", *known.number_kinds)]
    lack = {row.line: [k for k in values if is_missing(row.cells[k])] for row in table.rows}
    lost = {line: columns for line, columns in lack.items() if columns}
    partly = [line for line, columns in lost.items() if not (outputs and {*outputs} <= {*columns})]
    kept = [row for row in table.rows if row.line not in lost]
    if not lost or len(partly) > LARGEST_SHARE_MISSING * len(table.rows) or len(kept) < 2:
        return table
    name, lines = table.as_written(next(iter(lost.values()))[0]), "; ".join(map(str, [*lost][:3]))
    what = f"{len(lost)} reading{'s' * (len(lost) > 1)} without a value of '{name}' left out"
    return replace(table, rows=kept).assuming(f"{what} (line {lines}{'; ...' * (len(lost) > 3)})".replace(",", ";"))


def unknown_text(quantity: str) -> str:
    """What is assumed of a condition whose cell is empty."""
    return f"{quantity} unknown (empty cell)"


OF_UNIT: Mapping[str, QuantityKind] = {
    **{"force": FORCE, "elongation": LENGTH, "strain": STRAIN, "stress": STRESS, "temperature": TEMPERATURE}
}
"""What a column without a name that is known may hold, by its unit."""

_OF_HEAD = {"time": TIME, "minimum rate": RATE, **OF_UNIT}
"""The same where no column is known."""


UNUSED = "unused"
"""What an answer says of a column that stays unread."""


def column_question(table: CellTable, sentence: str, *choices: dict[str, str]) -> Question:
    """The question of what columns of a table are; choices : {column: what it is}, the likely one first."""
    place, kind = table.location(table.columns_line), table.header.get("label format")
    where = f"{place} ({kind.text})" if kind else place
    return Question(table.path, where, sentence, "columns", choices, is_free=True)


def head_question(table: CellTable, names: Sequence[str]) -> Question:
    """The question of what columns are of which none is a time, as in a language that is not known.

    The likely answer is by their units: a table of stresses and temperatures without strains has one row a test.
    """
    units, found = {name: split_written_name(name)[1] for name in filter(None, names)}, dict[str, str]()
    for name, suffix in ((name, unit_suffix(unit)) for name, unit in units.items()):
        quantity = next((one for one, kind in _OF_HEAD.items() if suffix and suffix in kind.units), "")
        found |= {name: quantity} if quantity not in ("", *found.values()) else {}
    are_tests = {"stress", "temperature"} <= {*found.values()} and not {"strain", "elongation"} & {*found.values()}
    likely = {name: f"{'rupture ' * (are_tests and one == 'time')}{one} ({units[name]})" for name, one in found.items()}
    likely = likely if "time" in found.values() else {next(iter(units), "name"): "time_h", **likely}
    what = f"missing column: no time among {some_of([*units])}; name one time_s, time_min or time_h in that row, behind"
    return column_question(table, f"{what} its '#' where it has one, or say what they are", likely)


def _parsed_column(table: CellTable, k: int, name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str]:
    """Quantity and unit suffix of a column."""
    location, written = table.location(table.columns_line), table.as_written(k)
    result = split_unit(name, kinds)
    if result is None:
        unit = split_written_name(written)[1].strip("()[]")
        sensor, names = _sensor(written, kinds), table.written or table.columns
        others = [other for other in names if other != written and sensor and _sensor(other, kinds) == sensor]
        measured = f"{sensor} ({unit})" if unit else sensor
        if others:
            same = [name for name in names if name == written or name in others]
            counts = [{one: measured, **{o: UNUSED for o in same if o != one}} for one in same]
            what = f"'{same[0]}' and '{same[1]}' seem to be sensors of the {sensor}; does their mean count, or one?"
            raise column_question(table, what, dict.fromkeys(same, measured), *counts[:2])
        present = {(split_unit(other, kinds) or ("",))[0] for other in table.columns}
        is_known = sensor in ("temperature", "diameter") and unit_suffix(unit) in kinds[sensor].units
        if is_known and sensor not in present:
            return sensor, unit_suffix(unit) or ""
        if sensor and sensor not in present:
            what = f"'{written}' seems to be a sensor of the {sensor}; is it?"
            raise column_question(table, what, {written: measured}, {written: UNUSED})
        if kind_of_column(written) in (*FIRM, "remark"):
            what = f"column '{written}' holds words beside frames; is it a label of the test?"
            raise column_question(table, what, {written: LABEL}, {written: UNUSED})
        is_of_words = not all(is_number(cell, table.dialect) for cell in cells_of(table.rows, k))
        is_other = is_of_words or _OF_OTHERS.search(written)
        near = [] if is_other else get_close_matches(written, kinds, 1, cutoff=0.55)
        asked = f"did you mean '{near[0]}'?" if near else "what does it hold?"
        meant = f"column '{written}' is not understood; {asked}"
        likely = [name for name, one in OF_UNIT.items() if unit_suffix(unit) in one.units and name not in near]
        likely = [] if unit_suffix(unit) in (None, "") else [name for name in likely if name not in present]
        if _SHEAR.search(written):
            meant = f"'{written}' is of shear: a law's stress is sqrt(3) times it, its strain the shear strain over"
            meant, near, likely = f"{meant} sqrt(3); add them as columns such as stress_MPa and strain_pct", [], []
        elif _OF_OTHERS.search(written):
            near, likely = (["pressure"] if "pressure" in kinds and _PRESSURE.search(written) else []), []
        named = [{written: "test"}] * is_of_words
        options = [{written: f"{one} ({unit})"} for one in (*near, *likely)]
        raise column_question(table, meant, *options, *named, {written: UNUSED})
    quantity, suffix = result
    kinds[quantity].unit(suffix, location, written)
    in_unit = unit_suffix(split_written_name(written)[1])
    if name != table.columns[k] and suffix and in_unit and in_unit not in kinds[quantity].units:
        what = f"'{written}' is in {in_unit} and cannot be the {quantity} in {suffix} that it is said to be"
        raise HistoryError(f"{location}: {what}; correct the name or the answer")
    return result


_SHEAR = re.compile(r"shear|schub|scher|cisaillement|glissement", re.IGNORECASE)
_PRESSURE = re.compile(r"pressure|druck(?!fest)|pression", re.IGNORECASE)
_OF_OTHERS = re.compile(
    rf"{_PRESSURE.pattern}|hoop|net.?section|transvers|lateral|latéral|poisson|quer|radial|\brate\b|geschwindigkeit|vitesse"
    r"|[\s_]f(?![a-z])|fracture|rupture|bruch|\broom|ambient|raumtemp|umgebung|ambiant",
    re.IGNORECASE,
)
"""Names of columns that are no stress, axial strain over time or temperature of a bar, though they have such a unit."""


_PLACE_OF_SENSOR = re.compile(
    r"(?<=[^\d\s_])[\s_.-]*\d+$|[\s_]+(?:[A-Z]|(?i:top|mid\w*|bot\w*|oben|mitte|unten|haut|bas|milieu))$"
)


def _sensor(name: str, kinds: Mapping[str, QuantityKind]) -> str:
    """The quantity that one sensor of several measures, `T1_C` or `Temperature top (C)`; "" where it is none."""
    words = split_written_name(name)[0]
    stem = _PLACE_OF_SENSOR.split(words)[0]
    return NameTable(kinds).meaning(stem) or _SENSORS.get(stem.casefold(), "")


_SENSORS = {
    **dict.fromkeys(("tc", "thermocouple", "thermoelement"), "temperature"),
    **dict.fromkeys(("weg", "wegaufnehmer", "messuhr", "lvdt", "displacement", "transducer", "capteur"), "elongation"),
}
"""{name of a sensor in small letters: what it measures}."""


def _converted_column(table: CellTable, name: str, quantity: str, kind: QuantityKind, suffix: str) -> Floats:
    """One column in creepkit's unit."""
    k, numbers = table.column(name), table.numbers(name)
    written = table.as_written(k)
    # A reading of none may be below it.
    is_imposed = kind.low == 0.0 or quantity == "stress"
    if is_imposed and kind.name in ("stress", "pressure", "time") and numbers.size:
        numbers = -numbers if kind.name == "stress" and numbers.max() <= 0.0 else numbers
        numbers = np.where((numbers < 0.0) & (numbers >= -NOISE_OF_ZERO * numbers.max()), 0.0, numbers)
    return kind.convert_all(numbers, suffix, lambda row: table.location(int(table.lines[row]), k), written)


def _check_marks(table: CellTable, k: int, marks: Floats) -> None:
    """Refuse what neither uses a frame nor leaves it out."""
    for row in np.flatnonzero((marks != 0.0) & (marks != 1.0))[:1]:
        what = f"'{table.as_written(k)}' is {marks[row]:g}; allowed: 1 for a frame that is used, 0 for one that is not"
        raise HistoryError(f"{table.location(int(table.lines[row]), k)}: {what}")


def _without_readings_before_steps(frames: TableFrames, imposed: Sequence[Floats]) -> TableFrames:
    """The frames with the later of two of one time that differ in load or temperature.

    A reading before a change of load and one after it state when it was; the mean of both would be neither.
    """
    changed = np.any([np.diff(column) != 0.0 for column in imposed], axis=0)
    before = np.flatnonzero((np.diff(frames.times) == 0.0) & changed)
    values = {name: np.delete(column, before) for name, column in frames.values.items()}
    marked = frozenset(frames.lines[before + 1].tolist())
    return TableFrames(frames.table, values, np.delete(frames.lines, before), marked=marked)


def _strictly_increasing(frames: TableFrames) -> TableFrames:
    """Refuse a time that falls; merge frames of equal time, of a clock coarser than the recording, into their mean.

    At the first time the last one counts, which is that behind loading, and at the last time the first, which is that
    before rupture; how many were merged is kept.
    """
    time_differences = np.diff(frames.times)
    if (time_differences < 0).any():
        k = int(np.argmax(time_differences < 0)) + 1
        before, after = frames.times[k - 1], frames.times[k]
        raise HistoryError(f"{frames.location(k)}: time falls from {before:g} s to {after:g} s; it must never decrease")
    first = np.flatnonzero(np.concatenate(([True], time_differences > 0)))
    counts = np.diff(np.append(first, frames.times.size))
    values = {name: np.add.reduceat(column, first) / counts for name, column in frames.values.items()}
    for name, column in frames.values.items():
        values[name][[0, -1]] = column[[counts[0] - 1, first[-1]]]
    if first.size < 2:
        raise HistoryError(f"{frames.location(0)}: only one frame in time; at least two are needed to identify a law")
    return TableFrames(frames.table, values, frames.lines[first], frames.times.size - first.size, frames.marked)
