"""The CSV file of one history: `# key: value` lines, then a line of columns, then one frame a line.

    # alloy: Inconel 625
    # temperature_C: 760
    # stress_MPa: 120
    # control: load
    # strain_measure: engineering
    time_h,strain_pct
    0,0
    0.5,0.013

Keys and columns carry their units (`vocabulary.py` lists them). A bulge test has the columns
`time_s,amplitude_mm,width_mm,shape` and the keys pressure_1_MPa, pressure_2_MPa, jump_time_h. Anything imposed may
change: `# stress_steps: 0 s 100 MPa; 1 h 120 MPa` jumps, `# temperature_program: 0 s 700 C; 2 h 720 C` is piecewise
linear, and a column of that name was recorded: it is used, thinned to 0.25 K or 0.2 % of the load, and what is stated
beside it is kept for the check of data quality. `_sd` names a standard deviation, `used` (0 or 1) marks frames,
`# minimum_rate_1/h: 2.1e-6` and `# rupture_h: 8200` are known beside the frames, or without any: a test may be a head
alone. `# geometry apex_thickness_mm: 0.48` measures of the specimen, `# label furnace: 4` a label; an unknown key is an
error.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, quoted
from creepkit.files.writing import write_text
from creepkit.readers.assembly import assemble_history, assemble_without_frames
from creepkit.readers.conditions import noise_correlation_text
from creepkit.readers.parts_of_tests import read_tests, with_clocks_joined
from creepkit.readers.questions import ANSWERS_FILE, collected, raise_all
from creepkit.readers.remarks import notes_by_name
from creepkit.readers.table import CellTable, SourceText
from creepkit.readers.table_heads import is_frame, names_time
from creepkit.readers.table_layouts import TabulatedTest
from creepkit.readers.tests_file import EXCLUDE
from creepkit.readers.text_files import peek_table, read_head_alone
from creepkit.readers.vocabulary import SPECIMEN_NAME_PATTERN, HeaderVocabulary, Terms, split_unit
from creepkit.readers.weak_sources import sources_of_names
from creepkit.records import (
    UNKNOWN_DURATION,
    History,
    PointLoading,
    PressureJump,
    Program,
    StrainSteps,
    StressSteps,
    load_unit,
)
from creepkit.records.loading import held_of
from creepkit.records.quantities import LENGTH


@dataclass(frozen=True)
class HistoryCsvReader:
    """Reader of text tables of one test or several: any delimiter, decimal sign and encoding.

    columns : columns by which a file of this laboratory is recognised; () accepts every CSV file.
    vocabulary : names that the laboratory uses in heads and columns.
    """

    name: str
    title: str
    columns: tuple[str, ...] = ()
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is a text table with the columns."""
        if path.suffix.lower() not in (*TABLE_SUFFIXES, *TEXT_SUFFIXES) or not path.is_file():
            return False
        if not self.columns and path.suffix.lower() in TABLE_SUFFIXES:
            return True
        grid = peek_table(path)
        if self.columns:
            return grid is not None and set(self.columns) <= set(grid.rows[0].cells)
        return grid is not None and _has_numbers(grid) and names_time(grid, self.vocabulary)

    def read(self, path: Path) -> list[History]:
        """Return the histories in the file; a head without frames is that of a test known by rate or end alone."""
        head = read_head_alone(path)
        if head and any(key.startswith(("minimum_rate", "rupture", "ended")) for key in head):
            return [assemble_without_frames(path.stem, head, self.vocabulary, location=str(path), source=str(path))]
        first, tests = read_tests(path, self.vocabulary)
        return histories_of_tests(tests, first, self.vocabulary)


def _has_numbers(grid: CellTable) -> bool:
    """Whether some row holds numbers alone, with either decimal sign."""
    signs = [replace(grid, dialect=replace(grid.dialect, decimal=sign)) for sign in ".,"]
    return any(is_frame(row, one) for one in signs for row in grid.rows)


