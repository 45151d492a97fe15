"""Term selection: which terms of a sum the tests need, by evidence for its subsets or the L2 norm of contributions.

"subsets" fits the sets of terms and keeps the one of most evidence (see inverse.evidence), where before the tests the
odds are 19 to 1 against each further term, and against an exponent that can be off. "l2" is the sparsity of the paper:
L2_STRENGTH times the sum of c_i^2 is added to half the chi-square, with c_i the contribution of term i; terms that
contribute less than LEAST_CONTRIBUTION at the minimum are dropped, and come back, the largest first, until there is no
less evidence, with these odds, than for the sum. As contributions add up to about one, their squares are least at equal
shares: it makes the values of a sum determinate, and draws a term that the data leave free to the size of the others.

All laws are compared under the covariance of the whole sum, so that chi-squares can be subtracted.

How much a term matters is its contribution over the stresses, strains and times of the tests,

    c_i = [ mean_G (f_i / sum_j f_j)^2 ]^(1/2)

with f_i the rate of term i and G the evaluation points: 0.5, 0.8, 1 and 1.3 times the reference stress at each time of
each test, which is about the range of stress in a specimen. Strain is estimated from the measured outputs. A
coefficient A_i alone does not show this: its unit depends on the exponents, and its size on all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Literal

import numpy as np
from scipy.special import softmax

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import through_for_law
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.evidence import DECISIVE_EXCESS, occam_penalty
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.observation_vector import selected_frames
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import (
    growth_per_strain,
    reference_end_strain,
    reference_stresses,
    usable_frames,
)
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum, System, Tolerances
from creepkit.inverse.search.multistart import StartingEstimate
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.result import FitStatistics, Sparsity, TermNames
from creepkit.kernels import lower, tension_point
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor, growing_output, is_logarithmic, output_named

EXHAUSTIVE_LIMIT = 4
"""Terms up to which every set of them is fitted; of longer sums forward selection adds one after the other."""


TOLERANCES = Tolerances(max_steps=40, tolerance=1e-7, gain=1e-6)
"""Of the fits of reduced laws."""


INITIAL_FRACTION = 0.05
"""Share of the rate with which a further term begins beside fitted ones."""


L2_STRENGTH = 24.0
"""Of the L2 norm: half the 48 frames of a bulge test of 12 h; a norm larger by one costs a chi-square of 48."""


LEAST_CONTRIBUTION = 0.05
"""A term that contributes less is dropped."""


def identify_sparse(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    *,
    penalty: Literal["l2", "subsets"] = "subsets",
    through: Predictor | None = None,
    settings: IdentificationSettings | None = None,
    progress: IterationCallback | None = None,
) -> Identification:
    """Identify the law of those terms of a sum that the histories need; what was dropped is recorded in `sparsity`.

    through : a surrogate by which terms are chosen; values and intervals are those of `using`.
    """
    if len(law.terms) < 2:
        raise FitError(
            f"law '{law.name}' has one term, '{next(iter(law.terms))}', and a penalty chooses among terms: "
            "identify it without penalty, or a sum of laws with it"
        )
    how = {"settings": settings, "progress": progress}
    full = identify(law, histories, using, through=through, **how)  # type: ignore[arg-type]
    problem, screening = full.least_squares_problem, through_for_law(through, law)
    terms = TermSets(problem if screening is None else problem.with_predictor(screening), full.x)
    chosen = terms.of_most_evidence() if penalty == "subsets" else terms.of_least_norm()
    u, e = np.split(chosen.minimum.x, [chosen.problem.parameter_count])
    nuisances = [replace(n, value=float(value)) for n, value in zip(full.nuisances, e, strict=True)]
    start = StartingEstimate(u, nuisances, full.reference)
    assert full.predictor is not None
    fit = identify(
        chosen.problem.law, full.histories, full.predictor, settings=full.settings, start=start, progress=progress
    )
    whole = terms.whole(chosen)
    record = Sparsity(
        law=law.name,
        penalty=penalty,
        kept_terms=chosen.kept_terms,
        dropped_terms=tuple(label for label in law.terms if label not in chosen.kept_terms),
        exponents_off=chosen.exponents_off,
        contributions=TermContributions.of_problem(whole.problem).by_term(whole.minimum.x),
        contributions_after_refit=TermContributions.of_problem(chosen.problem).by_term(chosen.minimum.x),
        full=whole.statistics(full),
        reduced=chosen.statistics(fit),
        observations=problem.observations.count,
    )
    return replace(fit, sparsity=record)


@dataclass(frozen=True, eq=False)
class FittedTerms:
    """A law of some of the terms, and its minimum; exponents_off : its exponents that were switched off."""

    problem: LeastSquaresProblem
    minimum: Minimum
    exponents_off: tuple[str, ...] = ()

    @property
    def kept_terms(self) -> TermNames:
        """Its terms, in the order of the sum."""
        return tuple(self.problem.law.terms)

    @cached_property
    def score(self) -> float:
        """-2 ln of the evidence and of the odds before the tests, but for a constant."""
        law = self.problem.law
        against = DECISIVE_EXCESS * (len(law.terms) + len(switchable_exponents(law)))
        return 2.0 * self.minimum.cost + self.penalty(range(self.problem.parameter_count)) + against

    def penalty(self, parameters: Iterable[int]) -> float:
        """What some of the law's parameters cost, by their positions, beside nuisance parameters."""
        kept = [*parameters, *range(self.problem.parameter_count, self.minimum.x.size)]
        return occam_penalty(self.problem.linearised(self.minimum.x).of(kept), self.problem.covariance_factor)

    def statistics(self, fit: Identification) -> FitStatistics:
        """Its statistics; errors are those of an identification of it."""
        return FitStatistics(2.0 * self.minimum.cost, self.problem.parameter_count, self.score, fit.errors)

    def without(self, exponent: str, off: float) -> FittedTerms:
        """The same with an exponent off, fitted from here."""
        problem, x = _of_terms(self.problem, self.problem.law.fix(**{exponent: off}), self.minimum.x)
        return FittedTerms(problem, problem.minimise(x, tolerances=TOLERANCES), (*self.exponents_off, exponent))


