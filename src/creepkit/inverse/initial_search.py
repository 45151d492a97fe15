"""Where an identification begins: with a global search, or with an estimate that was made before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

from creepkit.arrays import Floats
from creepkit.inverse.identification import Identification
from creepkit.inverse.nuisance_parameters import NuisanceEstimate
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.search.global_search import GlobalSearch, SearchTrace
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.search.multistart import (
    EQUAL_PREDICTIONS,
    EQUAL_REDUCED_ORDER_PREDICTIONS,
    distinct,
    minima_counts,
)
from creepkit.records import Predictor


@dataclass(frozen=True, eq=False)
class StartingEstimate:
    """Where an identification begins instead of with a global search; it takes two rounds at most.

    u : (parameters,) conditioned coordinates about `reference`, None for a global search in these coordinates.
    nuisances : explicit nuisances as they were estimated before. values_only : whether values and intervals are all
    that is asked for: no samples of the posterior where a value is at its bound, no refit without a test that is off.
    """

    u: Floats | None
    nuisances: Sequence[NuisanceEstimate] = ()
    reference: ReferencePoint | None = None
    values_only: bool = False

    @classmethod
    def from_identification(cls, fit: Identification, *, values_only: bool = False) -> StartingEstimate:
        """The estimates of another identification of the same law."""
        return cls(fit.u, fit.nuisances, fit.reference, values_only)


LARGEST_COST = 4.0
"""Of a minimum over the least one: of those that miss the data by more than twice as much none is the likeliest."""


class SearchOutcome(NamedTuple):
    """The end of a global search: starts of the estimation, evaluations and trace.

    starts : (parameters,) conditioned coordinates each. minima : how many ends it had, and how many of them differ.
    """

    starts: list[Floats]
    evaluations: int
    trace: SearchTrace | None
    minima: Mapping[str, int] = MappingProxyType({})

    @property
    def search(self) -> str:
        """Its name; "" where it began from a given estimate."""
        return self.trace.search if self.trace is not None else "multi-start" if self.minima else ""


def initial_search(
    problem: LeastSquaresProblem, through: Predictor | None, search: GlobalSearch, progress: IterationCallback | None
) -> SearchOutcome:
    """The best minima that differ, by the reduced-order model of the cheapest predictor."""
    predictor = through or problem.predictor
    reduced_order_model = predictor.reduced_order_model()
    searched = search_problem(problem, (reduced_order_model or predictor).for_search())
    search_result = search.minima(searched, progress)
    equal = EQUAL_PREDICTIONS if reduced_order_model is None else EQUAL_REDUCED_ORDER_PREDICTIONS
    apart = distinct(search_result.minima, searched.bounds, equal_predictions=equal)
    apart = [minimum for minimum in apart if minimum.cost <= LARGEST_COST * apart[0].cost]
    counts = minima_counts(search_result.minima, searched.bounds, equal_predictions=equal)
    return SearchOutcome([minimum.x for minimum in apart], searched.evaluations.count, search_result.trace, counts)


def search_problem(problem: LeastSquaresProblem, predictor: Predictor) -> LeastSquaresProblem:
    """What a global search minimises: a broad covariance, and a loss with which no single curve dominates.

    The likelihoods decide between its minima, since the covariance is not yet known. Its unknowns are u alone.
    """
    return replace(problem.with_predictor(predictor).with_fixed_nuisances(), robust=True)
