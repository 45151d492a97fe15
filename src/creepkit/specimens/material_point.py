"""A material point under prescribed stresses and total strains of its six components.

Outputs are "strain", the equivalent creep strain, "strain_11" to "strain_13", the components of creep strain (of the
tensor; elastic strain is added where the history says so), and "stress_11" to "stress_13", MPa. Small strain,
isotropic elasticity, creep along the deviator of stress. Derivatives are exact under proportional loading, else
central differences.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.hookspecs import hookimpl
from creepkit.integration.tensor_point import ProportionalLoading, von_mises
from creepkit.integration.time_discretisation import SDIRK2_TEXT
from creepkit.language.elastic import STATE_MODULUS
from creepkit.records import (
    TENSOR_COMPONENTS,
    History,
    HistoryPrediction,
    Load,
    NuisanceValues,
    Output,
    PointLoading,
    Prediction,
    Specimen,
    assemble_prediction,
)
from creepkit.specimens.point_specimen import PointSpecimen, isothermal_elasticity
from creepkit.specimens.run import Run, run_from_outputs

if TYPE_CHECKING:
    from creepkit.integration.tensor_integration import PointTrajectory
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw


OUTPUTS = (
    Output("strain", "strain", "equivalent creep strain", visible=2e-4),
    *(Output(f"strain_{c}", "strain", f"strain {c}", grows=False) for c in TENSOR_COMPONENTS),
    *(Output(f"stress_{c}", "signed stress", f"stress {c}", grows=False) for c in TENSOR_COMPONENTS),
)


DIFFERENCE_STEP = 1e-3
"""Of the central differences in internal parameters, relative where a parameter of linear scale is above one."""


DEFAULT_ELASTICITY = (150e3, 0.3)
"""E, MPa, and nu where stresses alone are prescribed and no elastic data are given: creep does not depend on them."""


@dataclass(frozen=True)
class MaterialPoint(PointSpecimen):
    """A material point; the cap on steps is beside those for its frames and each row of its programs."""

    name: ClassVar[str] = "point"
    title: ClassVar[str] = "Material point under prescribed stresses and strains of any components"
    outputs: ClassVar[tuple[Output, ...]] = OUTPUTS
    loads: ClassVar[tuple[Load, ...]] = (Load("components", "number"),)
    least_tolerance: ClassVar[float] = 1e-10

    def model_text(self, histories: Sequence[History]) -> str:
        """How the point is simulated, in sentences for a paper."""
        return (
            "A material point under prescribed components of stress and strain has small strains, isotropic elasticity "
            "and creep along the deviator of stress, at the rate that the law gives for the von Mises stress; it is "
            f"integrated in time by {SDIRK2_TEXT}, with a local error of at most {self.tolerance:g} of the strain in a "
            f"step, and ruptures at an equivalent creep strain of {self.strain_limit:g}."
        )

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> PointRun:
        """Run one test, keeping all tensors and the states of the law; see PointRun."""
        return run_material_point(self, law, values, plan)

    def reference_stress(self, history: History) -> Floats:
        """The von Mises stresses that are prescribed, or would be if nothing crept, (levels,) MPa."""
        return elastic_von_mises(_loading(history), None if history.elastic is None else _elastic(history))

    def simulated_stress(self, law: CreepLaw, values: Mapping[str, float], history: History) -> Floats:
        """The von Mises stresses above zero from the first loading on, (times,) MPa."""
        stress = self.run(law, values, history).mises
        return stress[stress > 0]

    def reference_strain(self, history: History) -> float:
        """The largest equivalent creep strain that a test reached, as its outputs show."""
        for kind in ("strain", "strain_", "stress_"):
            result = [v[history.used] for name, v in history.outputs.items() if name.startswith(kind)]
            if result and kind == "stress_":
                return max(float(np.ptp(v)) for v in result) / _elastic(history)[0]
            if result:
                return max(float(np.max(np.abs(v), initial=0.0)) for v in result)
        return 0.0

    # ---- one history at a time -------------------------------------------------------------------------------------

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict histories; theta : (candidates, parameters) internal values."""
        kernel = kernels.lower(law, "compiled")
        steps = DIFFERENCE_STEP * np.array([1.0 if p.scale == "log" else np.inf for p in law.params.values()])
        steps = np.where(np.isinf(steps), DIFFERENCE_STEP * np.maximum(1.0, np.abs(theta)), steps)
        parts = [
            self._predict_history(kernel, theta, history, steps if sensitivities else None) for history in histories
        ]
        return assemble_prediction(parts, histories, OUTPUTS, len(theta))

    def _predict_history(
        self, kernel: CompiledLaw, theta: Floats, history: History, steps: Floats | None
    ) -> HistoryPrediction:
        """One history; steps : (candidates, P) of the differences, or None to do without derivatives."""
        path = _path(history)
        if path is not None:
            return self._predict_proportional(path, kernel, theta, history, steps is not None)
        runs = [self.simulate(kernel, candidate, history) for candidate in theta]
        return HistoryPrediction(
            np.array([point_outputs(run, history) for run in runs]),
            np.array([int(run.status) for run in runs]),
            np.array([run.end_time for run in runs]),
            None
            if steps is None
            else np.array([self._differences(kernel, *one, history) for one in zip(theta, steps, strict=True)]),
        )

    def _predict_proportional(
        self, path: ProportionalLoading, kernel: CompiledLaw, theta: Floats, history: History, jacobian: bool
    ) -> HistoryPrediction:
        """One history whose stress keeps its direction: what is shown is a straight line in the creep strain."""
        test = integration.PointTest(path.driving, history.temperature_program(), history.times, path.stiffness)
        result = integration.integrate(
            kernel,
            theta,
            [test],
            settings=self.integration_settings(history.times.size),
            jacobian=jacobian,
            axes=path.axes,
        )
        stress, stress_derivative = (
            _imposed(history) + np.outer(path.driving.at(history.times), path.along),
            -path.stiffness * path.along,
        )
        elastic = compliance(_elastic(history)) if history.includes_elastic else np.zeros((6, 6))
        start = np.concatenate([np.zeros((len(stress), 1)), stress @ elastic.T, stress], axis=1)
        slope = np.concatenate([[1.0], path.flow + elastic @ stress_derivative, stress_derivative])
        changes = None if result.jacobian is None else result.jacobian[:, :, None, :] * slope[:, None]
        values = start + result.strain[..., None] * slope
        return HistoryPrediction(values, result.status[:, 0], result.end_times[:, 0], changes)

    def simulate(self, kernel: CompiledLaw, theta: Floats, history: History) -> PointTrajectory:
        """Integrate one candidate, theta (P,) internal values, through one history in six components."""
        from creepkit.integration.tensor_integration import integrate_tensor_point
        from creepkit.integration.time_discretisation import SDIRK4

        loading = _loading(history)
        stress_only = not loading.strain and not history.includes_elastic
        elastic = DEFAULT_ELASTICITY if stress_only and history.elastic is None else _elastic(history)
        settings = self.integration_settings(history.times.size)
        return integrate_tensor_point(
            kernel, theta, elastic, loading, history.temperature, history.times, settings=settings, tableau=SDIRK4
        )

    def _differences(self, kernel: CompiledLaw, theta: Floats, steps: Floats, history: History) -> Floats:
        """Central differences to the internal parameters, (frames, outputs, P); zero where one is switched off."""
        slopes = np.zeros((history.times.size, len(OUTPUTS), theta.size))
        for p in np.flatnonzero(np.isfinite(theta)):
            shift = np.where(np.arange(theta.size) == p, steps, 0.0)
            up, down = (
                point_outputs(self.simulate(kernel, end, history), history) for end in (theta + shift, theta - shift)
            )
            slopes[:, :, p] = (up - down) / (2 * steps[p])
        return slopes