class TermSets:
    """The laws of some of the terms of a sum, each fitted once; x : (unknowns,) where the whole sum fits well."""

    def __init__(self, problem: LeastSquaresProblem, x: Floats) -> None:
        self.problem, self.x, self.terms = problem, x, tuple(problem.law.terms)
        self._fitted: dict[TermNames, FittedTerms] = {}

    def fitted(self, terms: TermNames) -> FittedTerms:
        """The law of these terms, with as many exponents off as the evidence allows, one after the other."""
        if terms not in self._fitted:
            best = self._best_of(terms, [self.fitted((label,)) for label in terms] if len(terms) > 1 else [])
            while True:
                law = best.problem.law
                simpler = [best.without(law.names[k], off) for k, off in switchable_exponents(law)]
                lowest = min(simpler, key=lambda one: one.score, default=best)
                if lowest is best or lowest.score > best.score:
                    break
                best = lowest
            self._fitted[terms] = best
        return self._fitted[terms]

    def whole(self, reduced: FittedTerms) -> FittedTerms:
        """The whole sum with all its exponents; it starts from a reduced law too, above which it must not end."""
        return self._best_of(self.terms, [reduced])

    def of_most_evidence(self) -> FittedTerms:
        """The set of terms of most evidence, without those that cannot have it: no part fits better than the sum."""
        best = min((self.fitted((label,)) for label in self.terms), key=lambda one: one.score)
        whole = self.whole(best)
        least = 2.0 * whole.minimum.cost
        while True:
            larger = [(*best.kept_terms, label) for label in self.terms if label not in best.kept_terms]
            if len(self.terms) <= EXHAUSTIVE_LIMIT:
                larger = [names for k in range(2, len(self.terms) + 1) for names in combinations(self.terms, k)]
            ordered = [tuple(label for label in self.terms if label in names) for names in larger]
            fitted = [self.fitted(names) for names in ordered if least + self._penalty(whole, names) < best.score]
            lowest = min(fitted, key=lambda one: one.score, default=best)
            if lowest.score >= best.score:
                return best
            best = lowest

    def of_least_norm(self) -> FittedTerms:
        """The terms that L2 leaves; the largest others come back until there is no less evidence than for the sum."""
        single = [self.fitted((label,)) for label in self.terms]
        of_terms = TermContributions.of_problem(self.problem)
        norm = contribution_norm(of_terms)
        starts = self._starts(self.problem, self.x, single)
        ends = [self.problem.minimise(start, additional=norm, tolerances=TOLERANCES) for start in starts]
        contributions = of_terms.by_term(min(ends, key=lambda end: end.cost).x)
        ordered = sorted(self.terms, key=lambda label: -contributions[label])
        count = max(sum(share >= LEAST_CONTRIBUTION for share in contributions.values()), 1)
        while True:
            kept = self.fitted(tuple(label for label in self.terms if label in ordered[:count]))
            if count == len(self.terms) or kept.score <= self.whole(kept).score:
                return kept
            count += 1

    def _penalty(self, whole: FittedTerms, terms: TermNames) -> float:
        """What these terms cost with all exponents off, by what the whole sum says of their parameters."""
        law, names = self.problem.law.only(*terms), whole.problem.law.names
        off = {k for k, _ in switchable_exponents(law)}
        kept = whole.penalty(names.index(name) for k, name in enumerate(law.names) if k not in off)
        return kept + DECISIVE_EXCESS * len(terms)

    def _best_of(self, terms: TermNames, parts: Sequence[FittedTerms]) -> FittedTerms:
        """The lowest minimum of these terms: from what the whole sum says of them, and from laws of some of them.

        Of one term the middle of its bounds is a start too, with the rate of the whole sum.
        """
        problem, x = _of_terms(self.problem, self.problem.law.only(*terms), self.x)
        starts = self._starts(problem, x, parts)
        if len(terms) == 1:
            centre = np.concatenate([problem.bounds.centre[: problem.parameter_count], x[problem.parameter_count :]])
            starts.append(_with_total_rate(problem, centre, _log_total_rate(problem, x)))
        minima = (problem.minimise(start, tolerances=TOLERANCES) for start in starts)
        return FittedTerms(problem, min(minima, key=lambda minimum: minimum.cost))

    def _starts(self, problem: LeastSquaresProblem, x: Floats, parts: Sequence[FittedTerms]) -> list[Floats]:
        """x (unknowns,), and where laws of some of the terms end, the others beside them with a small share."""
        starts, rates, law = [x], list(problem.coordinates.term_rates), problem.law
        for part in parts:
            u, e = np.split(np.array(part.minimum.x), [part.problem.parameter_count])
            start = np.concatenate([x[: problem.parameter_count], e])
            start[rates] = _log_total_rate(part.problem, part.minimum.x) + np.log(INITIAL_FRACTION)
            for k, off in switchable_exponents(law):
                start[k] = off
            start[[law.names.index(name) for name in part.problem.law.names]] = u
            starts.append(problem.bounds.clip(start))
        return starts


