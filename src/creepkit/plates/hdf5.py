"""A plate as one HDF5 file, which any HDF5 reader opens without creepkit.

Attributes of the file: `format` "creepkit-plate", `layout` 1, `units` "MPa, mm, s, K". A group `alloys` has a group for
each alloy, numbered from 0000 in the order of the plate:

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

from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from creepkit.dataset.store import replace_on_success
from creepkit.plates.answer import AlloyResult, PredictedOutputs, WeightedLaw
from creepkit.plates.table import COMPARISON_STRESS
from creepkit.records import History

if TYPE_CHECKING:
    from creepkit.plates.plate import Plate

HDF5_FORMAT, HDF5_LAYOUT, HDF5_UNITS = "creepkit-plate", 1, "MPa, mm, s, K"


def write_hdf5(plate: Plate, path: Path) -> Path:
    """Write the file; it is whole or absent."""
    with replace_on_success(path) as temporary, h5py.File(temporary, "w") as file:
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
        {
            "law": result.best.law.name if result.identified else "",
            "verdict": result.verdict,
            "reason": result.failure,
            "decisive": result.decisive,
            "notes": "\n".join(result.notes),
        }
    )
    for k, weighted_law in enumerate(result.laws):
        _write_law(group.create_group(f"laws/{k}"), weighted_law)
    if result.identified:
        group["rate"] = np.array([float(v) for v in result.best.rate(COMPARISON_STRESS)])
        group["local_exponent"] = np.array([float(v) for v in result.best.local_exponent(COMPARISON_STRESS)])
    if result.confirmation is not None:
        confirmation = result.confirmation
        confirmation_group = group.create_group("confirmation")
        confirmation_group.attrs.update({"holds": confirmation.confirmed, "verdict": confirmation.verdict, "using": confirmation.predictor_name})
        names = list(dict.fromkeys(o.output for t in confirmation.tests for o in t.outputs))
        confirmation_group.attrs["outputs"] = names
        confirmation_group["chi_square"] = _comparison_matrix(result, names, "chi_square")
        confirmation_group["difference"] = _comparison_matrix(result, names, "difference")


def _comparison_matrix(result: AlloyResult, names: list[str], quantity: str) -> Any:
    """(tests, outputs) of a confirmation; NaN for an output that a test has not."""
    assert result.confirmation is not None
    matrix = np.full((len(result.confirmation.tests), len(names)), np.nan)
    for row, test in zip(matrix, result.confirmation.tests, strict=True):
        for comparison in test.outputs:
            value = comparison.simulation_errors.chi_square if quantity == "chi_square" else comparison.rms_difference
            row[names.index(comparison.output)] = value
    return matrix


def _write_law(group: Any, weighted_law: WeightedLaw) -> None:
    fit = weighted_law.fit
    group.attrs.update(
        {"law": fit.law.name, "weight": weighted_law.weight, "excess": weighted_law.bic_difference, "converged": fit.converged}
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
