"""Challenges of a verdict: what the tests allow beside the law that has nearly all the weight of those tried.

A weight is relative to the laws tried, and an information criterion prefers the simplest of equals. Three questions
are therefore asked before an answer is called decisive:

1. May a share of the rate come from another law? The best law and each other law tried are added, the second carrying
   SHARE of the rate at the reference point, and the sum is fitted: where its chi-square is smaller by more than its
   further parameters give by chance (95 %), it fits better, and the answer is not decisive; where it is not larger by
   more than 3.84 (95 %, one degree of freedom), the tests do not exclude it, which is said beside the answer. Both
   are the least under the covariance of the best law's identification.
2. May there be a threshold? The stress s in the terms of the best law is replaced by s - s_0, with s_0 THRESHOLD of
   the reference stress: the answer is not decisive where the tests do not exclude it, for with one the law is another
   below them. One that has a threshold is not asked for another.
3. Does the answer rest on something nobody measured? Each unmodelled effect of the laws (see inverse.perturbations: a
   length known to its tolerance, an offset, a furnace that drifts) is put into the linear problems of all of them, with
   its usual size as prior standard deviation, and they are ranked again under one common covariance. In several tests
   it is tried twice: independently in each test, and as one error of all tests. No simulation is needed.

Where no law is singled out, the law of most evidence with an effect is named if it then explains the tests, and without
was not among the credible laws or did not explain them; with the size that the effect has in its linear problem.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Literal, TypeAlias

import numpy as np
import sympy
from scipy.special import logsumexp, softmax
from scipy.stats import chi2

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.defect_correction import with_cheaper_predictor
from creepkit.inverse.evidence import CREDIBLE_WEIGHT, DECISIVE_EXCESS, DECISIVE_WEIGHT, evidence_weights
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.nuisance_parameters import OFFSET, Perturbation, prior_mean
from creepkit.inverse.perturbations import sizes_of_effect
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import System, Tolerances
from creepkit.inverse.selection.discrimination import (
    CommonCovarianceFits,
    RatesOverTests,
    same_function,
    under_common_covariance,
    usual_errors,
)
from creepkit.inverse.sparsity.term_selection import TermContributions
from creepkit.language import CreepLaw, Param, stress
from creepkit.language.symbols import Symbol
from creepkit.records import Nuisance, is_length_nuisance

MOST_NAMED = 2
"""Perturbations, and laws that explain the tests with them, that a sentence names."""


@dataclass(frozen=True)
class PerturbationSize:
    """A perturbation of the size that it takes: kind and unit as of a Perturbation, "%" of a length.

    tests : how many have it. differs : whether each has its own, of which it is the largest.
    """

    kind: str
    size: float
    unit: str
    tests: int = 1
    differs: bool = False


@dataclass(frozen=True)
class Challenge:
    """Something that the tests allow, so that the law of most weight is not proved.

    kind : "sum" of the best law with another, a "threshold" stress of it, or an "unmodelled effect". subject : the name
        of the law that is allowed, or the effect.
    refutes : whether the law is not decisive for it. A sum that explains the tests no better than by chance does not:
        it says how much of another law they allow.
    other : the other law, of a sum or to which the weight goes. size : its share of the rate, or the threshold in MPa.
    excess : chi-square above that of the best law, None where that could not be found. fits_better : than by chance.
    sizes : of the effect, with any of which `laws` explain the tests; its usual one where no law does. weights : of the
        best and of the other law with it, where that is known.
    """

    kind: Literal["sum", "threshold", "unmodelled effect"]
    subject: str
    refutes: bool = True
    other: str = ""
    size: float = 0.0
    excess: float | None = None
    fits_better: bool = False
    sizes: tuple[PerturbationSize, ...] = ()
    laws: tuple[str, ...] = ()
    weights: tuple[float, ...] = ()


Scope = Literal["test", "all"]


@dataclass(frozen=True, eq=False)
class Trial:
    """The laws with one perturbation. scope : whether it is independent in each test, or one of all tests.

    effects : it, by each law. scores : (laws,) -2 ln of the evidence. u : of each law (parameters,) coordinates
    where it fits best. noise_model : of the common covariance.
    """

    scope: Scope
    effects: tuple[Perturbation, ...]
    scores: Floats
    u: tuple[Floats, ...]
    noise_model: NoiseModel

    @classmethod
    def of(cls, fits: Sequence[Identification], effects: tuple[Perturbation, ...], scope: Scope) -> Trial:
        """That of some identifications by likelihood; effects : of each, the perturbation by its law."""
        common = _under_errors(fits, [replace(effect, common=scope == "all") for effect in effects])
        u = tuple(fit.u + step[: fit.u.size] for fit, step in zip(fits, common.steps, strict=True))
        return cls(scope, effects, common.scores, u, fits[common.reference_law].noise_model)

    @property
    def is_of_length(self) -> bool:
        """Whether it is the error of a length of the test pieces."""
        return is_length_nuisance(self.effects[0].kind) and not self.effects[0].kind.startswith(OFFSET)

    def size(self, fits: Sequence[Identification], law: int) -> PerturbationSize:
        """The perturbation with the size that it has in the linear problem of a law, by its position."""
        fit, common = fits[law], self.scope == "all"
        sizes = sizes_of_effect(fit.linear_problem, self.effects[law], self.noise_model, common=common)
        effect, tests, differ = self.effects[law], len(fit.tests), sizes.size > 1
        size, unit = effect.size * (float(np.abs(sizes).max()) if differ else float(sizes[0])), effect.unit
        if self.is_of_length:
            predictor = fit.least_squares_problem.predictor
            nominal = float(np.median([prior_mean(Nuisance(effect.kind), h, predictor) for h in fit.histories]))
            size, unit = 100.0 * size / nominal, "%"
        return PerturbationSize(effect.kind, size, unit.removesuffix(" over a test"), tests, differ)


def _under_errors(fits: Sequence[Identification], tried: Sequence[Perturbation] = ()) -> CommonCovarianceFits:
    """Identifications under one covariance with the usual errors of tests.

    tried : a perturbation by each law, beside the usual errors of tests, and in the place of one of its kind.
    """
    errors = [usual_errors(fit) for fit in fits]
    if tried:
        errors = [[*(e for e in own if e.kind != new.kind), new] for own, new in zip(errors, tried, strict=True)]
    return under_common_covariance(fits, errors)


def _trials(fits: Sequence[Identification]) -> Iterator[Trial]:
    """Those of all perturbations that every law has, of which the first states its size.

    What intervals include of each test by itself is in the evidence already, and tried as one error of all.
    """
    by_kind = [{e.kind: e for e in fit.unmodelled if not e.common and e.residual_change.size} for fit in fits]
    for kind in by_kind[0]:
        effects = tuple(one[kind] for one in by_kind if kind in one)
        if len(effects) == len(fits):
            if not effects[0].included:
                yield Trial.of(fits, effects, "test")
            if len(fits[0].tests) > 1:
                yield Trial.of(fits, effects, "all")


def decisive_effects(fits: Sequence[Identification]) -> tuple[Challenge, ...]:
    """The perturbations, one by one, with which the first law no longer has nearly all the weight."""
    challenges: dict[str, tuple[float, Challenge]] = {}
    rates = RatesOverTests(fits)
    for trial in _trials(fits):
        own = evidence_weights(trial.scores)[1]
        weights = np.bincount(rates.standing(trial.u, trial.scores), own, len(fits))
        effect, weight = trial.effects[0], float(weights[0])
        if weight > DECISIVE_WEIGHT or weight >= challenges.get(effect.kind, (np.inf,))[0]:
            continue
        rival = 1 + int(np.argmax(weights[1:]))
        name, explains = fits[rival].law.name, _explains_with(fits[rival], trial.effects[rival])
        size = trial.size(fits, rival) if explains else PerturbationSize(effect.kind, effect.size, effect.unit)
        found = Challenge("unmodelled effect", effect.kind, other=name, sizes=(size,), laws=(name,) * explains)
        challenges[effect.kind] = weight, replace(found, weights=(weight, float(weights[rival])))
    return tuple(challenge for _, challenge in challenges.values())


def explaining_effects(fits: Sequence[Identification], weights: Floats) -> tuple[Challenge, ...]:
    """The laws that a perturbation makes as likely as the best one, where no law is singled out.

    weights : (laws,) of the ranking, best first. Named is what explains the tests with a perturbation that raises its
    evidence, by more than chance does, to that of the best law as the tests are stated; that was not credible before,
    or none explains the tests; and beside which no simpler law, credible or not, has more evidence with it. What the
    best law alone would need stands in its adequacy.
    """
    trials = [*_trials(fits)]
    if not trials:
        return ()
    rejected = fits[0].adequacy is not None and fits[0].adequacy.rejects
    as_stated = _under_errors(fits).scores
    raised = [
        (float(trial.scores[law]), law, trial)
        for trial in trials
        for law, fit in enumerate(fits)
        if trial.scores[law] < as_stated[law] - DECISIVE_EXCESS
        and trial.scores[law] < as_stated.min() + DECISIVE_EXCESS
        and (rejected or not weights[law] > CREDIBLE_WEIGHT)
        and not any(trial.scores[k] < trial.scores[law] and len(f.u) <= len(fit.u) for k, f in enumerate(fits))
        and _explains_with(fit, trial.effects[law])
    ]
    if not raised:
        return ()
    score, _, best = min(raised, key=lambda one: one[0])
    laws = sorted((law for _, law, trial in raised if trial is best), key=lambda law: len(fits[law].u))
    if laws == [0]:
        return ()
    by_kind = {best.effects[0].kind: best}
    for other_score, law, trial in sorted(raised, key=lambda one: one[0]):
        if law == laws[0] and other_score < score + DECISIVE_EXCESS:
            by_kind.setdefault(trial.effects[0].kind, trial)
    sizes = tuple(trial.size(fits, laws[0]) for trial in [*by_kind.values()][:MOST_NAMED])
    names = tuple(fits[law].law.name for law in laws[:MOST_NAMED])
    return (Challenge("unmodelled effect", best.effects[0].kind, sizes=sizes, laws=names),)


def _explains_with(fit: Identification, effect: Perturbation) -> bool:
    """Whether a law explains the tests, with that perturbation where it does not without."""
    adequacy = fit.adequacy
    return adequacy is not None and (adequacy.explains or any(effect.kind == one.kind for one in adequacy.remedies))


SHARE = 0.3
"""Of the rate at the reference point, that must be excluded of other laws."""


THRESHOLD = 0.2
"""Of the reference stress, a threshold stress that must be excluded."""


NOT_EXCLUDED = float(chi2.ppf(0.95, 1))
"""Increase of chi-square up to which a sum is not excluded."""


SHARE_TOLERANCE = 1e-3
"""Of ln of the ratio of rates, within which a sum keeps its share."""


APPROXIMATE_STEPS = Tolerances(max_steps=15, tolerance=1e-3, gain=1e-3)
"""Of the reduced-order model, from which the last steps begin."""


LAST_STEPS = Tolerances(max_steps=25, tolerance=1e-6, gain=1e-4)
"""Of the best law, from which excesses count."""


PROMISED = 0.05
"""Of chi-square: of a step of an altered law that would lower it by less, the promise is enough."""


FAR_EXCLUDED, EXCLUDED_BY_STEP = 10.0 * NOT_EXCLUDED, 6.0 * NOT_EXCLUDED
"""Increase of chi-square by the reduced-order model, and by a step of the simulated law from there, from which on a sum
is excluded without a further run.
"""


def challenges_of(fits: Sequence[Identification]) -> tuple[Challenge, ...]:
    """The challenges of the first of some identifications, those first for which it is not decisive.

    The first altered law of those ends the search; of the others the first is kept.
    """
    allowed: list[Challenge] = []
    for alteration in _alterations(fits):
        challenge = _challenge(*alteration)
        if challenge is not None and challenge.refutes:
            return (challenge, *decisive_effects(fits))
        allowed += [] if challenge is None else [challenge]
    return (*decisive_effects(fits), *allowed[:1])


def altered_laws(fits: Sequence[Identification], limit: float = NOT_EXCLUDED) -> list[AlteredLaw]:
    """Every alteration of the first of some identifications whose chi-square is higher by no more than a limit.

    What cannot be fitted is left out.
    """
    results = []
    for _, _, fitted in _alterations(fits):
        with contextlib.suppress(CreepkitError):
            found = fitted()
            results += [found] if found is not None and found.excess <= limit else []
    return results


Kind: TypeAlias = Literal["sum", "threshold"]


def _alterations(fits: Sequence[Identification]) -> Iterator[tuple[Kind, str, Callable[[], AlteredLaw | None]]]:
    """What may be altered in the first law: kind, name, and what fits it.

    No sum with a law that shares a summand: one that holds a law twice is never excluded.
    """
    best, summands = FittedLaw.at_least_chi_square(fits[0]), set(fits[0].law.name.split("+"))
    for fit in fits[1:]:
        if summands.isdisjoint(fit.law.name.split("+")):
            yield ("sum", fit.law.name, partial(sum_with_share, best, FittedLaw(fit.least_squares_problem, fit.x)))
    if not any(cut.has(stress) for term in best.law.terms.values() for cut in term.atoms(sympy.Max)):
        yield "threshold", f"{best.law.name} above a threshold", partial(above_threshold, best)


def _challenge(kind: Kind, name: str, fitted: Callable[[], AlteredLaw | None]) -> Challenge | None:
    try:
        found = fitted()
    except CreepkitError:
        return Challenge(kind, name, other=name)
    if found is None or found.excess > NOT_EXCLUDED:
        return None
    refutes, of = found.excess <= found.refuting_excess, found.problem.law.name
    return Challenge(kind, of, refutes, name, found.size, found.excess, found.fits_better)


# ---- shares of other laws --------------------------------------------------------------------------------------------


def share_residual(first: Sequence[int], second: Sequence[int], log_ratio: float) -> System:
    """One residual that holds the ratio of two rates at the reference point.

    first, second : positions of the ln rates of the terms of two laws among the unknowns. log_ratio : of the rate of
    the second law, all its terms, over that of the first.
    """

    def residual(x: Floats) -> tuple[Floats, Floats]:
        row, (a, b) = np.zeros((1, x.size)), (x[list(terms)] for terms in (first, second))
        row[0, list(first)], row[0, list(second)] = -softmax(a), softmax(b)
        return np.array([logsumexp(b) - logsumexp(a) - log_ratio]) / SHARE_TOLERANCE, row / SHARE_TOLERANCE

    return residual


@dataclass(frozen=True, eq=False)
class FittedLaw:
    """A problem and the values of its law: x (unknowns,), the coordinates u first."""

    problem: LeastSquaresProblem
    x: Floats

    @classmethod
    def at_least_chi_square(cls, fit: Identification) -> FittedLaw:
        """That of an identification, where its chi-square under the noise that was found is least.

        Values by other weights, or under errors of tests, are not there: whatever is fitted under that noise would seem
        better than the law itself.
        """
        problem, x = fit.least_squares_problem, fit.x
        if fit.settings.weights != "likelihood" or fit.settings.included_errors:
            with contextlib.suppress(CreepkitError):
                refined = problem.minimise(x, tolerances=LAST_STEPS).x
                x = min(x, refined, key=problem.chi_square)
        return cls(problem, x)

    @property
    def law(self) -> CreepLaw:
        """The law."""
        return self.problem.law

    @cached_property
    def reduced(self) -> LeastSquaresProblem | None:
        """The problem through the reduced-order model, corrected at x; None where there is none."""
        reduced = self.problem.predictor.reduced_order_model()
        return None if reduced is None else with_cheaper_predictor(self.problem, self.x, reduced)

    @property
    def u(self) -> Floats:
        """(parameters,) conditioned coordinates."""
        return self.x[: self.problem.parameter_count]

    @property
    def log_rate(self) -> float:
        """ln of the rate of all terms at the reference point, 1/s; FitError where it has none of its own."""
        rates = list(self.problem.coordinates.term_rates)
        if not rates:
            raise FitError(f"{self.law.name} has no rate at the reference point of which a share could be taken")
        return float(logsumexp(self.u[rates]))


@dataclass(frozen=True, eq=False)
class AlteredLaw:
    """The best law altered as a challenge says, fitted to the same tests under the same covariance.

    x : (unknowns,) its values. excess : its chi-square above that of the best law.
    constraints : (rows, unknowns) derivatives over tolerances of what was held, such as the share of a second law.
    further : its parameters beyond those of the best law, of which one is held. size : the share, or threshold in MPa.
    """

    kind: Kind
    problem: LeastSquaresProblem
    x: Floats
    excess: float
    constraints: Floats
    further: int
    size: float

    @property
    def fits_better(self) -> bool:
        """Whether chi-square is lower by more than it falls by chance (95 %) with the parameters that are not held."""
        return self.excess < -self._by_chance

    @property
    def refuting_excess(self) -> float:
        """The excess up to which a verdict for the best law does not stand."""
        return NOT_EXCLUDED if self.kind == "threshold" else -self._by_chance

    @property
    def _by_chance(self) -> float:
        return float(chi2.ppf(0.95, max(self.further - 1, 1)))


def sum_with_share(best: FittedLaw, other: FittedLaw) -> AlteredLaw | None:
    """The sum of the best law and another one that carries SHARE of the rate; None where it is the best law itself.

    None as well where one has a back stress: the other would flow along another stress.
    FitError where one of them has no rate at the reference point of its own, or where it cannot be fitted.
    """
    if best.law.back_stresses or other.law.back_stresses:
        return None
    start, own_terms = best.log_rate - other.log_rate, len(best.problem.coordinates.term_rates)
    law = best.law + other.law
    problem = _of_law(best.problem, law)
    own_rates, further_rates = (list(part) for part in np.split(problem.coordinates.term_rates, [own_terms]))
    x = np.concatenate([best.u, other.u, best.x[best.u.size :]])
    x[own_rates] += np.log(1.0 - SHARE)
    x[further_rates] += np.log(SHARE) + start
    share = share_residual(own_rates, further_rates, float(np.log(SHARE / (1.0 - SHARE))))
    excess, x = _least_excess(best, problem, x, share=share)
    if _are_one_function(problem, x, own_terms):
        return None
    return AlteredLaw("sum", problem, x, excess, share(x)[1], other.u.size, SHARE)


def above_threshold(best: FittedLaw) -> AlteredLaw:
    """The best law above a threshold stress; CreepkitError where it cannot be fitted."""
    threshold = THRESHOLD * best.problem.coordinates.reference.stress
    s_0, effective = Symbol("s_0_threshold"), best.law.effective_stress
    terms = {label: term.subs(effective, sympy.Max(effective - s_0, 0)) for label, term in best.law.terms.items()}
    param = Param("threshold stress", unit="MPa", bounds=(0.0, 2.0 * threshold))
    law = replace(
        best.law, name=f"{best.law.name} above a threshold", terms=terms, params={**best.law.params, s_0: param}
    )
    problem = _of_law(best.problem, law)
    position = best.u.size
    x = np.concatenate([best.u, [threshold], best.x[position:]])
    excess, x = _least_excess(best, problem, x, fixed={position: threshold})
    held = np.zeros((1, x.size))
    held[0, position] = 1.0 / (SHARE_TOLERANCE * threshold)
    return AlteredLaw("threshold", problem, x, excess, held, 1, threshold)


def _are_one_function(problem: LeastSquaresProblem, x: Floats, own_terms: int) -> bool:
    """Whether the further terms of a sum are, at x (unknowns,), multiples of the first ones in all tests.

    A power law with a hardening exponent of zero is a power law: its sum with another says nothing new.
    """
    with np.errstate(all="ignore"):
        log_rates = TermContributions.of_problem(problem).log_rates(x)
    own, further = (np.logaddexp.reduce(part, axis=1) for part in np.split(log_rates, [own_terms], axis=1))
    return same_function(own, further)


def _of_law(single: LeastSquaresProblem, law: CreepLaw) -> LeastSquaresProblem:
    """The problem of another law under the same covariance, with the same nuisances, correction, and rates of tests."""
    problem = LeastSquaresProblem.from_histories(
        law, single.histories, single.predictor, single.settings, single.coordinates.reference
    )
    names = ["covariance_factor", "histories", "observations", "stopped"]
    lives = single.log_factors is not None and bool(single.log_factors[1].any())
    movable = problem.coordinates.every_rate_has_coefficient and bool(problem.coordinates.damage_rates) >= lives
    names += ["log_factors", "rate_shift"] if movable else []
    same: dict[str, Any] = {name: getattr(single, name) for name in names}
    problem = replace(problem, **same)
    return problem.with_nuisances(single.nuisance_parameters).with_correction(single.correction)


def _least_excess(
    best: FittedLaw,
    problem: LeastSquaresProblem,
    x: Floats,
    *,
    share: System | None = None,
    fixed: Mapping[int, float] | None = None,
) -> tuple[float, Floats]:
    """The least chi-square from x (unknowns,) above that of the best law, and where.

    It is sought by the reduced-order model, then by the predictor itself where that does not exclude it by far.
    """
    least = best.problem.chi_square(best.x)
    last = replace(LAST_STEPS, gain=PROMISED / least)
    if best.reduced is not None:
        cheap = problem.with_predictor(best.reduced.predictor).with_correction(best.reduced.correction)
        found = cheap.minimise(x, additional=share, fixed=fixed, tolerances=APPROXIMATE_STEPS)
        x, excess = found.x, cheap.chi_square(found.x) - least
        if found.converged and excess > FAR_EXCLUDED:
            return excess, x
        last = replace(last, wanted=0.5 * (least + EXCLUDED_BY_STEP))
    end = problem.minimise(x, additional=share, fixed=fixed, tolerances=last)
    return problem.chi_square(end.x) - 2.0 * (end.cost - end.promised) - least, end.x
