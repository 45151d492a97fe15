"""The reduced-order model of the bulge test as a predictor: some hundred times cheaper than the finite elements."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.records import (
    History,
    HistoryPrediction,
    NuisanceValues,
    Prediction,
    Predictor,
    Status,
    SupportsRefinement,
    assemble_prediction,
    broadcast_candidates,
    check_nuisances,
)
from creepkit.specimens.bulge.observation import OBSERVED
from creepkit.specimens.bulge.reduced_order.step_equations import AMPLITUDE_COLUMN
from creepkit.specimens.bulge.reduced_order.step_solution import NUISANCE_DIRECTIONS
from creepkit.specimens.bulge.reduced_order.trajectories import Trajectories, TrajectoryOptions, simulate_trajectories
from creepkit.specimens.bulge.settings import BulgeSettings

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


_OBSERVED_COLUMNS = slice(AMPLITUDE_COLUMN, AMPLITUDE_COLUMN + len(OBSERVED))


@dataclass(frozen=True)
class OneDegreeOfFreedomModel:
    """A bulge specimen with one degree of freedom; same outputs, nuisances and errors.

    Its tables come from some runs of `specimen` at the first prediction (some seconds of CPU for each dimple). Law
    states are integrated beside the strain. Derivatives are exact, but for the window, of which there are none.
    """

    specimen: BulgeSettings
    name: str = field(default="bulge, one degree of freedom", init=False)
    title: str = field(default="Bulge test with one degree of freedom, for screening", init=False)
    outputs: tuple[str, ...] = field(default=OBSERVED, init=False)

    nuisances: ClassVar[tuple[str, ...]] = BulgeSettings.nuisances

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict amplitude, width and shape of each history at its times; see records.Predictor.

        theta : (candidates, parameters) internal values.
        """
        check_nuisances(nuisances or (), self.nuisances, "a bulge specimen")
        compiled = kernels.lower(law, "numba")
        theta, _ = broadcast_candidates(theta, nuisances, len(histories))
        trajectories = simulate_trajectories(
            self.specimen,
            compiled,
            theta,
            histories,
            nuisances=nuisances,
            options=TrajectoryOptions(exact=sensitivities),
        )
        parts = [_history_prediction(history, k, trajectories, nuisances or ()) for k, history in enumerate(histories)]
        return assemble_prediction(parts, histories, OBSERVED, len(theta))

    def refined(self) -> Predictor:
        """What it stands for: the specimen by finite elements, on its finer mesh."""
        specimen: Predictor = self.specimen  # type: ignore[assignment]  # a Bulge, whose module imports this one
        return specimen.refined() if isinstance(specimen, SupportsRefinement) else specimen

    def reference_stress(self, history: History) -> Floats:
        """As the specimen's, (levels,) MPa."""
        return self.specimen.reference_stress(history)


def _history_prediction(
    history: History, test: int, trajectories: Trajectories, nuisances: Iterable[str]
) -> HistoryPrediction:
    """What is observed at the times of one history, NaN after the end of a candidate."""
    ended = trajectories.status[:, test] != Status.COMPLETE
    lost = ended[:, None] & (history.times >= trajectories.end_times[:, test, None])

    def at_times(node_values: Floats) -> Floats:
        outputs = trajectories.frames(test, node_values[:, test, :, _OBSERVED_COLUMNS])
        outputs[lost] = np.nan
        return outputs

    values, jacobian, nuisance_jacobian = at_times(trajectories.values), None, {}
    if trajectories.jacobian is not None:
        derivatives, parameters = at_times(trajectories.jacobian), trajectories.parameters
        jacobian = derivatives[..., :parameters]
        nuisance_jacobian = {
            kind: derivatives[..., parameters + NUISANCE_DIRECTIONS.index(kind)]
            for kind in nuisances
            if kind in NUISANCE_DIRECTIONS
        }
    status, end_times = trajectories.status[:, test], trajectories.end_times[:, test]
    return HistoryPrediction(values, status, end_times, jacobian, nuisance_jacobian)