def switchable_exponents(law: CreepLaw) -> list[tuple[int, float]]:
    """(position, value where it is off) of the parameters of linear scale that can be off within their bounds."""
    return [
        (k, p.off)
        for k, p in enumerate(law.params.values())
        if p.scale == "linear" and p.off is not None and p.bounds[0] <= p.off <= p.bounds[1]
    ]


def _of_terms(problem: LeastSquaresProblem, law: CreepLaw, x: Floats) -> tuple[LeastSquaresProblem, Floats]:
    """The problem of a law of some of a problem's parameters, and x (unknowns,) for it, with the same total rate."""
    names = problem.law.names
    positions = [*(names.index(name) for name in law.names), *range(problem.parameter_count, x.size)]
    reduced = problem.with_law(law)
    return reduced, _with_total_rate(reduced, x[positions], _log_total_rate(problem, x))


def _log_total_rate(problem: LeastSquaresProblem, x: Floats) -> float:
    """ln of the rate of all terms at the reference point, in 1/s; x : (unknowns,)."""
    rates = list(problem.coordinates.term_rates)
    return float(np.logaddexp.reduce(x[rates])) if rates else 0.0


def _with_total_rate(problem: LeastSquaresProblem, x: Floats, log_total: float) -> Floats:
    """x (unknowns,) with all rates multiplied by one factor, so that they add up to exp(log_total) 1/s."""
    shifted = np.array(x)
    shifted[list(problem.coordinates.term_rates)] += log_total - _log_total_rate(problem, x)
    return problem.bounds.clip(shifted)


# ---- contributions ---------------------------------------------------------------------------------------------------

STRESS_FACTORS = (0.5, 0.8, 1.0, 1.3)


TIMES_PER_TEST = 16
"""Times that are evaluated in each test."""


MIN_STRAIN_FRACTION = 0.1
"""Of linear growth to the end strain: least strain at a time, as smaller ones are noise or loading strain."""


LOG_ZERO_RATE = -1e30
"""ln of a rate of zero."""


DIFFERENCE_STEP = 1e-6
"""Of differences, in conditioned coordinates: the ln of rates is smooth in them."""


