"""The reduced-order model of the bulge test as a predictor: the dimple's finite elements in few modes and points.

Set-up, observation and sensitivities are those of the finite elements. One basis serves thicknesses about the one that
it was trained for, and the derivatives to a thickness are exact; another basis is trained where a test piece needs it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.reduced_order_model import ReducedOrderModel
from creepkit.fem.simulation import simulate
from creepkit.fem.solver import SolverSettings
from creepkit.records import History, NuisanceValues, Output, Prediction, Predictor
from creepkit.specimens.bulge.geometry import DimpleGeometry, model_of_geometry
from creepkit.specimens.bulge.observation import DEFAULT_WINDOW, Observation
from creepkit.specimens.bulge.outputs import OBSERVED, RING_OUTPUTS
from creepkit.specimens.finite_element_tests import (
    EQUILIBRIUM_SHARE,
    FiniteElementTest,
    Reduction,
    predict_tests,
    solver_settings,
)
from creepkit.specimens.reduced_order_training import MODES, RAMP, power_law_runs, trained_basis

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge.run import BulgeRun


THICKNESS_RANGE = 1.25
"""Largest over smallest apex thickness of one basis."""


STEP_SHARE, STEP_GROWTH = 1.5, 3.0
"""Tolerance of steps over that of the specimen, and their growth: they err by half as much as the modes."""


SEARCH_TOLERANCE, SEARCH_GROWTH = 4e-2, 4.0
"""Of the steps in a global search."""


SEARCH_MODES = 16
"""Modes in a global search; with its steps the model errs by 0.3 % in the median, for half of its cost."""


TRAINED_THICKNESSES = 3
"""Thicknesses that a basis is trained at."""


TESTED_RUNS, TESTED_SHARE = 16, 0.95
"""Runs that the stated error is measured on, and the share of the shorter simulation that counts: at its end, where the
dimple bursts, any difference of time is a large one of deflection."""


LENGTH_STEP = 1.05
"""Other lengths of a test piece share a basis within half of this ratio."""


@dataclass(frozen=True)
class BulgeReducedOrderModel(Predictor):
    """A bulge specimen in a reduced-order model; same outputs, nuisances and errors, and derivatives to all of them.

    Trained at the first prediction, in some seconds of CPU for each dimple, and kept on disk. modes, points : of the
    model; None for as many points as the mesh needs. searching : whether it is as coarse as a global search allows.
    """

    specimen: Any
    modes: int = MODES
    points: int | None = None
    searching: bool = False
    is_trained: ClassVar[bool] = True
    takes_values_of_tests: ClassVar[bool] = True
    name: ClassVar[str] = "bulge, reduced-order model"
    title: ClassVar[str] = "Bulge test in a reduced-order model, for searches"
    optional_outputs: ClassVar[tuple[Output, ...]] = (*OBSERVED, *RING_OUTPUTS)

    @property
    def outputs(self) -> tuple[str, ...]:  # type: ignore[override]
        """As the specimen's."""
        return tuple(self.specimen.outputs)

    @property
    def nuisances(self) -> tuple[str, ...]:  # type: ignore[override]
        """As the specimen's."""
        return tuple(self.specimen.nuisances)

    @property
    def own_nuisances(self) -> tuple[str, ...]:
        """As the specimen's."""
        return tuple(self.specimen.own_nuisances)

    def outputs_of_test(self, history: History) -> tuple[str, ...]:
        """As the specimen's."""
        return tuple(self.specimen.outputs_of_test(history))

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict what is observed of each history at its times.

        theta : (candidates, parameters) internal values.
        """
        reduction = Reduction(self.reduced_model_of, self.settings)
        return predict_tests(self.specimen, law, theta, histories, nuisances, sensitivities, reduction)

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> BulgeRun:
        """Run one test, keeping displacements of the whole dimple; stresses are known at some points only, see fields.

        A field of the run is a SolveError.
        """
        from creepkit.specimens.finite_element_run import run_test

        reduction = Reduction(self.reduced_model_of, self.settings)
        return run_test(FiniteElementTest.of(self.specimen, plan, {}), law, values, reduction)  # type: ignore[no-any-return]

    def single_threaded(self) -> BulgeReducedOrderModel:
        """The same model of a specimen that starts no threads."""
        return replace(self, specimen=self.specimen.single_threaded())

    def for_search(self) -> BulgeReducedOrderModel:
        """The same model in longer steps."""
        return replace(self, searching=True)

    @property
    def settings(self) -> SolverSettings:
        """The solver's settings."""
        own, growth = self.specimen.tolerance, SEARCH_GROWTH if self.searching else STEP_GROWTH
        tolerance = max(SEARCH_TOLERANCE, own) if self.searching else STEP_SHARE * own
        newton = EQUILIBRIUM_SHARE * tolerance
        return solver_settings(self.specimen)._replace(tolerance=tolerance, newton=newton, growth=growth)

    def reduced_model_of(self, piece: Any, stated: Any = None) -> ReducedOrderModel:
        """The reduced-order model of a test piece.

        stated : that of the history, by default `piece`. Its basis serves all lengths that a fit tries: another one
        differs by micrometres, a step in the middle of a fit.
        """
        if piece.mesh is not None:
            model = piece.finite_elements()
            basis = trained_basis((model,), solver_settings(self.specimen), modes=self.modes, points=self.points)
            return ReducedOrderModel(model, basis)
        about = (stated or piece).geometry
        reduced = _model_of_geometry(self.specimen, piece.geometry, about, self.modes, self.points)
        return _with_leading_modes(reduced, SEARCH_MODES) if self.searching else reduced

    def train(self) -> str:
        """Train the model of the specimen's own dimple, and keep it on disk; its modes and points, in words."""
        model = self.reduced_model_of(self.specimen)
        return f"{len(model.basis.modes)} modes, {len(model.basis.points)} of {model.model.weights.size} points"

    @property
    def error(self) -> dict[str, float]:  # type: ignore[override]
        """{output: standard deviation of its error}, in the output's unit, from runs that training did not see.

        1.25 times the mean absolute error, that of a Gaussian: rare large errors would widen every interval. On rings
        it is the largest of the whole top, which is that of the middle.
        """
        *of_fit, largest = _output_errors(self)
        return {**dict(zip(OBSERVED, of_fit, strict=True)), **dict.fromkeys(RING_OUTPUTS, largest)}

    def refined(self) -> Predictor | None:
        """What it stands for: the specimen itself on its finer discretisation."""
        return self.specimen.refined()  # type: ignore[no-any-return]


