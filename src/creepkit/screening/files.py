"""Files of a screening: one JSON file an alloy, read strictly, and a CSV table of the whole plate."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import FitError
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import ANY_NUMBER, RecordCodec, RecordError, ValueCodec
from creepkit.files.writing import write_text
from creepkit.inverse.confirmation import ConfirmedOutput
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import CODEC as FIT_CODEC
from creepkit.inverse.identification_document import identification_from_json, identification_to_json
from creepkit.screening.results import AlloyResult, mean_relative_squared_error

if TYPE_CHECKING:
    from creepkit.screening.results import ScreeningResult


ALLOY_RESULT = DocumentFormat(
    "creepkit-alloy-result",
    2,
    FileKind("the result of an alloy", FitError, "remove it, and it is worked out again"),
    remedy="remove it, and it is worked out again",
)


CODEC = RecordCodec(
    ranges={ConfirmedOutput: {"rms_difference": ANY_NUMBER}, **FIT_CODEC.ranges},
    values={Identification: ValueCodec(identification_to_json, identification_from_json)},
)
"""Of the result of an alloy; its identifications are documents of their own inside it."""


def write_result(result: AlloyResult, path: Path) -> Path:
    """Write the result of an alloy; the file is whole or absent."""
    return write_json({**ALLOY_RESULT.heading, **CODEC.to_json(result)}, path, ALLOY_RESULT.kind, internal=True)


def read_result(path: Path) -> AlloyResult:
    """Read the result of an alloy; FitError, in one sentence, for any other file."""
    content = check_heading(read_json(path, ALLOY_RESULT.kind), str(path), ALLOY_RESULT)
    try:
        return CODEC.from_json(AlloyResult, content)
    except RecordError as error:
        raise FitError(f"{path}: {error}; {ALLOY_RESULT.remedy}") from None


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
    fit, confirmation, numbers = result.best, result.confirmation, dict[str, float]()
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
    simulated: dict[str, list[float]] = {}
    for one in (o for test in (confirmation.tests if confirmation is not None else ()) for o in test.outputs):
        simulated.setdefault(one.output, []).append(one.simulation_errors.chi_square)
    columns |= {f"confirmed_chi_square_{name}": _number_text(sum(v) / len(v)) for name, v in simulated.items()}
    columns["loss_reduced"] = _number_text(mean_relative_squared_error(result.reduced_fit))
    columns["loss_dense"] = (
        "" if result.dense_fit is None else _number_text(mean_relative_squared_error(result.dense_fit))
    )
    if result.sparse_fit is not None:
        columns["law_by_penalty"] = result.sparse_fit.law.name
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
    """Whether the full simulation confirmed the result: yes, no, or nothing where it was not asked."""
    if result.confirmation is None:
        return ""
    return "yes" if result.confirmation.confirmed else "no"


def _number_text(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.7g}"