TABLE_SUFFIXES, TEXT_SUFFIXES = (".csv", ".tsv", ".lvm"), (".txt", ".dat", ".asc", ".prn", ".tra")
"""Endings of files that are taken for tables, and of those that are where a column of time is among the first names."""

HISTORY_CSV = HistoryCsvReader("csv", "a table as text: `# key: value` lines, then columns such as time_s,strain_pct")


def histories_of_tests(found: Iterable[TabulatedTest], path: Path, vocabulary: HeaderVocabulary) -> list[History]:
    """The histories of the tests in one file; those without a name have that of their sheet or of the file."""
    tests = with_clocks_joined(list(found), path, vocabulary)
    names = _names_of(tests, path)
    errors, histories = list[HistoryError](), list[History]()
    tests = [
        replace(one, table=replace(one.table, sources=(*one.table.sources, *sources_of_names(one.table, vocabulary))))
        for one in tests
    ]
    _refuse_one_for_all(tests, vocabulary)
    notes = notes_by_name([test.entries for test in tests], names) if tests else ()
    stated = [vocabulary.of_tests.get(name, {}) for name in names]
    excluded = [
        f"without {name} ({own[EXCLUDE][0]})" for name, own in zip(names, stated, strict=True) if EXCLUDE in own
    ]
    for said, own, test, name in zip(stated, notes, tests, names, strict=True):
        if EXCLUDE in said:
            continue
        test = _with_answers(replace(test, entries=own), said, vocabulary.terms())
        table = test.table.assuming(*excluded)
        unique = f"{table.sheet}/{name}" if len(set(names)) < len(names) and table.sheet else name
        parts = [f"sheet {table.sheet}"] * bool(table.sheet) + [test.name] * bool(test.name)
        source = f"{path} ({', '.join(parts)})" if parts and len(tests) > 1 else str(path)
        make = partial(assemble_history, unique, test.entries, table, vocabulary, location=table.place, source=source)
        history = collected(errors, make)
        histories += [] if history is None else [history]
    raise_all(errors)
    return histories


def _with_answers(test: TabulatedTest, stated: Mapping[str, tuple[str, str]], known: Terms) -> TabulatedTest:
    """The test with what a file of answers states of it alone, in the place of what its own file states."""

    def quantity(key: str) -> str:
        found = split_unit(known.condition(key), known.conditions.kinds)
        return found[0] if found else known.condition(key)

    said = {*map(quantity, stated)}
    others = {key: entry for key, entry in test.entries.items() if quantity(key) not in said}
    own = {key: SourceText(text, place) for key, (text, place) in stated.items()}
    notes = (f"{key} {entry.text} of {ANSWERS_FILE}" for key, entry in own.items())
    return replace(test, entries={**others, **own}, table=test.table.assuming(*notes))


def _names_of(tests: Sequence[TabulatedTest], path: Path) -> list[str]:
    """The names of tests; those without one have that of their sheet or of the file, with a number where it is twice.

    HistoryError where two are called the same.
    """
    sheets = {test.table.sheet for test in tests}
    names = [test.name or (test.table.sheet if len(sheets) > 1 else path.stem) for test in tests]
    places = [(test.table.sheet, name) for test, name in zip(tests, names, strict=True)]
    for k, test in enumerate(tests):
        if places.count(places[k]) > 1 and test.name:
            what = f"two tests are called '{quoted(test.name, 60)}'; give each its own name"
            raise HistoryError(f"{test.table.location(test.table.columns_line)}: {what}")
        if places.count(places[k]) > 1:
            names[k] = f"{names[k]} ({places[: k + 1].count(places[k])})"
    return names


def _refuse_one_for_all(tests: Sequence[TabulatedTest], vocabulary: HeaderVocabulary) -> None:
    """HistoryError where an answer for a file states one value, and the names and titles of its tests several."""
    for key, (text, place) in vocabulary.stated.items():
        found = split_unit(key, vocabulary.terms().conditions.kinds)
        of_tests = ([one.text for one in test.table.sources if found and one.key == found[0]] for test in tests)
        said = dict.fromkeys(texts[0] for texts in of_tests if texts)
        if len(said) > 1:
            several = " and ".join([*map(quoted, list(said)[:3]), *["others"] * (len(said) > 3)])
            what = f"{key} {text} would hold for all tests of '{tests[0].table.path.name}', which say {several}"
            raise HistoryError(f"{place}: {what}; remove it, or correct the file")


