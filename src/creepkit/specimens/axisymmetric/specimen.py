"""Axisymmetric: a specimen in finite elements of which its author states the section, the load and what is observed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.records import History, NuisanceValues, Prediction
from creepkit.specimens.axisymmetric.settings import AxisymmetricSettings

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.axisymmetric.run import AxisymmetricRun


@checked
@dataclass(frozen=True, kw_only=True)
class Axisymmetric(AxisymmetricSettings):
    """A body of revolution in creep at finite strain, simulated by finite elements.

    A subclass is a frozen dataclass whose lengths are fields made by `ck.dimension`. It states `name`, `title`,
    `outputs` and `loads`, and writes two methods: `section`, the mesh of its half section with what holds it and what
    the load does to it, and `observe`, the outputs from displacements of named points. Candidates and tests in threads,
    lengths, elastic data, temperature and load programs, the end of a test with its reason, nuisance parameters and
    exact derivatives to the law's parameters and to all of these come with it.

    tolerance : estimated error of a step, over the largest observed displacement plus `resolution` mm.
    refinement : what `self.elements(count)` multiplies numbers of elements by.
    resolution : mm, below which the size of a displacement does not matter.
    deflection_limit : mm, observed displacement at which the test ends. strain_limit : creep strain at which a point
        has ruptured. max_steps : cap on the steps of one simulation, so on its cost.
    threads : simulations that run at the same time; None for one on each core.
    """

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
        from creepkit.specimens.axisymmetric.finite_elements import predict_axisymmetric

        return predict_axisymmetric(self, law, theta, histories, nuisances or {}, sensitivities)

    def model_text(self, histories: Sequence[History]) -> str:
        """How the body is simulated, in sentences for a paper."""
        from creepkit.specimens.axisymmetric.finite_elements import prepared_section, solver_settings
        from creepkit.specimens.finite_element_tests import finite_element_text

        load = histories[0].loading.quantity if histories else self.loads[0].name
        return finite_element_text(prepared_section(self, load).model, solver_settings(self))

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> AxisymmetricRun:
        """Run one test, keeping displacements, stresses and strains of the whole body; see AxisymmetricRun."""
        from creepkit.specimens.axisymmetric.run import run_axisymmetric

        return run_axisymmetric(self, law, values, plan)
