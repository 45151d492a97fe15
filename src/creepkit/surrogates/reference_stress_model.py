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
    Output,
    Prediction,
    Program,
    Specimen,
    assemble_prediction,
    broadcast_candidates,
    constant_load,
    dimension_named,
)
from creepkit.sampling.specimen_conditions import creep_output, stated_method, tested_piece
from creepkit.specimens.test_piece import warmer_and_stiffer

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw


SETTINGS = IntegrationSettings(rtol=1e-4, strain_limit=10.0)
"""Of the integration: the model itself errs by per cents, and a network corrects it."""


@dataclass(frozen=True)
class ReferenceStressModel:
    """The output that grows with creep: growth_per_strain(history) times the creep strain at the reference stress.

    specimen : the one whose record states both; its output must grow with creep.
    """

    specimen: Specimen

    def __post_init__(self) -> None:
        for name, meaning in (("reference_stress", "its reference stress"), ("growth_per_strain", "its growth")):
            stated_method(self.specimen, name, meaning)
        if creep_output(self.specimen).falls:
            raise SurrogateError(
                f"specimen '{self.specimen.name}': its output falls under creep, which its reference stress follows; "
                "use base='none'"
            )

    @property
    def name(self) -> str:
        """Of what it is a model."""
        return f"{self.specimen.name} at its reference stress"

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The output that grows with creep."""
        return (creep_output(self.specimen).output,)

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """The output of each history at its times; see records.Predictor. Derivatives are left to differences.

        theta : (candidates, parameters) internal values.
        """
        kernel = kernels.lower(law, "compiled")
        theta, of_tests = broadcast_candidates(theta, nuisances, len(histories))
        if not of_tests:
            parts = self._parts(kernel, theta, histories)
            return assemble_prediction(parts, histories, self.outputs, len(theta))
        candidates = []
        for c in range(len(theta)):
            changed = [
                self._changed(history, {kind: float(values[c, k]) for kind, values in of_tests.items()})
                for k, history in enumerate(histories)
            ]
            candidates.append(self._parts(kernel, theta[c : c + 1], changed))
        parts = [_joined([of_one[k] for of_one in candidates]) for k in range(len(histories))]
        return assemble_prediction(parts, histories, self.outputs, len(theta))

    def _parts(self, kernel: CompiledLaw, theta: Floats, histories: Sequence[History]) -> list[HistoryPrediction]:
        pieces = [
            tested_piece(self.specimen, history.replace(outputs={}, standard_deviation={})) for history in histories
        ]
        tests = [_point_test(piece, plan) for piece, plan in pieces]
        found = integration.integrate(kernel, theta, tests, settings=SETTINGS)
        parts = []
        for k, (piece, plan) in enumerate(pieces):
            values = float(np.mean(piece.growth_per_strain(plan))) * found.of(k)[..., None]
            parts.append(HistoryPrediction(values, found.status[:, k], found.end_times[:, k]))
        return parts

    def _changed(self, history: History, nuisances: dict[str, float]) -> History:
        """A history as its nuisances {kind: value} say."""
        lengths = dict(history.geometry)
        for kind, value in nuisances.items():
            length = dimension_named(self.specimen, kind)
            if length is not None:
                lengths[length.name] = value
        changed = warmer_and_stiffer(history, nuisances.get("temperature", 0.0), nuisances.get("modulus", 0.0))
        return changed.replace(geometry=lengths)


def _point_test(piece: Any, plan: History) -> PointTest:
    """A material point under the reference stress of each value of the load; zero where there is no load."""
    program = plan.loading.program()
    loads, which = np.unique(program.values, return_inverse=True)
    stresses = np.array([_held_stress(piece, plan, float(load)) if load > 0.0 else 0.0 for load in loads])
    return PointTest(Program(program.times, stresses[which]), plan.temperature_program(), plan.times)


def _held_stress(piece: Any, plan: History, load: float) -> float:
    """The reference stress, MPa, while a load is held; the geometric mean where several are stated."""
    held = plan.replace(loading=constant_load(plan.loading.quantity, load))
    stresses = np.atleast_1d(np.asarray(piece.reference_stress(held), float))
    return float(np.exp(np.log(stresses[stresses > 0.0]).mean())) if (stresses > 0.0).any() else 0.0


def _joined(parts: Sequence[HistoryPrediction]) -> HistoryPrediction:
    """Candidates one after the other, of one test."""
    return HistoryPrediction(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.status for part in parts]),
        np.concatenate([part.end_times for part in parts]),
    )
