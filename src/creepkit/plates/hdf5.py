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

from creepkit.dataset.store import replacing
from creepkit.plates.answer import AlloyAnswer, Outputs, Weighed
from creepkit.plates.table import STRESS
from creepkit.records import History

if TYPE_CHECKING:
    from creepkit.plates.plate import Plate

FORMAT, LAYOUT, UNITS = "creepkit-plate", 1, "MPa, mm, s, K"


def write(plate: Plate, path: Path) -> Path:
    """Write the file; it is whole or absent."""
    with replacing(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update({"format": FORMAT, "layout": LAYOUT, "units": UNITS})
        for k, answer in enumerate(plate.answers):
            group = file.create_group(f"alloys/{k:04d}")
            group.attrs.update({"alloy": answer.alloy, "class": plate.class_of(answer.alloy)})
            _write_answer(group, answer)
            for n, test in enumerate(plate.histories[answer.alloy]):
                _write_test(group.create_group(f"tests/{n}"), test, answer.predicted.get(test.name, {}))
    return path


def _write_answer(group: Any, answer: AlloyAnswer) -> None:
    group.attrs.update(
        {
            "law": answer.best.law.name if answer.identified else "",
            "verdict": answer.verdict,
            "reason": answer.reason,
            "decisive": answer.decisive,
            "notes": "\n".join(answer.notes),
        }
    )
    for k, weighed in enumerate(answer.laws):
        _write_law(group.create_group(f"laws/{k}"), weighed)
    if answer.identified:
        group["rate"] = np.array([float(v) for v in answer.best.rate(STRESS)])
        group["local_exponent"] = np.array([float(v) for v in answer.best.local_exponent(STRESS)])
    if answer.confirmation is not None:
        told = answer.confirmation
        mine = group.create_group("confirmation")
        mine.attrs.update({"holds": told.holds, "verdict": told.verdict, "using": told.using})
        names = list(dict.fromkeys(o.output for t in told.tests for o in t.outputs))
        mine.attrs["outputs"] = names
        mine["chi_square"] = _grid(answer, names, "chi_square")
        mine["difference"] = _grid(answer, names, "difference")


def _grid(answer: AlloyAnswer, names: list[str], what: str) -> Any:
    """(tests, outputs) of a confirmation; NaN for an output that a test has not."""
    assert answer.confirmation is not None
    grid = np.full((len(answer.confirmation.tests), len(names)), np.nan)
    for row, test in zip(grid, answer.confirmation.tests, strict=True):
        for one in test.outputs:
            value = one.simulated.chi_square if what == "chi_square" else one.difference
            row[names.index(one.output)] = value
    return grid


def _write_law(group: Any, weighed: Weighed) -> None:
    fit = weighed.fit
    group.attrs.update(
        {"law": fit.law.name, "weight": weighed.weight, "excess": weighed.excess, "converged": fit.converged}
    )
    group.attrs["names"] = [e.name for e in fit.estimates]
    for name in ("value", "low", "high"):
        group["values" if name == "value" else name] = np.array([getattr(e, name) for e in fit.estimates])
    group["u"], group["covariance"] = fit.u, fit.covariance


def _write_test(group: Any, test: History, predicted: Outputs) -> None:
    temperature = float(np.mean(test.temperature_program().values))
    group.attrs.update({"name": test.name, "condition": test.condition, "temperature": temperature})
    program = test.loading.program()
    group["times"], group["used"] = test.times, test.used
    group["loading"] = np.stack([program.times, program.values], axis=1)
    for kind, rows in (("measured", test.outputs), ("predicted", predicted)):
        for name, values in rows.items():
            group[f"{kind}/{name}"] = values
