"""FiniteElementSpecimen: a specimen in finite elements, how it is simulated, and what a kind of it states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.limits import Limits, check_fields, numbers
from creepkit.records import PROGRAM_NUISANCES, History, NuisanceValues, Prediction
from creepkit.specimens.test_piece import TestPiece

if TYPE_CHECKING:
    from creepkit.fem.finite_element_model import FiniteElementModel
    from creepkit.fem.mesh import GeometryDerivative
    from creepkit.fem.simulation import Simulation
    from creepkit.language import CreepLaw
    from creepkit.specimens.finite_element_run import FiniteElementRun


@dataclass(frozen=True, kw_only=True)
class FiniteElementSpecimen(TestPiece):
    """A body of revolution in finite elements, what is observed of it, and the limits of its simulation.

    A kind of it says what the test piece at hand, `self`, is made of under a load, by the name of the load, and what is
    observed of it in a simulation.

    tolerance : estimated error of a step, over the largest observed displacement plus `resolution` mm.
    refinement : of the mesh; 2 has twice as many elements each way.
    deflection_limit : mm, observed displacement at which the test ends. strain_limit : creep strain at which a point
        has ruptured. max_steps : cap on the steps of one simulation, so on its cost.
    threads : simulations that run at the same time; None for one on each core.
    """

    tolerance: float = 5e-3
    refinement: float = 1.0
    resolution: float = 1e-3
    deflection_limit: float = 1e3
    strain_limit: float = 1.0
    max_steps: int = 1000
    threads: int | None = None

    ranges: ClassVar[Mapping[str, Limits]] = MappingProxyType(
        {
            "tolerance": numbers(1e-6, 0.1),
            "refinement": numbers(0.1, 100.0),
            "resolution": numbers(1e-9, 1e3),
            "deflection_limit": numbers(1e-6, 1e6),
            "strain_limit": numbers(1e-3, 10.0),
            "max_steps": Limits(10, 100_000),
        }
    )
    """What is allowed of each setting."""

    takes_values_of_tests: ClassVar[bool] = True

    first_step: ClassVar[float] = 10.0
    """s, the longest first step after a change of load; less where high stresses relax in less."""

    def __post_init__(self) -> None:
        threads = {} if self.threads is None else {"threads": Limits(1, 100_000)}
        check_fields(self, {**self.ranges, **threads}, f"{self.name} specimen: ", SolveError)

    def refined(self) -> Self:
        """The same with twice as many elements in each direction, in steps of a tenth of the tolerance."""
        return self.replace(refinement=2.0 * self.refinement, tolerance=max(0.1 * self.tolerance, 1e-6))

    # ---- of each kind ----------------------------------------------------------------------------------------------

    def finite_elements(self, load: str) -> FiniteElementModel:
        """The finite elements of the test piece under a load."""
        raise NotImplementedError

    def observed(self, load: str, simulation: Simulation) -> Floats:
        """What is observed of the body in each accepted step, (steps, observed): displacements, mm, and a force, N."""
        raise NotImplementedError

    def observed_outputs(self, load: str, simulation: Simulation) -> Floats:
        """Outputs in each accepted step, (steps, outputs)."""
        raise NotImplementedError

    def observe_with_derivatives(self, load: str, simulation: Simulation) -> tuple[Floats, Floats]:
        """As `observed_outputs`, and derivatives (steps, outputs, observed) to what is observed."""
        raise NotImplementedError

    def length_derivative(self, load: str, key: str, simulation: Simulation) -> Floats:
        """Derivative (steps, outputs) of the outputs to a length at the same displacements."""
        raise NotImplementedError

    def movement(self, load: str, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
        """How points, nodes (nodes, 2), mm, and dead forces (nodes, 2), N/rad, move with a length."""
        raise NotImplementedError

    def motion(self, load: str) -> float | None:
        """mm of motion for a unit of the load; None where the load acts as a pressure or a force."""
        return None

    def derivatives_from_rest(self, columns: Floats) -> Floats:
        """Derivatives (steps, outputs, columns) with those of the first step, at rest, as they are meant.

        columns : (steps, outputs, columns) as the core differentiates.
        """
        return columns

    @property
    def run_kind(self) -> type[FiniteElementRun]:
        """What a run is."""
        from creepkit.specimens.finite_element_run import FiniteElementRun

        return FiniteElementRun

    # ---- of every kind ---------------------------------------------------------------------------------------------

    @property
    def own_nuisances(self) -> tuple[str, ...]:
        """All kinds that change a test piece or the programs of a history are differentiated."""
        return (*self.nuisances, *PROGRAM_NUISANCES)

    def observed_change(self, load: str, simulation: Simulation) -> Floats:
        """Derivatives (steps, observed, columns) of what is observed of the body, by the core."""
        change = np.array(simulation.sensitivities)
        if self.motion(load) is not None:
            change[:, -1] *= 2.0 * np.pi
        return change

    def observed_at_times(self, load: str, simulation: Simulation, times: Floats) -> Floats:
        """Outputs at times (times,) s, (times, outputs)."""
        return simulation.at(self.observed_outputs(load, simulation), times)

    def taken_for_granted(self, history: History) -> dict[str, Any]:
        """{field: value} of a history with all that it does not state: the lengths of the test piece."""
        lengths = {each.name: each.default for each in self.dimensions if each.of_piece}
        return {"geometry": {**lengths, **history.geometry}}

    def single_threaded(self) -> Self:
        """The same, which starts no threads."""
        return self if self.threads == 1 else self.replace(threads=1)

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict the outputs of each history at its times, with exact derivatives.

        theta : (candidates, parameters) internal values.
        """
        from creepkit.specimens.finite_element_tests import predict_tests

        return predict_tests(self, law, theta, histories, nuisances, sensitivities)

    def model_text(self, histories: Sequence[History]) -> str:
        """How the body is simulated, in sentences for a paper."""
        from creepkit.specimens.finite_element_tests import finite_element_text

        load = histories[0].loading.quantity if histories else self.loads[0].name
        return finite_element_text(self, self.finite_elements(load))

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> FiniteElementRun:
        """Run one test, keeping displacements, stresses and strains of the whole body; see FiniteElementRun."""
        from creepkit.specimens.finite_element_run import run_test
        from creepkit.specimens.finite_element_tests import FiniteElementTest

        run: FiniteElementRun = run_test(FiniteElementTest.of(self, plan, {}), law, values)
        return run

    def simulated_stress(self, law: CreepLaw, values: Mapping[str, float], history: History) -> Floats:
        """The least and the largest stress that creep follows in the body, (2,) MPa; see FiniteElementRun."""
        return self.run(law, values, history).creep_stress_range
