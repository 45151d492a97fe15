"""ReferenceStressModel: a test piece as one material point under the reference stress that its record states.

Reference stress methods of creep: the deflection of a structure grows as the creep strain of a bar under the reference
stress does (Mackenzie 1968, Int J Mech Sci 10, 441; Penny and Marriott, Design for Creep, 1971).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit import integration, kernels
from creepkit.arrays import Floats
from creepkit.errors import SurrogateError
from creepkit.integration import IntegrationSettings, PointTest
from creepkit.records import (
    History,
    HistoryPrediction,
    NuisanceValues,
    Prediction,
    Predictor,
    Program,
    Specimen,
    assemble_prediction,
    constant_load,
)
from creepkit.sampling.conditions import check_stated, creep_output, mean_reference_stress, tested_piece

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


SETTINGS = IntegrationSettings(rtol=1e-4, strain_limit=10.0)
"""Of the integration: the model itself errs by per cents, and a network corrects it."""


@dataclass(frozen=True)
class ReferenceStressModel(Predictor):
    """The output that grows with creep: growth_per_strain(history) times the creep strain at the reference stress.

    specimen : the one whose record states both; its output must grow with creep.
    """

    specimen: Specimen

    def __post_init__(self) -> None:
        for name, meaning in (("reference_stress", "its reference stress"), ("growth_per_strain", "its growth")):
            check_stated(self.specimen, name, meaning)
        if creep_output(self.specimen).falls:
            raise SurrogateError(
                f"specimen '{self.specimen.name}': its output falls under creep, which its reference stress follows; "
                "use base='none'"
            )

    @property
    def name(self) -> str:  # type: ignore[override]
        """Of what it is a model."""
        return f"{self.specimen.name} at its reference stress"

    @property
    def outputs(self) -> tuple[str, ...]:  # type: ignore[override]
        """The output that grows with creep."""
        return (creep_output(self.specimen).output,)

    @property
    def nuisances(self) -> tuple[str, ...]:  # type: ignore[override]
        """As the specimen's."""
        return self.specimen.nuisances

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """The output of each history at its times; derivatives are left to differences.

        theta : (candidates, parameters) internal values.
        """
        kernel = kernels.lower(law, "compiled")
        every, parts = np.arange(len(theta)), []
        for rows in (
            every[:, None] if nuisances else [every]
        ):  # with nuisances each candidate has test pieces of its own
            tests = []
            for k, history in enumerate(histories):
                values = {kind: float(of_test[rows[0], k]) for kind, of_test in nuisances.items()}
                tests.append(tested_piece(self.specimen, history.replace(outputs={}, standard_deviation={}), values))
            points = [_point_test(*test) for test in tests]
            found = integration.integrate(kernel, theta[rows], points, settings=SETTINGS)
            growth = [float(np.mean(piece.growth_per_strain(plan))) for piece, plan in tests]
            parts.append(
                [(growth[k] * found.of(k), found.status[:, k], found.end_times[:, k]) for k in range(len(growth))]
            )
        joined = [tuple(map(np.concatenate, zip(*columns, strict=True))) for columns in zip(*parts, strict=True)]
        of_histories = [HistoryPrediction(values[..., None], status, ends) for values, status, ends in joined]
        return assemble_prediction(of_histories, histories, self.outputs, len(theta))


def _point_test(piece: Any, plan: History) -> PointTest:
    """A material point under the reference stress of each value of the load; zero where there is no load."""
    program = plan.loading.program()
    loads, which = np.unique(program.values, return_inverse=True)
    quantity = plan.loading.quantity
    held = [plan.replace(loading=constant_load(quantity, float(load))) if load > 0.0 else None for load in loads]
    stresses = np.array([mean_reference_stress(piece, test) if test else 0.0 for test in held])
    return PointTest(Program(program.times, stresses[which]), plan.temperature_program(), plan.times)
