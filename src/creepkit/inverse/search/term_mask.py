"""Term masks: a rate coefficient in {0} U [bounds]; and the local refinement of the candidates of a search.

A term that is masked has its rate at the lower bound, 1e-5 of the measured rate, where it has no effect. Parameters
that only this term uses stay in the middle of their bounds, so that no bound penalty acts on them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit import limits
from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import FitError, nearest
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.global_search import SearchResult, SearchTrace
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum
from creepkit.language import CreepLaw

ANY_TERM = "any"
"""In place of names: every term may be switched off."""


EXPECTED_FLIPS = 0.5
"""Mask elements that mutate in each draw of a candidate, on average: enough to leave a wrong subset, not to drift."""


OFF_MARGIN = 0.5
"""In ln of a rate: a rate nearer to its lower bound than this counts as at it."""


@dataclass(frozen=True)
class TermMask:
    """The terms that may be off, and what that means for u. Masks are (..., terms), true where a term is on.

    terms : names of those that may; rate_positions : (terms,) positions of their rates; owned_parameters : (terms,
    parameters) coordinates without effect while a term is off; resting_values : (parameters,) their values then;
    has_permanent_term : whether some term is always on.
    """

    terms: tuple[str, ...]
    rate_positions: Ints
    owned_parameters: Bools
    resting_values: Floats
    has_permanent_term: bool

    @classmethod
    def from_problem(cls, problem: LeastSquaresProblem, maskable: str | Sequence[str]) -> TermMask:
        """The mask of a problem; maskable : names of terms, or "any"."""
        law, rates = problem.law, problem.coordinates.term_rates
        positions = {label: [law.names.index(n) for n in law.only(label).names] for label in law.terms}
        rate_positions = {label: [k for k in owned if k in rates] for label, owned in positions.items()}
        terms = _maskable_terms(law, rate_positions, maskable)
        owned_parameters = np.zeros((len(terms), problem.bounds.lower.size), bool)
        for row, label in zip(owned_parameters, terms, strict=True):
            shared = {k for other, other_positions in positions.items() if other != label for k in other_positions}
            row[[k for k in positions[label] if k not in shared]] = True
        resting = problem.bounds.centre
        resting[list(rates)] = problem.bounds.lower[list(rates)]
        first_rates = np.array([rate_positions[label][0] for label in terms], np.int64)
        return cls(terms, first_rates, owned_parameters, resting, len(terms) < len(law.terms))

    def applied(self, u: Floats, masks: Bools) -> Floats:
        """u (..., parameters) with coordinates of terms that are off at their resting values; masks : (..., terms)."""
        return np.where(self.active_parameters(masks), u, self.resting_values)

    def active_parameters(self, masks: Bools) -> Bools:
        """(..., parameters) which coordinates have an effect; masks : (..., terms)."""
        return np.asarray(~(~masks[..., None] & self.owned_parameters).any(axis=-2))

    def fixed_values(self, mask: Bools) -> dict[int, float]:
        """{position: value} of the coordinates at rest, of one mask (terms,)."""
        return {int(k): float(self.resting_values[k]) for k in np.flatnonzero(~self.active_parameters(mask))}

    def terms_off(self, u: Floats) -> tuple[str, ...]:
        """The terms that are off at u (parameters,): switched off, or at the lower bound of their rate."""
        is_at_lower_bound = u[self.rate_positions] <= self.resting_values[self.rate_positions] + OFF_MARGIN
        return tuple(term for term, is_off in zip(self.terms, is_at_lower_bound, strict=True) if is_off)

    def initial_masks(self, count: int, rng: np.random.Generator) -> Bools:
        """(count, terms) masks to begin from: all on in the first, every subset as likely as another in the rest."""
        masks = rng.random((count, len(self.terms))) < 0.5
        masks[:1] = True
        return self._never_empty(masks, rng)

    def recombined(self, personal_best: Bools, global_best: Bools, rng: np.random.Generator) -> Bools:
        """(candidates, terms) masks of the next draw: each element at random from one of two, with mutations.

        personal_best : (candidates, terms) each candidate's own best mask. global_best : (terms,) the best of all.
        """
        if not self.terms:
            return personal_best
        inherited = np.where(rng.random(personal_best.shape) < 0.5, personal_best, global_best)
        flipped = rng.random(personal_best.shape) < EXPECTED_FLIPS / len(self.terms)
        return self._never_empty(inherited ^ flipped, rng)

    def _never_empty(self, masks: Bools, rng: np.random.Generator) -> Bools:
        """A mask without any term gets one, at random: a law has at least one term."""
        empty = np.flatnonzero(~masks.any(axis=1)) if self.terms and not self.has_permanent_term else np.zeros(0, int)
        masks[empty, rng.integers(max(len(self.terms), 1), size=empty.size)] = True
        return masks


def _maskable_terms(
    law: CreepLaw, rate_positions: dict[str, list[int]], maskable: str | Sequence[str]
) -> tuple[str, ...]:
    """The names of maskable terms, checked."""
    if maskable == ANY_TERM:
        return (
            tuple(label for label, positions in rate_positions.items() if positions) if len(rate_positions) > 1 else ()
        )
    names = (maskable,) if isinstance(maskable, str) else tuple(maskable)
    for name in names:
        if name not in rate_positions:
            raise FitError(f"law '{law.name}' has no term '{name}' to switch off; {nearest(name, rate_positions)}")
        if len(rate_positions) == 1:
            raise FitError(f"law '{law.name}' has one term, '{name}', which cannot be switched off")
        if not rate_positions[name]:
            raise FitError(f"term '{name}' of law '{law.name}' has no coefficient of its own that could be zero")
    return tuple(dict.fromkeys(names))


SAME_BASIN = 0.1
"""Of the width of the bounds: candidates closer than that in every coordinate lead to the same minimum, as a rule."""


CONVERGED_DECREASE = 1e-3
"""A decrease of the cost, half of chi-square, below which a search has converged."""


@dataclass(frozen=True)
class SearchCandidates:
    """Candidates of a search that may be refined.

    u : (candidates, parameters); cost : (candidates,) -; masks : (candidates, terms) of the terms of `term_mask`.
    """

    u: Floats
    cost: Floats
    term_mask: TermMask | None = None
    masks: Bools | None = None

    def fixed_values(self, k: int) -> dict[int, float]:
        """{position: value} of coordinates that rest in candidate k, because their term is off."""
        return {} if self.term_mask is None or self.masks is None else self.term_mask.fixed_values(self.masks[k])

    def terms_off(self, u: Floats) -> tuple[str, ...]:
        """Terms that are off at u."""
        return () if self.term_mask is None else self.term_mask.terms_off(u)

    def most_different(self, width: Floats, max_count: int) -> list[int]:
        """The best that differ, at most max_count: a term that is off in one of two makes them differ.

        width : (parameters,) of the bounds.
        """
        selected: list[int] = []
        for k in np.argsort(self.cost, kind="stable"):
            if all((np.abs(self.u[k] - self.u[other]) > SAME_BASIN * width).any() for other in selected):
                selected.append(int(k))
            if len(selected) == max_count:
                break
        return selected


def refine_candidates(
    problem: LeastSquaresProblem,
    candidates: SearchCandidates,
    max_count: int,
    trace: SearchTrace,
    progress: IterationCallback | None = None,
) -> SearchResult:
    """The best different candidates refined, best first; with max_count=0 the best one as it is."""
    selected = candidates.most_different(problem.bounds.width, max(max_count, 1))
    problem.check_predicted(candidates.u[selected])
    if max_count == 0:
        k = selected[0]
        best, cost = candidates.u[k], float(candidates.cost[k])
        return SearchResult(
            (Minimum(best, cost, converged=False, evaluations=0, terms_off=candidates.terms_off(best)),), trace
        )
    minima = []
    for done, k in enumerate(selected):
        minimum = problem.minimise(candidates.u[k], fixed=candidates.fixed_values(k))
        minima.append(replace(minimum, terms_off=candidates.terms_off(minimum.x)))
        if progress is not None:
            progress("refinement", done + 1, len(selected))
    evaluations = sum(minimum.evaluations for minimum in minima)
    minima.sort(key=lambda minimum: minimum.cost)
    if candidates.masks is not None:
        minima = _one_per_mask(minima)
    return SearchResult(
        tuple(minima), replace(trace, refined_cost=min(m.cost for m in minima), refinement_evaluations=evaluations)
    )


def _one_per_mask(minima: list[Minimum]) -> list[Minimum]:
    """One minimum of each subset; of those that are as good as the best, the simplest first."""
    different = [m for k, m in enumerate(minima) if m.terms_off not in [other.terms_off for other in minima[:k]]]
    best = different[0].cost + CONVERGED_DECREASE
    return sorted(different, key=lambda m: (m.cost > best, -len(m.terms_off) if m.cost <= best else 0, m.cost))


def check_whole_numbers(search: str, values: Mapping[str, float], minimum_values: Mapping[str, int]) -> None:
    """Refuse settings of a search that must be whole numbers of at least so many, and of SEARCH_STEPS at most."""
    for name, value in values.items():
        allowed = limits.Limits(minimum_values[name], limits.SEARCH_STEPS.high)
        limits.check_number(f"{search}: {name}", value, allowed, FitError)
