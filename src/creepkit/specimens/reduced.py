"""The cheap stand-in of a bulge specimen: one degree of freedom, with tables of the very dimple.

A fit asks it where to begin; it is a hundred times cheaper than the finite elements and about two per cent off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.records import Effects, History, Prediction, Status
from creepkit.specimens.observation import OBSERVED
from creepkit.specimens.reduced_courses import Courses, courses
from creepkit.specimens.reduced_march import EFFECTS
from creepkit.specimens.reduced_observed import AMPLITUDE_COLUMN

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge import Bulge

_SEEN = slice(AMPLITUDE_COLUMN, AMPLITUDE_COLUMN + len(OBSERVED))


@dataclass(frozen=True)
class ReducedBulge:
    """A bulge specimen with one degree of freedom; same outputs, effects and complaints.

    Its tables come from some runs of `specimen` at the first prediction (some seconds of CPU for each dimple). Law
    states are integrated beside the strain. Derivatives are exact, but for the window, of which there are none.
    """

    specimen: Bulge
    name: str = field(default="bulge, one degree of freedom", init=False)
    title: str = field(default="Bulge test with one degree of freedom, for screening", init=False)
    outputs: tuple[str, ...] = field(default=OBSERVED, init=False)

    effects: ClassVar[tuple[str, ...]] = ("thickness", "modulus", "temperature", "window")

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        effects: Effects | None = None,
    ) -> Prediction:
        """Predict amplitude, width and shape of each history at its times; see records.Predictor."""
        assumed = dict(effects or {})
        for kind in assumed:
            if kind not in self.effects:
                known = ", ".join(self.effects)
                raise SolveError(f"a bulge specimen does not know the nuisance '{kind}'; it knows {known}")
        compiled = kernels.lower(law, "numba")
        theta = compiled.internal(values)
        rows = max([len(theta), *(len(v) for v in assumed.values())])
        theta = np.broadcast_to(theta, (rows, theta.shape[1]))
        found = courses(self.specimen, compiled, theta, histories, effects=assumed, exact=jacobian)
        return _prediction(histories, found, theta.shape[1], assumed)

    def reference_stress(self, history: History) -> Floats:
        """As the specimen's."""
        return self.specimen.reference_stress(history)


def _prediction(histories: Sequence[History], found: Courses, parameters: int, assumed: Effects) -> Prediction:
    """What was observed at the times of the histories, NaN after the end of a row."""
    lengths = np.array([h.times.size for h in histories], dtype=np.int64)
    values = _framed(histories, found, found.values)
    if found.changes is None:
        jacobian, to_effects = None, {}
    else:
        changes = _framed(histories, found, found.changes)
        jacobian = changes[..., :parameters]
        to_effects = {kind: changes[..., parameters + EFFECTS.index(kind)] for kind in assumed if kind in EFFECTS}
    return Prediction(
        values, OBSERVED, lengths, found.status, found.end_times, jacobian, tuple(h.times for h in histories),
        to_effects,
    )  # fmt: skip


def _framed(histories: Sequence[History], found: Courses, values: Floats) -> Floats:
    """Outputs at the times of the histories, (candidates, tests, times, outputs, ...)."""
    longest = max(h.times.size for h in histories)
    out = np.full((*values.shape[:2], longest, len(OBSERVED), *values.shape[4:]), np.nan)
    for k, history in enumerate(histories):
        seen = found.frames(k, values[:, k, :, _SEEN])
        cut = found.status[:, k] != Status.COMPLETE
        seen[cut[:, None] & (history.times >= found.end_times[:, k, None])] = np.nan
        out[:, k, : history.times.size] = seen
    return out
