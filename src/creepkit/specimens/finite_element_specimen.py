"""FiniteElementSpecimen: what a specimen in finite elements does with the tests that it prepares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from creepkit.arrays import Floats
from creepkit.records import History, NuisanceValues, Prediction
from creepkit.specimens.finite_element_settings import FiniteElementSettings

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.finite_element_run import FiniteElementRun
    from creepkit.specimens.finite_element_tests import FiniteElementTest


class FiniteElementSpecimen(FiniteElementSettings):
    """Predictions, runs and their description; a kind of it says what its tests and runs are."""

    @property
    def test_kind(self) -> type[FiniteElementTest]:
        """What prepares, observes and differentiates one test; loaded when a test is predicted."""
        raise NotImplementedError

    @property
    def run_kind(self) -> type[FiniteElementRun]:
        """What a run is."""
        from creepkit.specimens.finite_element_run import FiniteElementRun

        return FiniteElementRun

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict the outputs of each history at its times; see records.Predictor.

        theta : (candidates, parameters) internal values.
        """
        from creepkit.specimens.finite_element_tests import predict_tests

        return predict_tests(self.test_kind, self, law, theta, histories, nuisances or {}, sensitivities)

    def model_text(self, histories: Sequence[History]) -> str:
        """How the body is simulated, in sentences for a paper."""
        from creepkit.specimens.finite_element_tests import finite_element_text

        load = histories[0].loading.quantity if histories else self.loads[0].name
        return finite_element_text(self, self.test_kind.model_of(self, load))

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> FiniteElementRun:
        """Run one test, keeping displacements, stresses and strains of the whole body; see FiniteElementRun."""
        from creepkit.specimens.finite_element_run import run_test

        return run_test(self.run_kind, self.test_kind.of(self, plan, {}), law, values)
