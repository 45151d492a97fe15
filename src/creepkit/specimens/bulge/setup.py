"""A bulge test set up from its history: finite element model, load history, geometry and observation operator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.simulation import LoadHistory
from creepkit.records import History, Program, check_geometry, with_program_nuisances
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.observation import Observation
from creepkit.specimens.finite_element_tests import modulus_program

if TYPE_CHECKING:
    from creepkit.specimens.bulge.settings import BulgeSettings


@dataclass(frozen=True, eq=False)
class BulgeSetup:
    """One test set up: its finite element model and load history, its geometry, its observation operator.

    refinement : of the structured mesh, None for a mesh from files.
    """

    model: FiniteElementModel
    load_history: LoadHistory
    geometry: DimpleGeometry
    observation: Observation
    refinement: float | None

    @property
    def radii(self) -> Floats:
        """(top,) mm, radii of the observed nodes at rest."""
        return np.asarray(self.model.nodes[self.model.top, 0])


def set_up_test(specimen: BulgeSettings, history: History, nuisances: Mapping[str, float]) -> BulgeSetup:
    """Prepare one test; nuisances : {key: value} of its explicit nuisances."""
    history, where = with_program_nuisances(history, nuisances), history.origin
    if history.loading.quantity != "pressure":
        raise SolveError(
            f"{where}: a bulge specimen is loaded by pressure, found {history.loading.quantity}; use PressureJump"
        )
    check_geometry(specimen, history.geometry, where)
    if history.times[-1] <= 0.0:
        raise SolveError(f"{where}: the last time is 0 s, where the load only begins; ask for a time after it")
    if history.elastic is None:
        raise SolveError(f"{where}: a bulge test needs elastic data; set elastic=Elastic(E=...), E in MPa")
    pressure = history.loading.program()
    if pressure.values.min() < 0.0:
        raise SolveError(f"{where}: the pressure falls to {pressure.values.min():g} MPa; it must not be negative")
    if not pressure.values.max() > 0.0:
        raise SolveError(f"{where}: the pressure is zero throughout; a bulge test needs one above zero")
    geometry = _geometry(specimen, history, nuisances)
    operator = specimen.observation_of(history)
    window = nuisances.get("window", history.geometry.get("window"))
    if window is not None:
        operator = operator.within(window)
    temperature = history.temperature_program()
    temperature = Program(temperature.times, temperature.values + nuisances.get("temperature", 0.0))
    modulus = modulus_program(history.elastic, temperature, 1.0 + nuisances.get("modulus", 0.0), where)
    model = model_of_specimen(specimen, geometry)
    poisson = float(history.elastic.at(float(temperature.values[0])).nu)
    load_history = LoadHistory(pressure, temperature, modulus, float(history.times[-1]), poisson)
    return BulgeSetup(model, load_history, geometry, operator, specimen.refinement if specimen.mesh is None else None)


@lru_cache(maxsize=256)
def model_of_geometry(geometry: DimpleGeometry, refinement: float) -> FiniteElementModel:
    """The finite element model of a dimple; kept, for a fit needs it a thousand times."""
    return finite_element_model(geometry.mesh(refinement))


def model_of_specimen(specimen: BulgeSettings, geometry: DimpleGeometry | None = None) -> FiniteElementModel:
    """The finite element model of a specimen's mesh, or of its geometry or another one in its place."""
    if specimen.mesh is not None:
        return _model_of_mesh(specimen)
    return model_of_geometry(geometry or specimen.geometry, specimen.refinement)


@lru_cache(maxsize=16)
def _model_of_mesh(specimen: BulgeSettings) -> FiniteElementModel:
    assert specimen.mesh is not None
    if not specimen.mesh.top.size:
        raise SolveError("the mesh of a bulge specimen names no observed surface; give it the nodes of its top")
    model = finite_element_model(specimen.mesh)
    if not model.pressed.size:
        raise SolveError("the mesh of a bulge specimen has no pressed side; name those that the gas presses on")
    if not model.size:
        raise SolveError("the mesh of a bulge specimen is held at every node; hold it at its clamped rim alone")
    return model


def _geometry(specimen: BulgeSettings, history: History, nuisances: Mapping[str, float]) -> DimpleGeometry:
    """The specimen's geometry, with what was measured of this test and then what is assumed of it."""
    changes = {name: value for name, value in history.geometry.items() if name in DimpleGeometry.lengths}
    if "thickness" in nuisances and "apex_thickness" in nuisances:
        raise SolveError("'thickness' and 'apex_thickness' are the same nuisance parameter; keep one of them")
    changes |= {name: float(value) for name, value in nuisances.items() if name in DimpleGeometry.lengths}
    if "thickness" in nuisances:
        changes["apex_thickness"] = float(nuisances["thickness"])
    if not changes:
        return specimen.geometry
    if specimen.mesh is not None:
        raise SolveError(
            f"history '{history.name}' has a geometry of its own ({', '.join(changes)}), which a specimen with a mesh "
            "from files cannot follow; use one without mesh="
        )
    return specimen.geometry.replace(**changes)