@checked
def write_history(history: History, path: str | Path) -> Path:
    """Write a history as CSV, in s, MPa, mm, K, and return the path; nothing is half-written.

    All is kept but `source`, which is the file from then on. A loading without words of its own is written as its
    program, and elastic data that depend on temperature as their values at the temperature of the test.
    """
    return write_text(history_text(history), Path(path), HistoryError)


def history_text(history: History) -> str:
    """The text of the CSV file of a history; HistoryError when it could not be read back."""
    if not history.outputs:
        return _text_without_frames(history)
    if history.times.size < 2:
        raise HistoryError(f"history '{history.name}' has one frame; at least two can be written and read back")
    columns = dict(_frame_columns(history, HeaderVocabulary().terms(history.specimen)))
    for name, values in columns.items():
        if not np.isfinite(values).all():
            raise HistoryError(f"history '{history.name}': '{name}' holds a number that is not finite; drop that frame")
    rows = (",".join(map(_number_text, row)) for row in zip(*columns.values(), strict=True))
    return _head_text(history) + "\n".join([",".join(columns), *rows]) + "\n"


def _text_without_frames(history: History) -> str:
    """The head of a test of which only the minimum rate, or its end, is known."""
    known = history.minimum_rate is not None or history.end_known
    if not known or history.times.size > 1:
        problem = "no minimum rate and no known end" if not known else f"{history.times.size} times"
        raise HistoryError(f"history '{history.name}' has no outputs and {problem}; it cannot be written and read back")
    return _head_text(history)


def _head_text(history: History) -> str:
    return "".join(f"# {key}: {_one_line(history, text)}\n" for key, text in _header_lines(history))


def _header_lines(history: History) -> Iterator[tuple[str, str]]:
    """Key and text of every line of the head."""
    yield "name", history.name
    if not SPECIMEN_NAME_PATTERN.fullmatch(history.specimen):
        raise HistoryError(f"history '{history.name}': specimen '{history.specimen}' is not a name in small letters")
    yield "specimen", history.specimen
    if history.alloy:
        yield "alloy", history.alloy
    yield from _loading_lines(history)
    yield from _temperature_lines(history)
    for quantity, program in history.stated.items():
        unit = "K" if quantity == "temperature" else load_unit(history)
        yield f"stated_{quantity}_program", _program_text(program, unit)
    yield from _elastic_lines(history)
    yield "strain_measure", history.strain_measure
    if history.includes_elastic or not history.outputs or any(one.startswith("strain") for one in history.outputs):
        yield "includes_elastic", "yes" if history.includes_elastic else "no"
    if history.rupture_time is not None:
        yield "rupture_s", _number_text(history.rupture_time)
    if history.unruptured:
        yield "ended", "stopped"
    if not history.outputs and history.rupture_time is None and history.times[-1] != UNKNOWN_DURATION:
        yield "end_time_s", _number_text(float(history.times[-1]))
    for key, rate in (("minimum_rate", history.minimum_rate), ("minimum_rate_sd", history.minimum_rate_sd)):
        if rate is not None:
            yield f"{key}_1/s", _number_text(rate)
    if history.operator:
        yield "operator", history.operator
    if history.outputs and history.noise_correlation:
        yield "noise_correlation", noise_correlation_text(history.noise_correlation)
    for key, value in history.geometry.items():
        # A bare number is read as it stands, but a name that ends in a unit would lose it.
        unit = "_mm" if key.rpartition("_")[2] in LENGTH.units else ""
        yield f"geometry {_header_key(history, key)}{unit}", _number_text(value)
    for key, text in history.labels.items():
        yield f"label {_header_key(history, key)}", text


