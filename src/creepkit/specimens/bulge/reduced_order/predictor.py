"""The reduced-order model of the bulge test as a predictor: some hundred times cheaper than the finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.records import History, NuisanceValues, Prediction, Status
from creepkit.specimens.bulge.observation import OBSERVED
from creepkit.specimens.bulge.reduced_order.step_equations import AMPLITUDE_COLUMN
from creepkit.specimens.bulge.reduced_order.time_integration import NUISANCE_DIRECTIONS
from creepkit.specimens.bulge.reduced_order.trajectories import Trajectories, simulate_trajectories

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge.specimen import Bulge


_SEEN = slice(AMPLITUDE_COLUMN, AMPLITUDE_COLUMN + len(OBSERVED))


@dataclass(frozen=True)
class BulgeReducedOrderModel:
    """A bulge specimen with one degree of freedom; same outputs, nuisances and complaints.

    Its tables come from some runs of `specimen` at the first prediction (some seconds of CPU for each dimple). Law
    states are integrated beside the strain. Derivatives are exact, but for the window, of which there are none.
    """

    specimen: Bulge
    name: str = field(default="bulge, one degree of freedom", init=False)
    title: str = field(default="Bulge test with one degree of freedom, for screening", init=False)
    outputs: tuple[str, ...] = field(default=OBSERVED, init=False)

    nuisances: ClassVar[tuple[str, ...]] = ("thickness", "modulus", "temperature", "window")

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict amplitude, width and shape of each history at its times; see records.Predictor."""
        assumed_nuisances = dict(nuisances or {})
        for kind in assumed_nuisances:
            if kind not in self.nuisances:
                known = ", ".join(self.nuisances)
                raise SolveError(f"a bulge specimen does not know the nuisance '{kind}'; it knows {known}")
        compiled = kernels.lower(law, "numba")
        rows = max([len(theta), *(len(v) for v in assumed_nuisances.values())])
        theta = np.broadcast_to(theta, (rows, theta.shape[1]))
        trajectories = simulate_trajectories(
            self.specimen, compiled, theta, histories, nuisances=assumed_nuisances, exact=sensitivities
        )
        return _prediction(histories, trajectories, theta.shape[1], assumed_nuisances)

    def reference_stress(self, history: History) -> Floats:
        """As the specimen's."""
        return self.specimen.reference_stress(history)


def _prediction(
    histories: Sequence[History], trajectories: Trajectories, parameters: int, nuisances: NuisanceValues
) -> Prediction:
    """What was observed at the times of the histories, NaN after the end of a row."""
    lengths = np.array([h.times.size for h in histories], dtype=np.int64)
    values = _at_frames(histories, trajectories, trajectories.values)
    if trajectories.jacobian is None:
        jacobian, nuisance_jacobian = None, {}
    else:
        changes = _at_frames(histories, trajectories, trajectories.jacobian)
        jacobian = changes[..., :parameters]
        nuisance_jacobian = {
            kind: changes[..., parameters + NUISANCE_DIRECTIONS.index(kind)]
            for kind in nuisances
            if kind in NUISANCE_DIRECTIONS
        }
    return Prediction(
        values, OBSERVED, lengths, trajectories.status, trajectories.end_times, jacobian, tuple(h.times for h in histories),
        nuisance_jacobian,
    )  # fmt: skip


def _at_frames(histories: Sequence[History], trajectories: Trajectories, values: Floats) -> Floats:
    """Outputs at the times of the histories, (candidates, tests, times, outputs, ...)."""
    longest = max(h.times.size for h in histories)
    out = np.full((*values.shape[:2], longest, len(OBSERVED), *values.shape[4:]), np.nan)
    for k, history in enumerate(histories):
        outputs = trajectories.frames(k, values[:, k, :, _SEEN])
        ended = trajectories.status[:, k] != Status.COMPLETE
        outputs[ended[:, None] & (history.times >= trajectories.end_times[:, k, None])] = np.nan
        out[:, k, : history.times.size] = outputs
    return out
