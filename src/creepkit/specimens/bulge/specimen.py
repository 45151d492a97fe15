"""The bulge test: gas pressure on the cavity of a dimple, observed by cameras that watch its flat top.

The dimple is simulated by finite elements (see `fem`). Outputs are amplitude, width and shape of the generalised
Gaussian fitted to the displacement of the top, or this displacement on rings (see `observation`). Time starts with the
first pressure ramp; creep acts during ramps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SAID, SolveError, nearest, restated
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.mesh import GeometryDerivative, Mesh
from creepkit.hookspecs import hookimpl
from creepkit.limits import Limits, numbers
from creepkit.records import (
    Dimension,
    History,
    Load,
    Loading,
    Output,
    Predictor,
    PressureJump,
    Specimen,
    SurfaceObservation,
    SurfacePoints,
    SurfaceRegion,
    dimension_named,
)
from creepkit.specimens.bulge.camera_points import observe_surface, surface_center
from creepkit.specimens.bulge.geometry import LENGTH_RANGE, REFINEMENT_RANGE, DimpleGeometry, model_of_geometry
from creepkit.specimens.bulge.observation import Observation
from creepkit.specimens.bulge.outputs import OBSERVED, RING_OUTPUTS
from creepkit.specimens.finite_element_specimen import FiniteElementSpecimen
from creepkit.specimens.load_scaling import LoadScaling

if TYPE_CHECKING:
    from creepkit.fem.simulation import Simulation
    from creepkit.specimens.bulge.run import BulgeRun


_LENGTHS: dict[str, dict[str, Any]] = {"apex_thickness": {"tolerance": 0.02, "alias": "thickness"}}
"""What is known of a length beside its value: a thickness is measured to some 0.01 mm."""


_CLAMPED = {"bottom": "at the underside of the plate outside the cavity", "rim": "at the outer rim"}
"""Where a clamped edge is."""


@dataclass(frozen=True)
class Bulge(FiniteElementSpecimen):
    """A dimple under gas pressure, simulated by finite elements, its observation and the limits of its simulation.

    geometry : the dimple; its fields may be given to `replace` directly. A history's own geometry (such as its
        measured apex_thickness, mm) takes precedence in a prediction.
    observation : the observation operator of histories that name none.
    mesh : another mesh (read from files, say) in place of the geometry's own; refinement : of the latter.
    tolerance : estimated error of the displacements in a step, over their largest plus 0.01 mm; with 0.01 the
        steps of a 12 h history add less than the mesh, some 0.06 % of its largest displacement in the median and up to
        1.6 % for sinh laws that are nearly plastic; raise `refinement` for those.
    deflection_limit : mm, displacement of the top at which the dimple has ruptured. strain_limit : creep strain at
        which a point has. max_steps : cap on the steps of one simulation, so on its cost.
    threads : simulations that run at the same time; None for one on each core.
    """

    geometry: DimpleGeometry = field(default_factory=DimpleGeometry)
    observation: Observation = field(default_factory=Observation)
    mesh: Mesh | None = None
    tolerance: float = 1e-2
    resolution: float = 0.01
    deflection_limit: float = 3.0

    name: ClassVar[str] = "bulge"
    title: ClassVar[str] = "Bulge test of a dimple under gas pressure, by finite elements"
    optional_outputs: ClassVar[tuple[Output, ...]] = (*OBSERVED, *RING_OUTPUTS)
    """Those that a test has whose operator says so."""

    ranges: ClassVar[Mapping[str, Limits]] = MappingProxyType(
        {**FiniteElementSpecimen.ranges, "refinement": REFINEMENT_RANGE, "deflection_limit": numbers(1e-3, 1e3)}
    )
    loads: ClassVar[tuple[Load, ...]] = (Load("pressure", "pressure", "gas pressure", ramp=5.0),)
    conditions: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType(
        {"pressure": (3.0, 25.0), "modulus": (50e3, 300e3)}
    )
    """The paper's ranges, MPa."""
    dataset_names: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"pressure_1": "P1", "pressure_2": "P2", "jump_time": "Tj"}
    )
    """What data sets call the conditions of its tests, after the paper."""
    surrogate_name: ClassVar[str] = "dimple"
    """The name of its reduced-order model among the surrogates."""

    is_watched: ClassVar[bool] = True
    draws_section: ClassVar[bool] = True
    frame_interval: ClassVar[float] = 150.0
    """s between frames of a planned test, as the paper's cameras took them."""

    @property
    def outputs(self) -> tuple[Output, ...]:  # type: ignore[override]
        """What the operator of the specimen observes."""
        return self.observation.outputs

    def replace(self, **changes: Any) -> Self:
        """The same specimen with some fields, or lengths of its geometry, changed: replace(apex_thickness=0.48).

        An observation may be given as its text, as in replace(observation="rings 0, 2, 4 mm").
        """
        if isinstance(changes.get("observation"), str):
            changes["observation"] = Observation.from_text(changes["observation"])
        own_fields = {f.name for f in fields(self)}
        known = own_fields | {"window", *(f.name for f in fields(self.geometry))}
        for name in changes.keys() - known:
            raise SolveError(f"a bulge specimen has no field '{name}'; {nearest(name, known)}")
        if "window" in changes:
            changes["observation"] = changes.get("observation", self.observation).within(changes.pop("window"))
        geometry_changes = {name: changes.pop(name) for name in list(changes) if name not in own_fields}
        if geometry_changes:
            changes["geometry"] = changes.get("geometry", self.geometry).replace(**geometry_changes)
        return replace(self, **changes)

    def of_test(self, history: History, nuisances: Mapping[str, float]) -> tuple[Self, History]:
        """As of every test piece, with the operator of the test."""
        stated = [name for name in history.geometry if name in DimpleGeometry.lengths]
        if self.mesh is not None and stated:
            raise SolveError(
                f"{history.origin} has a geometry of its own ({', '.join(stated)}), which a specimen with a mesh from "
                "files cannot follow; use one without mesh="
            )
        piece = replace(self, observation=self.observation_of(history)) if history.operator else self
        return FiniteElementSpecimen.of_test(piece, history, nuisances)

    @property
    def boundary_text(self) -> str:
        """Lengths, boundary conditions and load of the dimple, in sentences for a paper."""
        held = "held nodes are those of the mesh that was given"
        lengths = ""
        if self.mesh is None:
            held = " and ".join(_CLAMPED[edge] for edge in self.geometry.clamped)
            held = f"all displacements are zero {held}"
            named = (f"{n.replace('_', ' ')} {getattr(self.geometry, n):g} mm" for n in DimpleGeometry.lengths)
            lengths = f"Lengths of the dimple that a test does not state: {', '.join(named)}. "
        return (
            f"{lengths}Boundary conditions: {held}. Radial displacements are zero on the axis. The gas presses on the "
            "underside, normal to its deformed surface. Compared is what the operator of a test, by default "
            f"'{self.observation}', observes of the displacement of the top."
        )

    @property
    def surface_region(self) -> SurfaceRegion:
        """The roof moves, the top from the outer radius of the modelled disc on is held; see `camera_points`."""
        cavity, outer = self.geometry.cavity_radius, self.geometry.outer_radius
        seen = self.observation if self.observation.form != "profile" else Observation("field", cavity)
        return SurfaceRegion(cavity, (outer, max(2.0 * cavity, 1.5 * outer)), str(seen))

    def surface_operator(self, window: float | None = None, radii: Sequence[float] = ()) -> str:
        """The operator of camera points: Eq. (7) within a window, mm, or mean displacements on rings of radii, mm."""
        if len(radii):
            return str(Observation("rings", radii=tuple(radii)))
        return self.surface_region.operator if window is None else str(Observation("field", window))

    def surface_center(self, points: SurfacePoints) -> tuple[Floats, Floats]:
        """The one centre of all frames, (2,) mm, and its covariance (2, 2) mm2, by Eq. (7) within the cavity radius."""
        return surface_center(points, self.geometry.cavity_radius)

    def observe_surface(self, points: SurfacePoints, operator: str) -> SurfaceObservation:
        """Outputs of each frame from points of the top about the centre; see `camera_points`."""
        return observe_surface(points, operator)

    @cached_property
    def dimensions(self) -> tuple[Dimension, ...]:  # type: ignore[override]
        """The lengths of the dimple, unless its mesh is from elsewhere, and the window within which it is observed."""
        names = DimpleGeometry.lengths if self.mesh is None else ()
        bounds = (LENGTH_RANGE.low, LENGTH_RANGE.high)
        lengths = (Dimension(n, getattr(self.geometry, n), bounds, **_LENGTHS.get(n, {})) for n in names)
        return (*lengths, Dimension("window", self.observation.window, bounds, of_piece=False))

    def outputs_of_test(self, history: History) -> tuple[Output, ...]:
        """What the operator of a history observes, or that of the specimen where it names none.

        SolveError where the history has outputs of another form, or of more rings than its operator has radii.
        """
        operator = self.observation_of(history)
        others = [o for o in (*OBSERVED, *RING_OUTPUTS) if o in history.outputs and o not in operator.outputs]
        if others:
            rings = others[0] in RING_OUTPUTS
            advice = (
                "name the radii of all rings in mm, as in '# operator: rings 0, 2, 4 mm'"
                if rings
                else "name a form and a window, as in '# operator: profile 0-7.5 mm'"
            )
            stated = f"the operator '{operator}'" + ("" if history.operator else ", that of a test that names none,")
            raise SolveError(
                f"{history.origin}: '{others[0]}' is not among {', '.join(operator.outputs)}, which {stated} "
                f"observes; {advice}"
            )
        return operator.outputs

    def observation_of(self, history: History) -> Observation:
        """The operator that a history names, or that of the specimen where it names none."""
        if not history.operator:
            return self.observation
        with restated(SolveError, SolveError, f"{history.origin}: {SAID}"):
            return Observation.from_text(history.operator)

    def planned_loading(self, levels: tuple[float, float], jump_time: float) -> Loading:
        """The loading of a sample of a data set: both pressures, MPa, the second from `jump_time`, s, on."""
        return PressureJump(*levels, jump_time)

    @property
    def load_scaling(self) -> LoadScaling:
        """For sampling: 14.69 P (t/0.5 mm)^-1.17, and 42.3 mm (t/0.5 mm)^-0.486 of amplitude per unit of strain.

        At small deflections of a dimple of 7.5 mm cavity radius; both were fitted to simulations with the Norton law,
        n from 1 to 8, t from 0.44 to 0.60 mm.
        """
        radius, own = self.geometry.cavity_radius / 7.5, self.geometry.apex_thickness
        return LoadScaling(
            stress_per_load=14.69 * (radius / (own / 0.5)) ** 1.17,
            growth_per_strain=42.3 * radius**1.486 * (own / 0.5) ** -0.486,
            length="apex_thickness",
            nominal=own,
            exponents=(-1.17, -0.486),
            averaged=True,
        )

    def growth_per_strain(self, history: History) -> float:
        """mm of amplitude for each unit of reference strain: 42.3 (t/0.5 mm)^-0.486 for the default.

        Fitted to simulations of the default dimple with Norton's law, n from 1 to 8, t from 0.44 to 0.60 mm.
        """
        thickness = history.geometry.get("apex_thickness", self.geometry.apex_thickness) / 0.5
        return float(42.3 * (self.geometry.cavity_radius / 7.5) ** 1.486 * thickness**-0.486)

    def reference_stress(self, history: History) -> Floats:
        """Reference von Mises stress of each pressure level, (levels,) MPa: 12.5 P (t/0.5 mm)^-1.15 for the default.

        k = sigma/P of the reduced-order model at 0.3 to 0.5 mm of deflection of the default dimple; for others
        scaled as a plate of the same radius to thickness.
        """
        thickness = history.geometry.get("apex_thickness", self.geometry.apex_thickness)
        slenderness = self.geometry.cavity_radius / 7.5 * 0.5 / thickness
        levels = np.unique(history.load_levels)
        return np.asarray(12.5 * slenderness**1.15 * levels[levels > 0])

    # ---- as a specimen in finite elements -----------------------------------------------------------------------

    @property
    def run_kind(self) -> type[BulgeRun]:
        """See BulgeRun."""
        from creepkit.specimens.bulge.run import BulgeRun

        return BulgeRun

    def model_text(self, histories: Sequence[History]) -> str:
        """How the dimple is simulated, in sentences for a paper."""
        return f"{super().model_text(histories)} {self.boundary_text}"

    def reduced_order_model(self) -> Predictor:
        """The same finite elements in few modes and points, for global searches."""
        from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel

        return BulgeReducedOrderModel(self)

    def refined(self) -> Bulge:
        """The same on a mesh of half the element size, in steps of a tenth of the tolerance.

        Its error is a tenth of this one's in the median (docs/measured/dimple_accuracy.md says how large that is).
        """
        refined = super().refined()
        return refined if self.mesh is None else refined.replace(refinement=self.refinement)

    def finite_elements(self, load: str = "pressure") -> FiniteElementModel:
        """The finite elements of the specimen's mesh, or of its geometry."""
        return _model_of_mesh(self) if self.mesh is not None else model_of_geometry(self.geometry, self.refinement)

    @property
    def top_radii(self) -> Floats:
        """(top,) mm, radii of the observed nodes at rest."""
        model = self.finite_elements()
        return np.asarray(model.nodes[model.top, 0])

    def observed(self, load: str, simulation: Simulation) -> Floats:
        """(steps, top) mm, how far the top has risen in each accepted step."""
        return np.asarray(simulation.displacements[:, self.finite_elements().top, 1])

    def observed_outputs(self, load: str, simulation: Simulation) -> Floats:
        """Outputs in each accepted step, (steps, outputs)."""
        return self.observation.observe(self.top_radii, self.observed(load, simulation))

    def observed_at_times(self, load: str, simulation: Simulation, times: Floats) -> Floats:
        """Outputs at times (times,) s, (times, outputs), in one call of the core."""
        profiles = self.observed(load, simulation)
        return self.observation.observe_at_times(self.top_radii, profiles, simulation.timeline, times)

    def observe_with_derivatives(self, load: str, simulation: Simulation) -> tuple[Floats, Floats]:
        """Outputs, and exact derivatives (steps, outputs, top) to the rise of the top."""
        return self.observation.observe_with_derivatives(self.top_radii, self.observed(load, simulation))

    def derivatives_from_rest(self, columns: Floats) -> Floats:
        """Derivatives (steps, outputs, columns); width and shape at rest have those of the step that follows.

        columns : (steps, outputs, columns) as the core differentiates.
        """
        if self.observation.form != "rings":
            columns[0, 1:] = columns[1, 1:] if len(columns) > 1 else 0.0
        return columns

    def length_derivative(self, load: str, key: str, simulation: Simulation) -> Floats:
        """Derivative (steps, outputs) of the outputs to a length, or to the window, at the same displacements."""
        profiles = self.observed(load, simulation)
        if key == "window":
            return self.observation.window_derivatives(self.top_radii, profiles)
        _, velocity, _ = self.movement(load, key)
        return self.observation.node_derivatives(self.top_radii, profiles, velocity[self.finite_elements().top, 0])

    def movement(self, load: str, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
        """How points and nodes (nodes, 2), mm, move with a length; there are no dead forces."""
        known = dimension_named(self, key)
        assert known is not None
        return _movement(self.geometry, self.refinement, known.name)

    def taken_for_granted(self, history: History) -> dict[str, Any]:
        """As of every body, and the operator."""
        return {**super().taken_for_granted(history), "operator": str(self.observation)}


@lru_cache(maxsize=16)
def _model_of_mesh(piece: Bulge) -> FiniteElementModel:
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
    model = model_of_geometry(geometry, refinement)
    return model.geometry_derivative(velocity), velocity, np.zeros_like(velocity)


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The paper's dimple."""
    return [Bulge()]
