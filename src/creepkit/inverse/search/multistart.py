"""Where an identification begins: with multi-start least squares, or with an estimate that was made before.

Of many Sobol draws the best, and the centre of the bounds, are refined. For a sum of terms the
optimum of each term alone is a start too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.bounds import LOG_RATE_BOUNDS, Bounds
from creepkit.inverse.identification import Identification
from creepkit.inverse.nuisance_parameters import NuisanceEstimate
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.residuals import median_log_rate_excess, median_log_rupture_excess
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum, Tolerances
from creepkit.records import Predictor

INTERNAL_RATE_RANGE = (-4.0, 0.0)
"""Range of draws for an internal variable: ln of its rate times the duration of a test."""


VANISHING_POWER = 3
"""Of the uniform draws of a parameter that is off at its lower bound, zero, such as a threshold stress: its scale is
that of the tests, which may be a hundredth of its bounds, and above all tests it leaves nothing to compare."""


FIRST_DRAWS = 2
"""Of a law of few shapes, the better of which is refined beside the centre before any others are drawn: where both lead
to one minimum, that was the least one (within 0.3 % of its cost) in 79 of 80 searches of planted dimples."""


def multistart_minima(problem: LeastSquaresProblem, progress: IterationCallback | None = None) -> list[Minimum]:
    """The minima of all starts, best first, of a problem whose unknowns are the conditioned coordinates u alone."""
    settings, shapes = problem.settings, problem.bounds.lower.size - len(problem.coordinates.term_rates)
    share = {0: 8, 1: 8, 2: 4}.get(shapes, 1)  # rates are not drawn: they are shifted to those of the data
    starts, draws = min(settings.starts, max(2 * settings.starts // share, 2)), max(settings.sobol_points // share, 1)
    if progress is not None:
        progress("screening of draws", 0, draws)
    of_terms = single_term_starts(problem, starts=max(2, starts // 3), draws=draws // 2)
    if share > 1 and not (of_terms or _vanishing(problem).any()):
        ends = refined(problem, screened_starts(problem, starts=2, draws=FIRST_DRAWS), progress)
        if ends[0] is ends[1]:
            return ends
    points = [*of_terms, *screened_starts(problem, starts=starts, draws=draws)]
    return refined(problem, points, progress)


def single_term_starts(problem: LeastSquaresProblem, *, starts: int, draws: int) -> list[Floats]:
    """For a sum of terms, one start (parameters,) for each: its optimum, the others at a 20th of its rate; best first.

    A sum is never worse than its terms, but a search of the whole bounds rarely finds that.
    """
    law, bounds = problem.law, problem.bounds
    starts_by_cost: list[tuple[float, Floats]] = []
    if len(law.terms) < 2:
        return []
    rates = problem.coordinates.term_rates
    for label in law.terms:
        single_law = law.only(label)
        if not single_law.params:
            continue
        single = problem.with_law(single_law)
        positions = [law.names.index(name) for name in single_law.names]
        minimum = refined(single, screened_starts(single, starts=starts, draws=draws))[0]
        problem.evaluations.count += single.evaluations.count
        u = bounds.centre
        u[positions] = minimum.x
        log_rates = [u[k] for k in rates if k in positions] or [bounds.centre[k] for k in rates]
        for k in rates:
            u[k] = u[k] if k in positions else max(log_rates) - np.log(20.0)
        starts_by_cost.append((minimum.cost, bounds.clip(u)))
    return [u for _, u in sorted(starts_by_cost, key=lambda pair: pair[0])]


def screened_starts(problem: LeastSquaresProblem, *, starts: int, draws: int) -> list[Floats]:
    """The centre, and the best draws after a shift of all rates to that of the data: (parameters,) each.

    Once shifted they can be compared. The last shift is not simulated, as the first step of a refinement does that; but
    a law with internal variables needs several of all draws, and a comparison where these end.
    """
    observations, bounds, seed = problem.observations, problem.bounds, problem.settings.seed
    sobol = qmc.Sobol(bounds.lower.size, seed=seed).random(draws)
    sobol[:, _vanishing(problem)] **= VANISHING_POWER
    points = np.concatenate([bounds.centre[None], bounds.lower + sobol * bounds.width])
    points = _with_sampled_exponents(problem, points, np.concatenate([np.full((1, bounds.lower.size), 0.5), sobol]))
    rates, internal_rates = list(problem.coordinates.term_rates), list(problem.coordinates.state_rates)
    if rates:
        middle = bounds.centre - 0.5 * sum(LOG_RATE_BOUNDS)
        fractions = np.random.default_rng(seed).dirichlet(np.full(len(rates), 0.7), size=len(points))
        fractions[0] = 0.5 ** np.arange(len(rates))  # equal ones are a stationary point from which no search escapes
        points[:, rates] = middle[rates[0]] + np.log(np.maximum(fractions, 1e-4))
        positions = np.concatenate([np.full((1, len(internal_rates)), 0.5), sobol[:, internal_rates]])
        points[:, internal_rates] = middle[internal_rates] + np.interp(positions, (0, 1), INTERNAL_RATE_RANGE)
    points, shifts = bounds.clip(points), (5 if internal_rates else 1) if rates else 0
    for shift in range(shifts + 1):
        residuals = problem.candidate_residuals(points)
        if shift == shifts:
            score = (np.arcsinh(residuals[:, observations.present]) ** 2).mean(axis=1)
            kept = [0, *(1 + np.argsort(score[1:], kind="stable"))[: max(starts - 1, 0)]]
            points, residuals, score = points[kept], residuals[kept], score[kept]
        if rates and not (internal_rates and shift == shifts):
            points[:, rates] -= np.clip(median_log_rate_excess(observations, residuals), -6, 6)[:, None]
            points[:, internal_rates] -= np.clip(median_log_rupture_excess(observations, residuals), -6, 6)[:, None]
            points = bounds.clip(points)
    if not np.isfinite(score).any():  # from where nothing is predicted, no direction leads away
        problem.check_predicted(points)
        raise FitError(f"law '{problem.law.name}': no point within its bounds can be simulated; widen the bounds")
    return [*points]


def _vanishing(problem: LeastSquaresProblem) -> Bools:
    """(parameters,) whether a parameter is off at its lower bound, zero, where the law is another one's minimum."""
    return np.array([one.off == one.bounds[0] == 0.0 for one in problem.law.params.values()], bool)


