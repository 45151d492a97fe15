"""Files of a screening: one JSON file an alloy, a CSV table and one HDF5 file of the whole plate.

JSON is validated strictly on reading and nothing in it is evaluated. The HDF5 file is read by any HDF5 reader without
creepkit. Its attributes: `format` "creepkit-plate", `layout` 1, `units` "MPa, mm, s, K". A group `alloys` has a group
for each alloy, numbered from 0000 in the order of the plate:

    alloys/0000                  attributes: alloy, class, law (empty without one), verdict, reason, decisive, notes
      laws/0                     an identified law, best first; attributes: law, weight, excess (of BIC), converged
        values, low, high  (P,)  parameters in the author's units and their 95 % intervals; attribute `names` (P,)
        u            (P,)        conditioned coordinates; covariance (P, P) of them
      rate, local_exponent (3,)  at 100 MPa: value, low, high, of the best law
      tests/0                    attributes: name, condition, temperature
        times (frames,) s, used (frames,); measured/OUTPUT (frames,), predicted/OUTPUT (frames,) of the best law
        loading (breakpoints, 2) s and MPa
      confirmation               attributes: holds, verdict, using; chi_square (tests, outputs), difference likewise
"""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import FitError
from creepkit.files.hdf5_files import write_hdf5
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import ANY_NUMBER, RecordCodec, RecordError, ValueCodec
from creepkit.files.writing import write_text
from creepkit.inverse.confirmation import ConfirmedOutput
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import CODEC as FIT_CODEC
from creepkit.inverse.identification_document import identification_from_json, identification_to_json
from creepkit.records import History
from creepkit.screening.results import AlloyResult, PredictedOutputs, WeightedLaw, mean_relative_squared_error

if TYPE_CHECKING:
    from creepkit.screening.results import ScreeningResult


ALLOY_RESULT = DocumentFormat(
    "creepkit-alloy-result",
    2,
    FileKind("the result of an alloy", FitError, "remove it, and it is worked out again"),
    remedy="remove it, and it is worked out again",
)


CODEC = RecordCodec(
    ranges={
        AlloyResult: {"predicted": ANY_NUMBER},
        ConfirmedOutput: {"rms_difference": ANY_NUMBER},
        **FIT_CODEC.ranges,
    },
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


HDF5_FORMAT, HDF5_LAYOUT, HDF5_UNITS = "creepkit-plate", 1, "MPa, mm, s, K"


def write_plate(plate: ScreeningResult, path: Path) -> Path:
    """Write the file; it is whole or absent."""
    with write_hdf5(path, FitError) as file:
        file.attrs.update({"format": HDF5_FORMAT, "layout": HDF5_LAYOUT, "units": HDF5_UNITS})
        for k, result in enumerate(plate.results):
            group = file.create_group(f"alloys/{k:04d}")
            group.attrs.update({"alloy": result.alloy, "class": plate.class_of(result.alloy)})
            _write_result(group, result)
            for n, test in enumerate(plate.histories[result.alloy]):
                _write_test(group.create_group(f"tests/{n}"), test, result.predicted.get(test.name, {}))
    return path


def _write_result(group: Any, result: AlloyResult) -> None:
    group.attrs.update(
        law=result.best.law.name if result.identified else "",
        verdict=result.verdict,
        reason=result.failure,
        decisive=result.decisive,
        notes="\n".join(result.notes),
    )
    for k, weighted in enumerate(result.laws):
        _write_law(group.create_group(f"laws/{k}"), weighted)
    if result.identified:
        for name in COMPARED:
            group[name] = np.array([float(v) for v in getattr(result.best, name)(COMPARISON_STRESS, warn=False)])
    if result.confirmation is not None:
        made = result.confirmation
        names = list(dict.fromkeys(o.output for t in made.tests for o in t.outputs))
        values = {name: np.full((len(made.tests), len(names)), np.nan) for name in ("chi_square", "difference")}
        for row, test in enumerate(made.tests):
            for one in test.outputs:
                column = names.index(one.output)
                values["chi_square"][row, column] = one.simulation_errors.chi_square
                values["difference"][row, column] = one.rms_difference
        own = group.create_group("confirmation")
        own.attrs.update(holds=made.confirmed, verdict=made.verdict, using=made.predictor_name, outputs=names)
        own.update(values)


def _write_law(group: Any, weighted: WeightedLaw) -> None:
    fit = weighted.fit
    group.attrs.update(
        law=fit.law.name, weight=weighted.weight, excess=weighted.bic_difference, converged=fit.converged
    )
    group.attrs["names"] = [e.name for e in fit.estimates]
    for name in ("value", "low", "high"):
        group["values" if name == "value" else name] = np.array([getattr(e, name) for e in fit.estimates])
    group["u"], group["covariance"] = fit.u, fit.covariance


def _write_test(group: Any, test: History, predicted: PredictedOutputs) -> None:
    temperature = float(np.mean(test.temperature_program().values))
    group.attrs.update({"name": test.name, "condition": test.condition, "temperature": temperature})
    program = test.loading.program()
    group["times"], group["used"] = test.times, test.used
    group["loading"] = np.stack([program.times, program.values], axis=1)
    for source, rows in (("measured", test.outputs), ("predicted", predicted)):
        for name, values in rows.items():
            group[f"{source}/{name}"] = values


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
