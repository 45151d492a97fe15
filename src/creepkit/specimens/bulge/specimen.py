"""The bulge test: gas pressure on the cavity of a dimple, observed by cameras that watch its flat top.

The dimple is simulated by finite elements (see `fem`). Outputs are amplitude, width and shape of the generalised
Gaussian fitted to the displacement of the top, or this displacement on rings (see `observation`). Time starts with the
first pressure ramp; creep acts during ramps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from creepkit.hookspecs import hookimpl
from creepkit.records import History, Predictor, Specimen
from creepkit.specimens.bulge.settings import BulgeSettings
from creepkit.specimens.finite_element_specimen import FiniteElementSpecimen

if TYPE_CHECKING:
    from creepkit.specimens.bulge.finite_elements import BulgeTest
    from creepkit.specimens.bulge.run import BulgeRun


@dataclass(frozen=True)
class Bulge(BulgeSettings, FiniteElementSpecimen):
    """A dimple under gas pressure, simulated by finite elements; its fields are those of BulgeSettings."""

    draws_section: ClassVar[bool] = True
    """Whether its runs can draw their section."""

    @property
    def test_kind(self) -> type[BulgeTest]:
        """See BulgeTest."""
        from creepkit.specimens.bulge.finite_elements import BulgeTest

        return BulgeTest

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


@hookimpl
def creepkit_specimens() -> list[Specimen]:
    """The paper's dimple."""
    return [Bulge()]
