"""Where an identification begins: with a global search, or with an estimate that was made before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.bounds import Bounds
from creepkit.inverse.identification import Identification
from creepkit.inverse.nuisance_parameters import NuisanceEstimate
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum
from creepkit.inverse.search.multistart import multistart_minima
from creepkit.records import Predictor


@dataclass(frozen=True, eq=False)
class StartingEstimate:
    """Where an identification begins instead of with a global search; two rounds at most lead from one that is near.

    u : (parameters,) conditioned coordinates about `reference`, None for a global search in these coordinates.
    nuisances : explicit nuisances as they were estimated before. values_only : whether values and intervals are all
    that is asked for: no refit without a test that is off.
    is_near : whether it is an end of the same law by tests that hardly differ.
    """

    u: Floats | None
    nuisances: Sequence[NuisanceEstimate] = ()
    reference: ReferencePoint | None = None
    values_only: bool = False
    is_near: bool = True

    @classmethod
    def from_identification(cls, fit: Identification, *, values_only: bool = False) -> StartingEstimate:
        """The estimates of another identification of the same law."""
        return cls(fit.u, fit.nuisances, fit.reference, values_only)


EQUAL_PREDICTIONS, EQUAL_REDUCED_ORDER_PREDICTIONS = 1e-5, 5e-3
"""Root mean square difference of predictions, over the spread of what was measured, below which two minima are one. A
reduced-order model is not better than the latter, and along a valley one start is enough for its predictor."""


SAME_COORDINATES = 0.02
"""Distance over the width of the bounds, in every coordinate, up to which two minima are one."""


WORKING_ERROR = 0.3
"""Misfit that is assumed in a search, over that spread (see inverse.noise_model.initial_working_noise)."""


MOST_MINIMA, LARGEST_COST = 2, 4.0
"""Starts of an estimate, and their cost over the least: of those that miss the data by more than twice as much none is
the likeliest."""


class SearchOutcome(NamedTuple):
    """The end of a global search: starts of the estimation, and evaluations.

    starts : (parameters,) conditioned coordinates each. minima : how many ends it had, and how many of them differ.
    """

    starts: list[Floats]
    evaluations: int
    minima: Mapping[str, int] = MappingProxyType({})


def initial_search(
    problem: LeastSquaresProblem, through: Predictor | None, progress: IterationCallback | None
) -> SearchOutcome:
    """The best minima that differ, by the reduced-order model of the cheapest predictor."""
    predictor = through or problem.predictor
    reduced_order_model = predictor.reduced_order_model()
    searched = search_problem(problem, (reduced_order_model or predictor).for_search())
    ends = multistart_minima(searched, progress)
    equal = EQUAL_PREDICTIONS if reduced_order_model is None else EQUAL_REDUCED_ORDER_PREDICTIONS
    best, apart = ends[0], list[Minimum]()
    for end in ends:
        apart += [] if any(are_one(end, other, searched.bounds, equal) for other in apart) else [end]
    at_best = sum(are_one(end, best, searched.bounds, equal) for end in ends)
    counts = {"search_ends": len(ends), "distinct_minima": len(apart), "ends_at_best": at_best}
    starts = [end.x for end in apart[:MOST_MINIMA] if end.cost <= LARGEST_COST * best.cost]
    return SearchOutcome(starts, searched.evaluations.count, counts)


def are_one(a: Minimum, b: Minimum, bounds: Bounds, equal_predictions: float = EQUAL_PREDICTIONS) -> bool:
    """Whether two minima are near in every coordinate, or in what they predict."""
    if (np.abs(a.x - b.x) <= SAME_COORDINATES * bounds.width).all():
        return True
    if not (a.whitened_residuals.size and b.whitened_residuals.size):
        return False
    return bool(np.mean((a.whitened_residuals - b.whitened_residuals) ** 2) < (equal_predictions / WORKING_ERROR) ** 2)


def search_problem(problem: LeastSquaresProblem, predictor: Predictor) -> LeastSquaresProblem:
    """What a global search minimises: a broad covariance, and a loss with which no single curve dominates.

    The likelihoods decide between its minima, since the covariance is not yet known. Its unknowns are u alone.
    """
    return replace(problem.with_predictor(predictor).with_fixed_nuisances(), robust=True)
