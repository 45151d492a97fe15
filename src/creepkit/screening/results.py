"""Results of a screening: AlloyResult of one alloy and ScreeningResult of all, and their files.

One JSON file an alloy, read strictly, and a CSV table of the whole plate.
"""

from __future__ import annotations

import csv
import io
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from creepkit.errors import SAID, FitError, refuse_unknown, restated
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError, ValueCodec
from creepkit.files.writing import write_text
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import CODEC as FIT_CODEC
from creepkit.inverse.identification_document import identification_from_json, identification_to_json
from creepkit.inverse.selection import CREDIBLE_WEIGHT
from creepkit.inverse.selection.ranking import RankedLaw
from creepkit.limits import ANY_NUMBER
from creepkit.records import History, Predictor
from creepkit.records.presentable import Plotted, Presentable
from creepkit.screening.alloys import UNKNOWN_CLASS, Alloy, Compositions

"""{output: (frames,) mm or strain} of one test."""


@dataclass(frozen=True, eq=False)
class AlloyResult:
    """The laws of one alloy.

    fingerprint : of its tests and settings; a result with the same one is not computed again.
    laws : identified laws, best first; failed_laws : {law: why it could not be identified}.
    verdict : one sentence on which law it is; equivalents : on each pair of laws that the tests cannot separate.
    failure : why there is no law; empty otherwise.
    dense_fit : the law without sparsity, where it was requested.
    cpu_seconds : CPU time of the identification.
    decisive : whether the ranking of its laws is (see inverse.selection.ranking).
    """

    alloy: str
    fingerprint: str = ""
    laws: tuple[RankedLaw, ...] = ()
    failed_laws: Mapping[str, str] = field(default_factory=dict)
    verdict: str = ""
    equivalents: tuple[str, ...] = ()
    failure: str = ""
    dense_fit: Identification | None = None
    notes: tuple[str, ...] = ()
    cpu_seconds: float = 0.0
    decisive: bool = False

    @property
    def identified(self) -> bool:
        """Whether some law was."""
        return bool(self.laws)

    @property
    def best(self) -> Identification:
        """The law of largest weight."""
        if not self.laws:
            raise FitError(f"alloy '{self.alloy}' has no identified law: {self.failure}")
        return self.laws[0].fit

    @property
    def credible_laws(self) -> tuple[str, ...]:
        """Names of the laws that the tests cannot rule out, best first."""
        return tuple(w.fit.law.name for k, w in enumerate(self.laws) if k == 0 or w.weight > CREDIBLE_WEIGHT)

    def with_tests(self, tests: tuple[History, ...], predictor: Predictor) -> AlloyResult:
        """The same with its tests and predictor attached to every identification, for predictions and plots."""
        laws = tuple(replace(w, fit=w.fit.with_histories(tests, predictor)) for w in self.laws)
        dense = self.dense_fit and self.dense_fit.with_histories(tests, predictor)
        return replace(self, laws=laws, dense_fit=dense)


def mean_relative_squared_error(fit: Identification) -> float:
    """Eq. (4) of Chen et al.: relative squared errors, the mean over outputs."""
    return float(np.mean([e.relative_squared_error for e in fit.errors.values()]))


@dataclass(frozen=True, eq=False)
class ScreeningResult(Presentable, Plotted):
    """The result of screen().

    results : one for each alloy, in the order of their first tests. histories : {alloy: its tests}.
    compositions : of the alloys, None where they are not known. folder : where the results are kept, or None.
    notes : what is unusual about the plate as a whole.
    """

    results: tuple[AlloyResult, ...]
    histories: Mapping[str, tuple[History, ...]]
    compositions: Compositions | None = None
    folder: Path | None = None
    notes: tuple[str, ...] = field(default=())

    @classmethod
    def from_results(
        cls,
        alloys: Sequence[Alloy],
        results: Sequence[AlloyResult],
        predictor: Predictor,
        compositions: Compositions | None,
        folder: Path | None,
    ) -> ScreeningResult:
        """The plate of these alloys, with tests and predictor attached to their identifications."""
        notes = () if compositions is None else compositions.missing([a.name for a in alloys])
        attached = tuple(
            result.with_tests(alloy.tests, predictor) for result, alloy in zip(results, alloys, strict=True)
        )
        return cls(attached, {a.name: a.tests for a in alloys}, compositions, folder, notes)

    @property
    def identified(self) -> tuple[AlloyResult, ...]:
        """The alloys that have a law."""
        return tuple(result for result in self.results if result.identified)

    @property
    def failures(self) -> dict[str, str]:
        """{alloy: why it has no law}."""
        return {result.alloy: result.failure for result in self.results if not result.identified}

    def __getitem__(self, alloy: str) -> AlloyResult:
        known = {result.alloy: result for result in self.results}
        refuse_unknown(alloy, known, FitError, f"the plate has no alloy '{alloy}'")
        return known[alloy]

    def class_of(self, alloy: str) -> str:
        """The class of an alloy by its principal element; "unknown" without compositions."""
        return UNKNOWN_CLASS if self.compositions is None else self.compositions.class_of(alloy)

    def by_class(self) -> dict[str, tuple[AlloyResult, ...]]:
        """{class: its identified alloys}: rich in something first, the largest class first, then the others."""
        members: dict[str, list[AlloyResult]] = defaultdict(list)
        for result in self.identified:
            members[self.class_of(result.alloy)].append(result)
        ordered_classes = sorted(
            members, key=lambda name: (not name.endswith("-rich"), name == UNKNOWN_CLASS, -len(members[name]), name)
        )
        return {name: tuple(members[name]) for name in ordered_classes}

    def law_fractions(self) -> dict[str, dict[str, float]]:
        """{class: {law: mean weight over the alloys of the class}} (Fig. 7c, undecided alloys counted by weight)."""
        fractions = {}
        for name, members in self.by_class().items():
            weights: dict[str, float] = defaultdict(float)
            for member in members:
                for w in member.laws:
                    weights[w.fit.law.name] += w.weight / len(members)
            fractions[name] = dict(sorted(weights.items()))
        return fractions

    def to_csv(self, path: str | Path) -> Path:
        """Write one row an alloy: class, law, weight, values with intervals, rate, misfits, notes."""
        return write_csv(self, Path(path))

    drawn_by = "screening.screening_figure", "screening.draw_rates_of_alloys"

    shown_by = "screening.screening_text"


