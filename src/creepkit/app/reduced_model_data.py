"""The reduced-order model of a dimple packed for a page: arrays as base64 of little-endian numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from creepkit.app.packed_arrays import packed
from creepkit.errors import SolveError
from creepkit.fem.mesh import SIDES, outline
from creepkit.fem.reduced_order_model import ReducedOrderModel, mode_gradients
from creepkit.specimens.bulge.finite_elements import solver_settings
from creepkit.specimens.bulge.gaussian_fit import GaussianFit
from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel
from creepkit.specimens.bulge.setup import BulgeSetup, model_of_specimen


def rom_data(predictor: BulgeReducedOrderModel, lengths: Mapping[str, float] | None = None) -> dict[str, Any]:
    """Return the model of the specimen's dimple as JSON values; modes and gradients in single precision.

    lengths : {name: mm} of another dimple, such as {"apex_thickness": 0.53}, as a history may state them.
    Trains the model where that has not been done. SolveError where rings are observed, which have no fit.
    """
    setup = predictor.own_setup()
    if lengths:
        geometry = setup.geometry.replace(**lengths)
        setup = replace(setup, model=model_of_specimen(predictor.specimen, geometry), geometry=geometry)
    model = predictor.reduced_model_of(setup)
    settings = solver_settings(predictor.specimen)
    return {
        "title": predictor.title,
        "modes": len(model.basis.modes),
        "nodeCount": len(model.model.nodes),
        "points": int(model.basis.points.size),
        "window": setup.observation.window,
        "settings": {
            "tolerance": settings.tolerance,
            "newton": min(settings.newton, 1e-3 * settings.tolerance),
            "first": settings.first,
            "growth": settings.growth,
            "deflectionLimit": settings.deflection_limit,
            "strainLimit": settings.strain_limit,
            "maxSteps": settings.max_steps,
            "least": settings.least,
        },
        "lengths": {name: float(getattr(setup.geometry, name)) for name in setup.geometry.lengths},
        "arrays": _arrays(model) | _observation_arrays(setup),
    }


def _arrays(model: ReducedOrderModel) -> dict[str, dict[str, str]]:
    mesh, basis = model.model, model.basis
    sides = outline(mesh.elements)
    edges = mesh.elements[sides[:, 0, None], SIDES[sides[:, 1]]]
    return {
        "modes": packed(basis.modes, "float32"),
        "gradients": packed(mode_gradients(mesh, basis.modes, basis.points), "float32"),
        "weights": packed(mesh.weights.ravel()[basis.points] * basis.factors, "float64"),
        "places": packed(mesh.nodes, "float64"),
        "top": packed(mesh.top, "int32"),
        "pressed": packed(mesh.pressed, "int32"),
        "elements": packed(mesh.elements, "int32"),
        "edges": packed(edges, "int32"),
    }


def _observation_arrays(setup: BulgeSetup) -> dict[str, dict[str, str]]:
    fit = setup.observation.sampling(setup.radii).fit
    if not isinstance(fit, GaussianFit):
        raise SolveError("a page shows amplitude, width and shape of a dimple; observe a profile or a field, not rings")
    grid = fit.grid
    return {
        "sampling": packed(fit.nodes, "float64"),
        **{
            name: packed(getattr(grid, name), "float64")
            for name in ("log_radius", "radial", "log_cosine", "log_sine", "angular")
        },
    }
