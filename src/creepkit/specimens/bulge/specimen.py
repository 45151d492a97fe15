"""The bulge test: gas pressure on the cavity of a dimple, observed by cameras that watch its flat top.

The dimple is simulated by finite elements (see `fem`). Outputs are amplitude, width and shape of the generalised
Gaussian fitted to the displacement of the top, or this displacement on rings (see `observation`). Time starts with the
first pressure ramp; creep acts during ramps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from creepkit.arrays import Floats
from creepkit.hookspecs import hookimpl
from creepkit.records import PROGRAM_NUISANCES, History, NuisanceValues, Output, Prediction, Predictor, Specimen
from creepkit.specimens.bulge.outputs import OBSERVED, RING_OUTPUTS
from creepkit.specimens.bulge.settings import BulgeSettings

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge.run import BulgeRun


@dataclass(frozen=True)
class Bulge(BulgeSettings):
    """A dimple under gas pressure, simulated by finite elements; its fields are those of BulgeSettings."""

    name: str = field(default="bulge", init=False)
    title: str = field(default="Bulge test of a dimple under gas pressure, by finite elements", init=False)
    outputs: tuple[Output, ...] = field(default=OBSERVED, init=False)

    optional_outputs: ClassVar[tuple[Output, ...]] = (*OBSERVED, *RING_OUTPUTS)
    """Those that a test has whose operator says so."""

    draws_section: ClassVar[bool] = True
    """Whether its runs can draw their section."""

    program_nuisances: ClassVar[tuple[str, ...]] = PROGRAM_NUISANCES
    """Kinds of nuisances of a history's programs that predict() differentiates itself."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "outputs", self.observation.outputs)

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict what is observed of each history at its times; see records.Predictor.

        theta : (candidates, parameters) internal values.
        """
        from creepkit.specimens.bulge.finite_elements import predict_bulge

        return predict_bulge(self, law, theta, histories, nuisances or {}, sensitivities)

    def model_text(self, histories: Sequence[History]) -> str:
        """How the dimple is simulated, in sentences for a paper."""
        from creepkit.specimens.bulge.finite_elements import solver_settings
        from creepkit.specimens.bulge.setup import model_of_specimen
        from creepkit.specimens.finite_element_tests import finite_element_text

        text = finite_element_text(model_of_specimen(self), solver_settings(self))
        return f"{text} {self.boundary_text}"

    def run(self, law: CreepLaw, values: Mapping[str, float], plan: History) -> BulgeRun:
        """Run one test, keeping displacements, stresses and strains of the whole dimple; see BulgeRun."""
        from creepkit.specimens.bulge.run import run_bulge

        return run_bulge(self, law, values, plan)

    def reduced_order_model(self) -> Predictor:
        """The same finite elements in few modes and points, for global searches."""
        from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel

        return BulgeReducedOrderModel(self)

    def refined(self) -> Bulge:
        """The same on a mesh of half the element size, in steps of a tenth of the tolerance.

        Its error is a tenth of this one's in the median (docs/measured/dimple_accuracy.md says how large that is).
        """
        refinement = self.refinement if self.mesh is not None else 2.0 * self.refinement
        return self.replace(refinement=refinement, tolerance=max(0.1 * self.tolerance, 1e-6))


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The paper's dimple."""
    return [Bulge()]
