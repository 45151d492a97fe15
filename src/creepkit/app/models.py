"""What pages calculate with, packed as JSON values: reduced-order models of dimples.

Arrays are base64 of little-endian numbers, which `creepkit.decode` of the runtime reads.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from creepkit.app.contents import PageContents
from creepkit.errors import CreepkitError, SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.mesh import outline
from creepkit.records import History, Specimen
from creepkit.specimens.bulge.gaussian_fit import GaussianFit
from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel
from creepkit.specimens.bulge.specimen import Bulge

PackedType = Literal["float64", "float32", "int32"]


MOST_MODELS = 4
"""Of one page, some 170 kB each; tests of further pieces are shown without a curve."""


SOLVED: dict[str, PackedType] = {
    "gradients": "float32", "weights": "float64", "factors": "float32", "sides": "float64", "side_modes": "float32",
    "surface": "float32", "measures": "float32",
}  # fmt: skip
"""Arrays of a CompiledReducedModel that a page solves with; single precision moves its outputs by some 1e-8."""


def page_models(contents: PageContents) -> dict[str, str]:
    """{name: data as JSON} of the models of a page."""
    models: dict[str, str] = {}
    for specimen in contents.specimens:
        models |= model_of(specimen)
    for history in contents.histories:
        found = model_of(contents.specimen(history.specimen), history)
        if len(models) < MOST_MODELS:
            models |= found
    return models


def model_of(specimen: Specimen, history: History | None = None) -> dict[str, str]:
    """{name: data} of the model of a specimen, or of the piece and the observation of a test; {} for no model."""
    if not isinstance(specimen, Bulge):
        return {}
    if history is not None:
        lengths = {name: history.geometry[name] for name in specimen.geometry.lengths if name in history.geometry}
        specimen = specimen.replace(**lengths, observation=specimen.observation_of(history))
    try:
        return _named_model(specimen)
    except CreepkitError:  # of rings, say, which have no fit
        return {}


@lru_cache(maxsize=16)
def _named_model(specimen: Bulge) -> dict[str, str]:
    """The JSON by a name that follows from it, so that several pages in one document may share it."""
    text = json.dumps(rom_data(BulgeReducedOrderModel(specimen)), allow_nan=False, separators=(",", ":"))
    return {f"dimple-{hashlib.sha256(text.encode()).hexdigest()[:12]}": text}


def rom_data(predictor: BulgeReducedOrderModel, lengths: Mapping[str, float] | None = None) -> dict[str, Any]:
    """Return the reduced-order model of the specimen's dimple as JSON values, its arrays as the core reads them.

    lengths : {name: mm} of another dimple, such as {"apex_thickness": 0.53}, as a history may state them.
    Trains the model where that has not been done. SolveError where rings are observed, which have no fit.
    """
    piece = predictor.specimen.replace(**(lengths or {}))
    fit = piece.observation.sampling(piece.top_radii).fit
    if not isinstance(fit, GaussianFit):
        raise SolveError("a page shows amplitude, width and shape of a dimple; observe a profile or a field, not rings")
    model = predictor.reduced_model_of(piece)
    mesh, basis, compiled = model.model, model.basis, model.compiled
    return {
        "title": predictor.title,
        "modes": len(basis.modes),
        "limited": compiled.structure.limited,
        "window": piece.observation.window,
        "grid": [fit.grid.log_radius.size, fit.grid.angular.size],
        "settings": predictor.settings._asdict(),
        "lengths": {name: float(getattr(piece.geometry, name)) for name in piece.geometry.lengths},
        "arrays": {
            "modes": packed(basis.modes, "float32"),  # to draw the body by
            "places": packed(mesh.nodes, "float64"),
            "top": packed(mesh.top, "int32"),
            "contour": packed(_contour(mesh), "int32"),
            **{name: packed(compiled.arrays[name], kind) for name, kind in SOLVED.items()},
            "sampling": packed(fit.nodes, "float64"),
            "grid": packed(fit.grid.numbers, "float64"),
        },
    }


def _contour(mesh: FiniteElementModel) -> list[int]:
    """Numbers of the nodes along the outline of a body, from where it leaves its axis to where it meets it again."""
    edges = outline(mesh.elements).tolist()
    after = {first: (middle, last) for first, middle, last in edges if mesh.nodes[middle, 0] > 0.0}
    (start,) = {*after} - {last for _, last in after.values()}
    found = [start]
    while found[-1] in after:
        found += after[found[-1]]
    return found


def packed(values: Any, kind: PackedType) -> dict[str, str]:
    """An array as {"type", "data"}; values : (...,), the last axis fastest, in any unit."""
    numbers = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return {"type": kind, "data": base64.b64encode(numbers.tobytes()).decode("ascii")}