def _loading_lines(history: History) -> Iterator[tuple[str, str]]:
    loading = history.loading
    if isinstance(loading, PressureJump):
        yield "pressure_1_MPa", _number_text(loading.P1)
        yield "pressure_2_MPa", _number_text(loading.P2)
        yield "jump_time_s", _number_text(loading.Tj)
        yield "ramp_s", _number_text(loading.ramp)
    elif isinstance(loading, StressSteps) and len(loading.steps) == 1:
        yield "stress_MPa", _number_text(loading.steps[0][1])
    elif isinstance(loading, StressSteps):
        yield "stress_steps", _pairs_text(loading.steps, "MPa")
    elif isinstance(loading, PointLoading):
        yield from ((f"stress_{name}_program", _program_text(p, "MPa")) for name, p in loading.stress.items())
        yield from ((f"strain_{name}_program", _program_text(p, "")) for name, p in loading.strain.items())
    elif isinstance(loading, StrainSteps) and loading.ramp == 0.0:
        yield "strain_steps", _pairs_text(loading.steps, "")
    elif loading.quantity == "strain":
        yield "strain_program", _program_text(loading.program(), "")
    else:
        yield f"{loading.quantity}_program", _program_text(loading.program(), load_unit(history))
    if loading.quantity == "stress":
        yield "control", held_of(loading)


def _temperature_lines(history: History) -> Iterator[tuple[str, str]]:
    if isinstance(history.temperature, Program):
        yield "temperature_program", _program_text(history.temperature, "K")
    else:
        yield "temperature_K", _number_text(history.temperature)


def _elastic_lines(history: History) -> Iterator[tuple[str, str]]:
    if history.elastic is None:
        return
    elastic = history.elastic
    if not (isinstance(elastic.E, float) and isinstance(elastic.nu, float)):
        if isinstance(history.temperature, Program):
            what = "elastic data that change during a test cannot be written; replace them by elastic.at(T)"
            raise HistoryError(f"history '{history.name}': {what}")
        elastic = elastic.at(history.temperature)
    yield "modulus_MPa", _number_text(float(elastic.E))
    yield "poisson", _number_text(float(elastic.nu))


def _frame_columns(history: History, terms: Terms) -> Iterator[tuple[str, Floats]]:
    yield "time_s", history.times
    kinds = {**terms.output_kinds(), **terms.own_outputs}
    standard_deviations = {f"{name}_sd": values for name, values in history.standard_deviation.items()}
    for name, values in {**history.outputs, **standard_deviations}.items():
        kind = kinds.get(name.removesuffix("_sd"))
        if kind is None:
            what = f"no registered specimen has an output '{name}', whose unit is not known; known: {', '.join(kinds)}"
            raise HistoryError(f"history '{history.name}': {what}")
        # A strain is written with its unit, 1, for without one it may be a fraction or in per cent.
        unit = "1" if kind.is_ambiguous_without_unit else next(iter(kind.units))
        yield f"{name}_{unit}" if unit else name, values
    used = np.asarray(history.used)
    if not used.all():
        yield "used", used.astype(float)


def _number_text(number: float) -> str:
    """The shortest text that reads back as the same number."""
    return repr(float(number))


def _program_text(program: Program, unit: str) -> str:
    return _pairs_text(zip(program.times, program.values, strict=True), unit)


def _pairs_text(pairs: Iterator[tuple[float, float]] | tuple[tuple[float, float], ...], unit: str) -> str:
    return "; ".join(f"{_number_text(time)} s {_number_text(value)} {unit}".rstrip() for time, value in pairs)


def _one_line(history: History, text: str) -> str:
    """Refuse what would not survive as part of one line."""
    if text != text.strip() or not text.isprintable():
        raise HistoryError(f"history '{history.name}': {text!r} cannot be written in one line; use plain words there")
    return text


def _header_key(history: History, key: str) -> str:
    if ":" in key or not key:
        raise HistoryError(f"history '{history.name}': {key!r} cannot name a line; use words without a colon")
    return _one_line(history, key)