def _loading(history: History) -> PointLoading:
    if isinstance(history.loading, PointLoading):
        return history.loading
    where = history.origin
    raise SolveError(
        f"{where}: a material point is loaded by components, found {history.loading.quantity}; "
        'use PointLoading(stress={"11": 100})'
    )


@lru_cache(maxsize=4096)
def _path(history: History) -> ProportionalLoading | None:
    from creepkit.integration.tensor_point import proportional_loading

    loading = _loading(history)
    return proportional_loading(loading, float(history.times[-1]), _elastic(history) if loading.strain else None)


def _elastic(history: History) -> tuple[float, float]:
    return isothermal_elasticity(history, "point")


def _imposed(history: History) -> Floats:
    """(frames, 6) prescribed stresses, MPa; zero where none is."""
    stress = _loading(history).stress
    zero = np.zeros(history.times.size)
    return np.stack([stress[c].at(history.times) if c in stress else zero for c in TENSOR_COMPONENTS], axis=-1)


def point_outputs(run: PointTrajectory, history: History) -> Floats:
    """The outputs of a simulated point, (frames, outputs), NaN after its end."""
    strains = run.strain if history.includes_elastic else run.creep_strain
    rows = np.concatenate([run.equivalent[:, None], strains, run.stress], axis=1)
    shown = np.full((history.times.size, len(OUTPUTS)), np.nan)
    shown[: len(rows)] = rows
    return shown


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The material point with its default settings."""
    return [MaterialPoint()]


@dataclass(frozen=True, eq=False, kw_only=True)
class PointRun(Run):
    """A simulated material point, at the times of the run.

    stress, total_strain, creep_strain : (times, 6) MPa and tensor strains, in the order 11, 22, 33, 12, 23, 13; the
        total strain is NaN without elastic data. equivalent : (times,) equivalent creep strain.
    states : {name: (times,)} internal variables of the law.

    Its outputs leave out the components that stay zero.
    """

    stress: Floats = field(repr=False)
    total_strain: Floats = field(repr=False)
    creep_strain: Floats = field(repr=False)
    equivalent: Floats = field(repr=False)
    states: Mapping[str, Floats] = field(repr=False)

    @property
    def mises(self) -> Floats:
        """The von Mises stress, (times,) MPa."""
        return von_mises(self.stress)


def run_material_point(specimen: MaterialPoint, law: CreepLaw, values: Mapping[str, float], plan: History) -> PointRun:
    """Simulate one test and keep all of it."""
    kernel = kernels.lower(law, "compiled")
    result = specimen.simulate(kernel, law.to_internal(law.values(values))[0], plan)
    rows = point_outputs(result, plan)
    shown_columns = [k for k, column in enumerate(rows.T) if k == 0 or np.nanmax(np.abs(column), initial=0.0) > 0.0]
    names = [OUTPUTS[k] for k in shown_columns]
    output_rows = np.searchsorted(result.times, plan.times[plan.times <= result.end_time])
    total = result.strain if plan.elastic is not None else np.full_like(result.strain, np.nan)
    states = {symbol.name: result.states[output_rows, k] for k, symbol in enumerate(law.states)}
    return run_from_outputs(
        PointRun,
        plan,
        names,
        rows[:, shown_columns],
        result.status,
        result.end_time,
        result.reason,
        stress=result.stress[output_rows],
        total_strain=total[output_rows],
        creep_strain=result.creep_strain[output_rows],
        equivalent=result.equivalent[output_rows],
        states=states,
    )


def compliance(elastic: tuple[float, float]) -> Floats:
    """(6, 6) tensor strains from stresses, 1/MPa; elastic : E, MPa, and nu."""
    E, nu = elastic
    matrix = (1.0 + nu) / E * np.eye(6)
    matrix[:3, :3] -= nu / E
    return matrix


def elastic_von_mises(loading: PointLoading, elastic: tuple[float, float] | None) -> Floats:
    """The von Mises stresses above zero at the breakpoints of a loading, if nothing crept, (levels,) MPa."""
    marks = np.unique(np.concatenate([p.times for p in (*loading.stress.values(), *loading.strain.values())]))
    stress = np.zeros((marks.size, 6))
    for name, program in loading.stress.items():
        stress[:, TENSOR_COMPONENTS.index(name)] = program.at(marks)
    if loading.strain:
        if elastic is None:
            raise SolveError(f"a material point under prescribed strain needs elastic data; {STATE_MODULUS}")
        strain_controlled = [TENSOR_COMPONENTS.index(name) for name in loading.strain]
        flexibility = compliance(elastic)
        elastic_residual = (
            np.stack([p.at(marks) for p in loading.strain.values()], axis=-1)
            - stress @ flexibility[strain_controlled].T
        )
        stress[:, strain_controlled] = np.linalg.solve(
            flexibility[np.ix_(strain_controlled, strain_controlled)], elastic_residual.T
        ).T
    levels = np.unique(von_mises(stress))
    return np.asarray(levels[levels > 0])