ALLOY_RESULT = DocumentFormat(
    "creepkit-alloy-result",
    4,
    FileKind("the result of an alloy", FitError, "remove it, and it is worked out again"),
    remedy="remove it, and it is worked out again",
)


CODEC = RecordCodec(
    ranges={RankedLaw: {"chi_square": ANY_NUMBER}, **FIT_CODEC.ranges},
    values={Identification: ValueCodec(identification_to_json, identification_from_json)},
)
"""Of the result of an alloy; its identifications are documents of their own inside it."""


def write_result(result: AlloyResult, path: Path) -> Path:
    """Write the result of an alloy; the file is whole or absent."""
    return write_json({**ALLOY_RESULT.heading, **CODEC.to_json(result)}, path, ALLOY_RESULT.kind, internal=True)


def read_result(path: Path) -> AlloyResult:
    """Read the result of an alloy; FitError, in one sentence, for any other file."""
    content = check_heading(read_json(path, ALLOY_RESULT.kind), str(path), ALLOY_RESULT)
    with restated(RecordError, FitError, f"{path}: {SAID}; {ALLOY_RESULT.remedy}"):
        return CODEC.from_json(AlloyResult, content)


COMPARISON_STRESS = 100.0
"""MPa, at which rates and local exponents of alloys are compared."""


COMPARED = ("rate", "local_exponent")
"""Methods of an identification that give them, with ends of intervals."""


def result_columns(plate: ScreeningResult, result: AlloyResult) -> dict[str, str]:
    """Everything that the CSV says of one alloy."""
    columns = {
        "alloy": result.alloy,
        "class": plate.class_of(result.alloy),
        "tests": str(len(plate.histories[result.alloy])),
    }
    if not result.identified:
        return {**columns, "notes": result.failure}
    fit, numbers = result.best, dict[str, float]()
    columns |= {"law": fit.law.name, "weight": _number_text(result.laws[0].weight)}
    columns |= {"decisive": "yes" if result.decisive else "no", "verdict": result.verdict}
    if fit.adequacy is not None:
        left = {f"discrepancy_{o.output}": _number_text(o.discrepancy) for o in fit.adequacy.outputs}
        columns |= {"adequacy": fit.adequacy.verdict, "p_value": _number_text(fit.adequacy.p_value), **left}
    columns |= {"not_ruled_out": "; ".join(result.credible_laws[1:]), "equivalents": "; ".join(result.equivalents)}
    for name in COMPARED:
        ends = getattr(fit, name)(COMPARISON_STRESS, warn=False)
        numbers |= {f"{name}_100MPa{end}": float(v) for end, v in zip(("", "_low", "_high"), ends, strict=True)}
    for name, unit in (("strain", ""), ("time", "_s"), ("temperature", "_K")):
        numbers[f"rate_{name}{unit}"] = getattr(fit.reference, name)
    numbers |= {f"rse_{name}": e.relative_squared_error for name, e in fit.errors.items()}
    numbers |= {f"chi_square_{name}": e.chi_square for name, e in fit.errors.items()}
    columns |= {name: _number_text(v) for name, v in numbers.items()} | {"confirmed": confirmation_text(result)}
    columns["loss_reduced"] = _number_text(mean_relative_squared_error(fit))
    columns["loss_dense"] = (
        "" if result.dense_fit is None else _number_text(mean_relative_squared_error(result.dense_fit))
    )
    for e in fit.estimates:
        ends = {e.name: e.value, f"{e.name}_low": e.low, f"{e.name}_high": e.high}
        columns |= {name: _number_text(v) for name, v in ends.items()}
    notes = [*result.notes, *(f"{law}: {why}" for law, why in result.failed_laws.items())]
    return {**columns, "notes": "; ".join(notes)}


def write_csv(plate: ScreeningResult, path: Path) -> Path:
    """Write the whole table; columns of parameters are those of all laws found, empty where a law has none."""
    rows = [result_columns(plate, result) for result in plate.results]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    columns.sort(key=lambda name: name == "notes")
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return write_text(text.getvalue(), path, FitError)


def confirmation_text(result: AlloyResult) -> str:
    """Whether a more exact simulation confirms the result: yes, no, or nothing where there is none."""
    error = result.best.numerical_error
    return "" if error is None else "yes" if error.confirms else "no"


def _number_text(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.7g}"