def _with_sampled_exponents(problem: LeastSquaresProblem, points: Floats, sobol: Floats) -> Floats:
    """Local exponents of parameters that are drawn within their bounds, and not beyond them."""
    coordinates, law = problem.coordinates, problem.law
    if not coordinates.exponents:
        return points
    sampled = points.copy()
    for local_exponent in coordinates.exponents:
        param = law.table[law.names[local_exponent.position]]
        lower, upper = (param.to_internal(b) for b in param.bounds)
        sampled[:, local_exponent.position] = lower + sobol[:, local_exponent.position] * (upper - lower)
    conditioned = coordinates.u(sampled)
    for local_exponent in coordinates.exponents:
        points[:, local_exponent.position] = conditioned[:, local_exponent.position]
    return problem.bounds.clip(points)


# ---- refinement ------------------------------------------------------------------------------------------------------

SAME_BASIN = 0.1
"""Of the width of the bounds: candidates closer than that in every coordinate lead to the same minimum, as a rule."""


FIRST_STEPS, LAST_STEPS = Tolerances(max_steps=3, gain=1e-3), Tolerances(tolerance=1e-4, gain=1e-3)
"""Of every start of least squares, and then of the best of them one after the other."""


CONTINUED, CONFIRMED = 3, 2
"""How many of the best are refined to the end at most, and how many of them that end at the best are enough."""


SAME_POINT, SAME_COST = 0.02, 0.01
"""Of the width of the bounds: starts that come closer than that in every coordinate lead to the same minimum. Of the
cost of a minimum: so do those in its basin whose next step promises a cost as near."""


def refined(
    problem: LeastSquaresProblem, starts: Sequence[Floats], progress: IterationCallback | None = None
) -> list[Minimum]:
    """The ends that starts (parameters,) of least squares lead to, best first; far worse ones after few steps.

    A law with internal variables, whose valleys are long and curved, takes each of the best to its end.
    """
    ends, curved = [], bool(problem.coordinates.state_rates)
    if progress is not None:
        progress("start", 0, len(starts))
    for k, u in enumerate(starts):
        ends.append(problem.minimise(u, tolerances=FIRST_STEPS))
        if progress is not None:
            progress("start", k + 1, len(starts))
    ends.sort(key=lambda end: end.cost)
    for k, end in enumerate(ends[:CONTINUED]):
        ends[k] = _continued(problem, end, ends[:k]) if end.converged or not curved else problem.minimise(end.x)
        best = min(ends, key=lambda one: one.cost)
        if k and not curved and sum(other is best for other in ends[: k + 1]) >= CONFIRMED:
            break
    return sorted(ends, key=lambda end: end.cost)


def _continued(problem: LeastSquaresProblem, end: Minimum, others: Sequence[Minimum]) -> Minimum:
    """The minimum that a search leads to, a few steps at a time; that of another one where it comes to lie there."""
    steps, near = replace(LAST_STEPS, max_steps=FIRST_STEPS.max_steps + 1), list[Minimum]()
    for _ in range(LAST_STEPS.max_steps // FIRST_STEPS.max_steps):
        near, before = [one for one in others if _leads_to(end, one, problem.bounds.width)], end.x
        end = near[0] if near else end if end.converged else problem.minimise(end.x, tolerances=steps)
        if np.array_equal(end.x, before) or near:  # or no step of those that are tried gains anything
            break
    return end


def _leads_to(end: Minimum, other: Minimum, width: Floats) -> bool:
    """Whether a search leads to another minimum: it is there, or in its basin and promised its cost."""
    apart = (np.abs(end.x - other.x) / width).max()
    return bool(
        apart <= SAME_POINT or (apart <= SAME_BASIN and abs(end.promised - other.cost) <= SAME_COST * other.cost)
    )


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
"""Misfit that is assumed in a search, over that spread (see WorkingNoiseEstimator.initial)."""


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
