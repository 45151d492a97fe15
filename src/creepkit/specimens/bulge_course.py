"""From a history to what the finite elements need: body and course, with the unknowns of that test put in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.body import Body, body_of
from creepkit.fem.simulation import Course
from creepkit.records import History, Program
from creepkit.specimens.dimple import DimpleGeometry
from creepkit.specimens.observation import Observation

if TYPE_CHECKING:
    from creepkit.language import Elastic
    from creepkit.specimens.bulge import Bulge

MODULUS_STEP = 1.0
"""K, of the central difference of the modulus to the temperature."""


@dataclass(frozen=True, eq=False)
class Setup:
    """One test made ready: its body and course, its geometry, its observation operator.

    refinement : of the structured mesh, None for a mesh from files.
    """

    body: Body
    course: Course
    geometry: DimpleGeometry
    observation: Observation
    refinement: float | None

    @property
    def radii(self) -> Floats:
        """(top,) mm, radii of the observed nodes at rest."""
        return np.asarray(self.body.nodes[self.body.top, 0])


def setup(specimen: Bulge, history: History, effects: Mapping[str, float]) -> Setup:
    """Prepare one test; effects : {kind: value} of its explicit nuisances."""
    where = history.source or f"history '{history.name}'"
    if history.loading.quantity != "pressure":
        raise SolveError(
            f"{where}: a bulge specimen is loaded by pressure, found {history.loading.quantity}; use PressureJump"
        )
    if history.times[-1] <= 0.0:
        raise SolveError(f"{where}: the last time is 0 s, where the load only begins; ask for a time after it")
    if history.elastic is None:
        raise SolveError(f"{where}: a bulge test needs elastic data; set elastic=Elastic(E=...), E in MPa")
    pressure = history.loading.program()
    if pressure.values.min() < 0.0:
        raise SolveError(f"{where}: the pressure falls to {pressure.values.min():g} MPa; it must not be negative")
    geometry = _geometry(specimen, history, effects)
    operator = Observation.from_text(history.operator) if history.operator else specimen.observation
    if "window" in effects:
        operator = operator.replace(window=float(effects["window"]))
    warmth = history.temperature_program()
    warmth = Program(warmth.times, warmth.values + effects.get("temperature", 0.0))
    modulus = modulus_program(history.elastic, warmth, 1.0 + effects.get("modulus", 0.0), where)
    body = prepared(geometry, specimen.refinement) if specimen.mesh is None else _prepared_mesh(specimen)
    poisson = float(history.elastic.at(float(warmth.values[0])).nu)
    course = Course(pressure, warmth, modulus, float(history.times[-1]), poisson)
    return Setup(body, course, geometry, operator, specimen.refinement if specimen.mesh is None else None)


def modulus_program(elastic: Elastic, warmth: Program, factor: float, where: str) -> Program:
    """Young's modulus over time, MPa, a straight line where the temperature is one."""
    known = {float(T): float(elastic.at(float(T)).E) for T in np.unique(warmth.values)}
    values = np.array([factor * known[float(T)] for T in warmth.values])
    if not (values > 0).all():
        raise SolveError(f"{where}: the modulus is {values.min():g} MPa; it must be above zero")
    return Program(warmth.times, values)


@lru_cache(maxsize=256)
def prepared(geometry: DimpleGeometry, refinement: float) -> Body:
    """The body of a dimple; kept, for a fit asks for it a thousand times."""
    return body_of(geometry.mesh(refinement))


@lru_cache(maxsize=16)
def _prepared_mesh(specimen: Bulge) -> Body:
    assert specimen.mesh is not None
    if not specimen.mesh.top.size:
        raise SolveError("the mesh of a bulge specimen names no observed surface; give it the nodes of its top")
    return body_of(specimen.mesh)


def _geometry(specimen: Bulge, history: History, effects: Mapping[str, float]) -> DimpleGeometry:
    """The specimen's geometry, with what was measured of this test and then what is assumed of it."""
    changes = {name: value for name, value in history.geometry.items() if name in DimpleGeometry.lengths}
    if "thickness" in effects:
        changes["apex_thickness"] = float(effects["thickness"])
    if not changes:
        return specimen.geometry
    if specimen.mesh is not None:
        raise SolveError(
            f"history '{history.name}' has a geometry of its own ({', '.join(changes)}), which a specimen with a mesh "
            "from files cannot follow; use one without mesh="
        )
    return specimen.geometry.replace(**changes)
