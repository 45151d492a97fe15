"""Alloys: the tests of each, what is wrong with them before an identification, and their compositions.

Compositions are read from a table in weight or atomic per cent:

    # unit: wt.%
    alloy,Ni,Cr,Mo,Fe
    IN625,65.5,21.5,9,4

An alloy is "Ni-rich", after its principal element in atomic per cent, unless the second element comes within 5 at.% of
it: then it is "near-equimolar". (The paper classifies by the largest weight fraction and names near-equimolar alloys
without a rule; this rule is ours.)
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from creepkit.errors import FitError, HistoryError, nearest
from creepkit.files.delimited_text import parse_number
from creepkit.inverse.reference_conditions import detect_creep, distinct_loads
from creepkit.readers.table import CellTable
from creepkit.readers.text_files import read_table
from creepkit.records import History, Predictor, is_logarithmic


@dataclass(frozen=True)
class Alloy:
    """An alloy and all its tests, which are identified together."""

    name: str
    tests: tuple[History, ...]


def group_by_alloy(histories: Sequence[History]) -> tuple[Alloy, ...]:
    """The alloys in the order of their first tests; a test that names no alloy is one by itself."""
    tests_by_alloy: dict[str, list[History]] = {}
    for history in histories:
        tests_by_alloy.setdefault(history.alloy or history.name, []).append(history)
    return tuple(Alloy(name, tuple(tests)) for name, tests in tests_by_alloy.items())


def check_tests(alloy: Alloy, predictor: Predictor) -> None:
    """FitError, in one sentence, for tests that do not belong together, lack an output, or show no creep."""
    _check_specimens(alloy, predictor)
    creep_outputs = [(test, _creep_output(test, predictor)) for test in alloy.tests]
    for test, output in creep_outputs:
        if output not in test.outputs or not np.isfinite(test.outputs[output][test.used]).any():
            raise FitError(
                f"alloy '{alloy.name}': test '{test.name}' has no {output}, without which creep cannot be seen; it has "
                f"{', '.join(test.outputs) or 'no output'}"
            )
    _check_creep(alloy, creep_outputs)


def limitations(alloy: Alloy, predictor: Predictor) -> tuple[str, ...]:
    """Notes on what the tests of an alloy leave unknown, whatever law is identified from them."""
    notes, tests = [], alloy.tests
    if len(tests) == 1:
        notes.append("one test: how dimples or bars of this alloy differ cannot be known from it")
    if len(distinct_loads(tests)) == 1:
        notes.append("one level of load: strain and time hardening are nearly the same law then")
    if len({round(float(v)) for t in tests for v in t.temperature_program().values}) == 1:
        notes.append("one temperature: the activation energy cannot be known")
    specimens = sorted({t.specimen for t in tests})
    if len(specimens) > 1:
        notes.append(f"tests of several specimens ({', '.join(specimens)}) are identified together")
    for name in predictor.for_history(tests[0]).outputs_of_test(tests[0])[1:]:
        lacking = [t.name for t in tests if name not in t.outputs]
        if lacking:
            notes.append(f"no {name} in {len(lacking)} of {len(tests)} tests: the stress exponent is known the less")
    return tuple(notes)


def _check_specimens(alloy: Alloy, predictor: Predictor) -> None:
    """One predictor serves one specimen; several need one each."""
    specimens = sorted({test.specimen for test in alloy.tests})
    if predictor.parts:
        unpredicted = [kind for kind in specimens if kind not in predictor.parts]
        remedy = f"using= names predictors for {', '.join(predictor.parts)}; add it" if unpredicted else ""
    else:
        specimen_name = predictor.specimen.name
        unpredicted = [kind for kind in specimens if kind != specimen_name]
        remedy = f"using= predicts {specimen_name}; give using= a predictor for each, or screen them apart"
    if unpredicted:
        problem = "its tests are of different specimens" if len(specimens) > 1 else "its tests are of another specimen"
        raise FitError(f"alloy '{alloy.name}': {problem} ({', '.join(specimens)}) and {remedy}")


def _check_creep(alloy: Alloy, creep_outputs: Sequence[tuple[History, str]]) -> None:
    detections = [(output, detect_creep(test, output)) for test, output in creep_outputs if not is_logarithmic(output)]
    if not detections or len(detections) < len(alloy.tests) or any(g.shows_creep for _, g in detections):
        return
    output, largest = max(detections, key=lambda pair: pair[1].increase)
    raise FitError(
        f"alloy '{alloy.name}': elastic only, there is no creep to identify: its {output} grows by "
        f"{largest.increase:.2g} while the load is held, within its noise of {largest.noise:.2g}; "
        "test it longer, hotter or at a higher load"
    )


def _creep_output(test: History, predictor: Predictor) -> str:
    """The output that grows with creep."""
    outputs = predictor.for_history(test).outputs_of_test(test)
    return str(outputs[0]) if outputs else next(iter(test.outputs), "output")


ATOMIC_WEIGHTS = {
    "H": 1.008, "B": 10.81, "C": 12.011, "N": 14.007, "O": 15.999, "Mg": 24.305, "Al": 26.982, "Si": 28.085,
    "P": 30.974, "S": 32.06, "Ca": 40.078, "Ti": 47.867, "V": 50.942, "Cr": 51.996, "Mn": 54.938, "Fe": 55.845,
    "Co": 58.933, "Ni": 58.693, "Cu": 63.546, "Zn": 65.38, "Y": 88.906, "Zr": 91.224, "Nb": 92.906, "Mo": 95.95,
    "Ru": 101.07, "Rh": 102.906, "Pd": 106.42, "Ag": 107.868, "Sn": 118.71, "La": 138.905, "Ce": 140.116,
    "Hf": 178.486, "Ta": 180.948, "W": 183.84, "Re": 186.207, "Ir": 192.217, "Pt": 195.084, "Au": 196.967,
    "Pb": 207.2, "Bi": 208.98,
}  # fmt: skip
"""{symbol: standard atomic weight}, abridged: IUPAC, Prohaska et al. (2022), Pure Appl. Chem. 94, 573."""


EQUIMOLAR_MARGIN = 5.0
"""at.% between the two largest elements of an alloy below which it is near-equimolar."""


NEAR_EQUIMOLAR, UNKNOWN_CLASS = "near-equimolar", "unknown"


COMPOSITION_UNITS = ("wt.%", "at.%")


ALLOWED_TOTAL = (98.0, 102.0)
"""Per cent that the elements of an alloy must add up to; they are scaled to 100."""


@dataclass(frozen=True)
class Compositions:
    """Compositions of alloys, {alloy: {element: at.%}}, and their source."""

    atomic: Mapping[str, Mapping[str, float]]
    source: str = ""

    def class_of(self, alloy: str) -> str:
        """Class of an alloy, such as "Fe-rich" or "near-equimolar"; "unknown" for an alloy that the table lacks."""
        if alloy not in self.atomic:
            return UNKNOWN_CLASS
        contents = sorted(self.atomic[alloy].items(), key=lambda pair: -pair[1])
        if len(contents) > 1 and contents[0][1] - contents[1][1] < EQUIMOLAR_MARGIN:
            return NEAR_EQUIMOLAR
        return f"{contents[0][0]}-rich"

    def missing(self, alloys: list[str]) -> tuple[str, ...]:
        """One sentence for each alloy that is not in the table."""
        return tuple(
            f"{self.source or 'the compositions'}: no alloy '{name}', whose class stays unknown; "
            f"{nearest(name, self.atomic)}"
            for name in alloys
            if name not in self.atomic
        )


def atomic_percent(weights: Mapping[str, float]) -> dict[str, float]:
    """{element: at.%} from {element: wt.%}: x_i = (w_i / M_i) / sum (w_j / M_j)."""
    moles = {element: weight / ATOMIC_WEIGHTS[element] for element, weight in weights.items()}
    return {element: 100.0 * n / sum(moles.values()) for element, n in moles.items()}


def resolve_compositions(compositions: Compositions | str | Path | None) -> Compositions | None:
    """The compositions themselves, or those of a table."""
    return read_compositions(compositions) if isinstance(compositions, (str, Path)) else compositions


_CONTENT = re.compile(r"([A-Z][a-z]?)\W*(wt|at|mass|mol|atom|weight|m|a)?[-.\s]*%?\W*")
"""An element and its unit in the head of a column: Ni, Ni [wt.%], Ni (at.%), Ni at%."""


BALANCE = ("bal", "bal.", "balance", "rest", "basis", "base", "rem")
"""What a table writes for the element that makes 100 %."""


def compositions_of_labels(tests: Mapping[str, Sequence[History]]) -> Compositions | None:
    """The compositions that tests carry as labels, such as the columns of a table of alloys; None where they do not.

    tests : {alloy: its tests}. A content without a unit is in wt.%.
    """
    found = {}
    for name, own in tests.items():
        contents, atomic = dict[str, float](), False
        labels = {label: text for test in own for label, text in test.labels.items()}
        heads = {label: head for label in labels if (head := _CONTENT.fullmatch(label)) and head[1] in ATOMIC_WEIGHTS}
        for label, head in heads.items():
            with suppress(ValueError):
                contents[head[1]] = float(labels[label].replace(",", ".") or 0.0)
                atomic |= (head[2] or "").startswith(("at", "mol"))
        balance = [head[1] for label, head in heads.items() if labels[label].strip().casefold() in BALANCE]
        if len(balance) == 1:
            contents[balance[0]] = 100.0 - sum(contents.values())
        if (
            contents
            and min(contents.values()) >= 0.0
            and ALLOWED_TOTAL[0] <= sum(contents.values()) <= ALLOWED_TOTAL[1]
        ):
            contents = {element: content for element, content in contents.items() if content > 0.0}
            found[name] = contents if atomic else atomic_percent(contents)
    return Compositions(found, "columns of elements") if found else None


def read_compositions(path: str | Path) -> Compositions:
    """Read a table of compositions; HistoryError, with file and line, says what is wrong with another."""
    table = read_table(Path(path))
    unit = _composition_unit(table)
    elements = _element_columns(table)
    compositions: dict[str, Mapping[str, float]] = {}
    for row in table.rows:
        place, name = table.location(row.line), row.cells[table.column("alloy")]
        if not name or name in compositions:
            raise HistoryError(f"{place}: alloy '{name}' stands there twice or has no name; give each its own")
        contents = {e: parse_number(row.cells[table.column(e)] or "0", table.dialect, place, e) for e in elements}
        contents = {element: value for element, value in _scaled_to_100(contents, place, name).items() if value > 0}
        compositions[name] = atomic_percent(contents) if unit == "wt.%" else contents
    return Compositions(compositions, str(path))


def _composition_unit(table: CellTable) -> str:
    entry = table.header.get("unit")
    if entry is None or entry.text not in COMPOSITION_UNITS:
        problem = "no line '# unit: ...'" if entry is None else f"unit '{entry.text}'"
        place = table.path if entry is None else entry.location
        raise HistoryError(f"{place}: {problem}; write '# unit: wt.%' or '# unit: at.%' above the columns")
    return entry.text


def _element_columns(table: CellTable) -> list[str]:
    table.column("alloy")
    elements = [name for name in table.columns if name != "alloy"]
    for name in elements:
        if name not in ATOMIC_WEIGHTS:
            place = table.location(table.columns_line)
            raise HistoryError(f"{place}: column '{name}' is no element that is known; {nearest(name, ATOMIC_WEIGHTS)}")
    return elements


def _scaled_to_100(contents: Mapping[str, float], place: str, alloy: str) -> dict[str, float]:
    """The same scaled to 100 %."""
    total = sum(contents.values())
    if min(contents.values(), default=0.0) < 0:
        raise HistoryError(f"{place}: alloy '{alloy}' has a negative content; write contents from zero on")
    if not ALLOWED_TOTAL[0] <= total <= ALLOWED_TOTAL[1]:
        raise HistoryError(
            f"{place}: the elements of alloy '{alloy}' add up to {total:g} %; they must make 100 (98 to 102 are "
            "scaled), so add what is missing"
        )
    return {element: 100.0 * value / total for element, value in contents.items()}
