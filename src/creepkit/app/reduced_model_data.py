"""The reduced-order model of a dimple packed for a page: arrays as base64 of little-endian numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from creepkit.app.packed_arrays import PackedType, packed
from creepkit.errors import SolveError
from creepkit.specimens.bulge.finite_elements import solver_settings
from creepkit.specimens.bulge.gaussian_fit import GaussianFit
from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel
from creepkit.specimens.bulge.setup import model_of_specimen


def rom_data(predictor: BulgeReducedOrderModel, lengths: Mapping[str, float] | None = None) -> dict[str, Any]:
    """Return the model of the specimen's dimple as JSON values, its arrays as the core reads them.

    lengths : {name: mm} of another dimple, such as {"apex_thickness": 0.53}, as a history may state them.
    Trains the model where that has not been done. SolveError where rings are observed, which have no fit.
    """
    setup = predictor.own_setup()
    if lengths:
        geometry = setup.geometry.replace(**lengths)
        setup = replace(setup, model=model_of_specimen(predictor.specimen, geometry), geometry=geometry)
    fit = setup.observation.sampling(setup.radii).fit
    if not isinstance(fit, GaussianFit):
        raise SolveError("a page shows amplitude, width and shape of a dimple; observe a profile or a field, not rings")
    model = predictor.reduced_model_of(setup)
    mesh, basis, compiled = model.model, model.basis, model.compiled
    settings = solver_settings(predictor.specimen)
    settings = settings._replace(newton=min(settings.newton, 1e-3 * settings.tolerance))
    arrays: dict[str, tuple[Any, PackedType]] = {
        "modes": (basis.modes, "float32"),  # to draw the body by
        "places": (mesh.nodes, "float64"),
        "top": (mesh.top, "int32"),
        "elements": (mesh.elements, "int32"),
        **{name: (compiled.arrays[name], kind) for name, kind in SOLVED.items()},
        "sampling": (fit.nodes, "float64"),
        "grid": (fit.grid.numbers, "float64"),
    }
    return {
        "title": predictor.title,
        "modes": len(basis.modes),
        "limited": compiled.structure.limited,
        "window": setup.observation.window,
        "grid": [fit.grid.log_radius.size, fit.grid.angular.size],
        "settings": settings._asdict(),
        "lengths": {name: float(getattr(setup.geometry, name)) for name in setup.geometry.lengths},
        "arrays": {name: packed(np.asarray(values), kind) for name, (values, kind) in arrays.items()},
    }


SOLVED: dict[str, PackedType] = {
    "gradients": "float32", "weights": "float64", "sides": "float64", "side_modes": "float32", "surface": "float32",
    "measures": "float32",
}  # fmt: skip
"""Arrays of a CompiledReducedModel that a page solves with; single precision moves its outputs by some 1e-8."""
