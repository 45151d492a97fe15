"""Where an identification begins instead of with a global search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from creepkit.arrays import Floats
from creepkit.inverse.identification import Identification
from creepkit.inverse.nuisance_parameters import NuisanceEstimate
from creepkit.inverse.reference_conditions import ReferencePoint


@dataclass(frozen=True, eq=False)
class StartingEstimate:
    """Where an identification begins instead of with a global search; it takes two rounds at most.

    u : (parameters,) conditioned coordinates about `reference`, None for a global search in these coordinates.
    nuisances : explicit nuisances as they were estimated before.
    """

    u: Floats | None
    nuisances: Sequence[NuisanceEstimate] = ()
    reference: ReferencePoint | None = None

    @classmethod
    def from_identification(cls, fit: Identification) -> StartingEstimate:
        """The estimates of another identification of the same law."""
        return cls(fit.u, fit.nuisances, fit.reference)
