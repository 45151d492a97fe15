"""BulgeTest: one bulge test, whose dimple is meshed by its geometry and observed by an operator."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.mesh import GeometryDerivative, geometry_derivative
from creepkit.fem.simulation import Simulation
from creepkit.records import History, Output, dimension_named
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.observation import Observation
from creepkit.specimens.bulge.settings import BulgeSettings
from creepkit.specimens.finite_element_tests import FiniteElementTest


@dataclass(frozen=True, eq=False)
class BulgeTest(FiniteElementTest):
    """One bulge test; its piece has the geometry and the operator of this test."""

    piece: BulgeSettings

    @classmethod
    def model_of(cls, piece: BulgeSettings, load: str = "pressure") -> FiniteElementModel:
        """The finite elements of a specimen's mesh, or of its geometry."""
        if piece.mesh is not None:
            return _model_of_mesh(piece)
        return model_of_geometry(piece.geometry, piece.refinement)

    @property
    def observation(self) -> Observation:
        """The operator."""
        return self.piece.observation

    @property
    def outputs(self) -> tuple[Output, ...]:
        """What the operator observes."""
        return self.observation.outputs

    @property
    def radii(self) -> Floats:
        """(top,) mm, radii of the observed nodes at rest."""
        return radii_of_top(self.model)

    def profiles(self, simulation: Simulation) -> Floats:
        """(steps, top) mm, how far the top has risen in each accepted step."""
        return np.asarray(simulation.displacements[:, self.model.top, 1])

    def observed(self, simulation: Simulation) -> Floats:
        """Outputs in each accepted step, (steps, outputs)."""
        return self.observation.observe(self.radii, self.profiles(simulation))

    def observed_at_times(self, simulation: Simulation) -> Floats:
        """Outputs at the times of the history, (times, outputs), in one call of the core."""
        profiles = self.profiles(simulation)
        return self.observation.observe_at_times(self.radii, profiles, simulation.timeline, self.history.times)

    def differentiated(self, simulation: Simulation) -> tuple[Floats, Floats]:
        """As `observed`, and exact derivatives (steps, outputs, columns)."""
        assert simulation.sensitivities is not None
        profiles = self.profiles(simulation)
        outputs, derivatives = self.observation.observe_with_derivatives(self.radii, profiles)
        columns = self.columns(simulation, derivatives, simulation.sensitivities)
        if self.observation.form != "rings":  # width and shape at rest are those of the first step
            columns[0, 1:] = columns[1, 1:] if len(columns) > 1 else 0.0
        return outputs, columns

    def length_derivative(self, key: str, simulation: Simulation) -> Floats:
        """Derivative (steps, outputs) of the outputs to a length, or to the window, at the same displacements."""
        profiles = self.profiles(simulation)
        if key in self.views:
            return self.observation.window_derivatives(self.radii, profiles)
        _, velocity, _ = self.movement(key)
        return self.observation.node_derivatives(self.radii, profiles, velocity[self.model.top, 0])

    def movement(self, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
        """How points and nodes (nodes, 2), mm, move with a length; there are no dead forces."""
        known = dimension_named(self.piece, key)
        assert known is not None
        return _movement(self.piece.geometry, self.piece.refinement, known.name)

    def stated_history(self) -> History:
        """The history with the lengths of the dimple and the operator."""
        return super().stated_history().replace(operator=str(self.observation))


def radii_of_top(model: FiniteElementModel) -> Floats:
    """(top,) mm, radii of the observed nodes at rest."""
    return np.asarray(model.nodes[model.top, 0])


@lru_cache(maxsize=256)
def model_of_geometry(geometry: DimpleGeometry, refinement: float) -> FiniteElementModel:
    """The finite element model of a dimple; kept, for a fit needs it a thousand times."""
    return finite_element_model(geometry.mesh(refinement))


@lru_cache(maxsize=16)
def _model_of_mesh(piece: BulgeSettings) -> FiniteElementModel:
    assert piece.mesh is not None
    if not piece.mesh.top.size:
        raise SolveError("the mesh of a bulge specimen names no observed surface; give it the nodes of its top")
    model = finite_element_model(piece.mesh)
    if not model.pressed.size:
        raise SolveError("the mesh of a bulge specimen has no pressed side; name those that the gas presses on")
    if not model.size:
        raise SolveError("the mesh of a bulge specimen is held at every node; hold it at its clamped rim alone")
    return model


@lru_cache(maxsize=256)
def _movement(geometry: DimpleGeometry, refinement: float, name: str) -> tuple[GeometryDerivative, Floats, Floats]:
    velocity = geometry.mesh_velocity(name, refinement)
    return geometry_derivative(geometry.mesh(refinement), velocity), velocity, np.zeros_like(velocity)