@lru_cache(maxsize=16)
def _output_errors(predictor: BulgeReducedOrderModel) -> tuple[float, ...]:
    """(4,) standard deviations of the errors of D and S in mm, of p, and of u_z in mm where it is largest.

    On the specimen's own dimple, in its own window.
    """
    specimen = predictor.specimen
    model, reduced = specimen.finite_elements(), predictor.reduced_model_of(specimen)
    radii = specimen.top_radii
    fit = specimen.observation
    if fit.form == "rings":
        fit = Observation(window=min(DEFAULT_WINDOW, float(radii[-1])))
    runs = power_law_runs([model], TESTED_RUNS, seed=1)
    simulated, errors = ((model, solver_settings(specimen)), (reduced, predictor.settings)), []
    for run in runs:
        made = [simulate(run.law, run.theta, each, run.load_history, settings=own) for each, own in simulated]
        end = TESTED_SHARE * min(each.end_time for each in made)
        times = made[0].times[(made[0].times > RAMP) & (made[0].times <= end)]
        profiles = [each.displacements[:, model.top, 1] for each in made]
        exact, found = (
            np.hstack([fit.observe_at_times(radii, profile, each.timeline, times), each.at(profile, times)])
            for each, profile in zip(made, profiles, strict=True)
        )
        errors.append(np.abs(found - exact))
    mean = 1.2533 * np.nanmean(np.concatenate(errors), axis=0)
    return (*mean[: len(OBSERVED)].tolist(), float(mean[len(OBSERVED) :].max()))


@lru_cache(maxsize=256)
def _with_leading_modes(model: ReducedOrderModel, count: int) -> ReducedOrderModel:
    return ReducedOrderModel(model.model, model.basis.leading(count))


@lru_cache(maxsize=256)
def _model_of_geometry(
    specimen: Any, geometry: DimpleGeometry, about: DimpleGeometry, modes: int, points: int | None
) -> ReducedOrderModel:
    """The reduced-order model of a dimple, by the basis for the one `about`; kept, a fit needs it a thousand times."""
    refinement = specimen.refinement
    model = model_of_geometry(geometry, refinement)
    candidates = _thicknesses(nominal_geometry(specimen.geometry, about), refinement)
    alike = [each for each in candidates if _same_numbering(model, each)] or [model]
    places = np.linspace(0, len(alike) - 1, min(len(alike), TRAINED_THICKNESSES)).round().astype(int)
    family = tuple(alike[k] for k in places)
    settings = solver_settings(specimen)
    return ReducedOrderModel(model, trained_basis(family, settings, modes=modes, points=points))


def nominal_geometry(own: DimpleGeometry, geometry: DimpleGeometry) -> DimpleGeometry:
    """The dimple that a basis for `geometry` is trained about; own : the specimen's, which is one of them."""

    def nearest(name: str) -> float:
        step = THICKNESS_RANGE if name == "apex_thickness" else LENGTH_STEP
        value = getattr(own, name)
        return float(value * step ** np.round(np.log(getattr(geometry, name) / value) / np.log(step)))

    try:
        return geometry.replace(**{name: nearest(name) for name in DimpleGeometry.lengths})
    except SolveError:  # lengths that fit each other no longer when rounded
        return geometry


@lru_cache(maxsize=64)
def _thicknesses(nominal: DimpleGeometry, refinement: float) -> tuple[FiniteElementModel, ...]:
    """Models of thicknesses that a basis may be trained at, as far as the plate allows."""
    ends = np.log(THICKNESS_RANGE) * np.linspace(-0.5, 0.5, 2 * TRAINED_THICKNESSES + 1)
    most = nominal.plate_thickness - nominal.roof_axial
    thicknesses = sorted({min(float(nominal.apex_thickness * np.exp(e)), most) for e in ends})
    return tuple(model_of_geometry(nominal.replace(apex_thickness=h), refinement) for h in thicknesses)


def _same_numbering(one: FiniteElementModel, other: FiniteElementModel) -> bool:
    pairs = ((getattr(m, name) for m in (one, other)) for name in ("elements", "equations", "pressed", "top"))
    return all(np.array_equal(a, b) for a, b in pairs)