class TermContributions:
    """Contributions of the terms of a law, by its coordinates, over tests, which weigh alike whatever frames they have.

    u : (parameters or more,) conditioned coordinates, in all methods.
    """

    def __init__(
        self, coordinates: Coordinates, histories: Sequence[History], predictor: Predictor | None = None
    ) -> None:
        self.coordinates, self.law = coordinates, coordinates.law_there
        loaded = [p for history in histories if (p := _points_of_test(history, predictor)).shape[1]]
        if not loaded:
            raise FitError("no test is ever under load: terms of a law cannot be weighed against one another")
        self.weight = np.concatenate([np.full(p.shape[1], 1.0 / (len(loaded) * p.shape[1])) for p in loaded])
        self.point = np.concatenate(loaded, axis=1)
        self.terms = [(law, lower(law, "numpy")) for law in map(self.law.only, self.law.terms)]

    @classmethod
    def of_problem(cls, problem: LeastSquaresProblem) -> TermContributions:
        """Those of the law of a problem over its tests."""
        return cls(problem.coordinates, problem.histories, problem.predictor)

    def log_rates(self, u: Floats) -> Floats:
        """(points, terms) ln of the rate of each term."""
        theta = self.coordinates.theta(u[: len(self.law.params)])
        log_rates = np.empty((self.weight.size, len(self.terms)))
        for k, (term, kernel) in enumerate(self.terms):
            columns = [theta[self.law.names.index(name)] for name in term.names]
            log_rates[:, k] = kernel.internal_log_rate(*tension_point(term, *self.point), *columns)
        return log_rates

    def log_rate(self, u: Floats) -> Floats:
        """(points,) ln of the rate of all terms."""
        with np.errstate(all="ignore"):
            return np.asarray(np.logaddexp.reduce(self.log_rates(u), axis=1))

    def values(self, u: Floats) -> Floats:
        """(terms,) c."""
        shares = softmax(np.maximum(np.nan_to_num(self.log_rates(u), nan=LOG_ZERO_RATE), LOG_ZERO_RATE), axis=1)
        return np.asarray(np.sqrt(self.weight @ shares**2))

    def by_term(self, u: Floats) -> dict[str, float]:
        """{term: c}."""
        return dict(zip(self.law.terms, self.values(u).tolist(), strict=True))


def contribution_norm(contributions: TermContributions) -> System:
    """L2_STRENGTH x sum c_i^2 as residuals, half the sum of their squares; derivatives by central differences."""

    def residuals(x: Floats) -> tuple[Floats, Floats]:
        steps = DIFFERENCE_STEP * np.eye(x.size)[: len(contributions.law.params)]
        columns = [contributions.values(x + h) - contributions.values(x - h) for h in steps]
        slopes = np.pad(np.array(columns).T / (2 * DIFFERENCE_STEP), ((0, 0), (0, x.size - len(steps))))
        return np.sqrt(2 * L2_STRENGTH) * contributions.values(x), np.sqrt(2 * L2_STRENGTH) * slopes

    return residuals


def _points_of_test(history: History, predictor: Predictor | None) -> Floats:
    """(4, points) stress, strain, time, temperature of one test, without those where it bears no load."""
    frames = selected_frames(history, TIMES_PER_TEST)
    frames = frames if frames.size else np.array([history.times.size - 1])  # of a minimum rate or a life alone
    time = history.times[frames]
    strain, temperature = _strain_history(history, predictor)[frames], history.temperature_program().at(time)
    stresses = np.multiply.outer(_stress_history(history, predictor, time), STRESS_FACTORS)
    broadcast = (np.broadcast_to(v[:, None, None], stresses.shape) for v in (strain, time, temperature))
    points = np.stack([stresses, *broadcast]).reshape(4, -1)
    return np.asarray(points[:, points[0] > 0])


def _stress_history(history: History, predictor: Predictor | None, times: Floats) -> Floats:
    """(times, stresses) reference stresses at each time, MPa; times : (times,) s.

    A bulge test has one for each level of pressure, between which it is linear; a specimen whose stress moves by
    itself, as in relaxation, has all of its reference stresses at all times.
    """
    program, test_stresses = history.loading.program(), reference_stresses(history, predictor)
    levels = np.unique(np.abs(program.values[program.values != 0]))
    load = np.abs(program.at(times))
    if history.loading.quantity == "stress" and test_stresses.size == program.values.size:
        return np.asarray(load[:, None])
    if test_stresses.size == levels.size:
        return np.asarray(np.interp(load, [0.0, *levels], [0.0, *np.sort(test_stresses)])[:, None])
    return np.broadcast_to(test_stresses, (times.size, test_stresses.size))


def _strain_history(history: History, predictor: Predictor | None) -> Floats:
    """(frames,) - creep strain of the test, estimated from its outputs; never decreasing, never zero."""
    times, final_strain = history.times, reference_end_strain(history, predictor)
    lower_limit = MIN_STRAIN_FRACTION * final_strain * times / times[-1]
    output = growing_output(history)
    is_used = usable_frames(history, output) if output else np.zeros(times.size, bool)
    if is_used.sum() > 1 and output_named(output, history.specimen).grows:
        measured = np.interp(times, times[is_used], history.outputs[output][is_used])
        start = 0.0 if is_logarithmic(output) else measured[is_used][0]
        scale = 1.0 if is_logarithmic(output) else growth_per_strain(history, predictor)
        lower_limit = np.maximum(lower_limit, np.minimum((measured - start) / scale, final_strain))
    else:
        lower_limit = final_strain * times / times[-1]
    return np.asarray(np.maximum.accumulate(np.maximum(lower_limit, 1e-12)))
