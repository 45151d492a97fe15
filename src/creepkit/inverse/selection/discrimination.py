"""Model discrimination: identified laws under one common covariance, and pairs of laws that the tests cannot separate.

The common covariance is that of the law which explains the histories best. With a covariance of its own each law would
count as noise what it cannot describe. The problems are linear about their optima, so that no simulation is needed to
move each law to its optimum under the common covariance. Laws are ranked with the errors that tests usually have (see
inverse.perturbations) integrated out, each with its effect by the law itself: what a thickness that is off by 2 %
explains is no evidence between two laws. The determinant of the covariance belongs to the evidence then.

With r_a and r_b the residuals of two laws on the same frames and C the common covariance,

    d2 = (r_a - r_b)' C^-1 (r_a - r_b)

is the chi-square between their predictions: if one of them is true, the other is expected to be worse by d2. Below
2 ln 19 = 5.9 no weight of 0.95 is to be expected even then. A law that another one becomes where a parameter takes its
`off` value (m = 0) is equivalent too where the parameter's interval contains it.

A law of more parameters whose values make it the same function as a simpler one over the tests, their rates within 5 %
of one another by values that the simpler one may take, is no other answer: the simpler law, where it has more evidence,
stands for both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import LawError
from creepkit.inverse.evidence import DECISIVE_EXCESS, occam_penalty
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_covariance import CovarianceFactor, effective_sample_size
from creepkit.inverse.noise_model import Residuals, autocorrelated_components
from creepkit.inverse.nuisance_parameters import Perturbation
from creepkit.inverse.sparsity.term_selection import DIFFERENCE_STEP, TermContributions
from creepkit.inverse.uncertainty.quantities import local_exponent
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.language import CreepLaw, strain, time


@dataclass(frozen=True, eq=False)
class CommonCovarianceFits:
    """Laws under one covariance.

    chi_square : (laws,) - with priors. scores : (laws,) -2 ln of their evidence.
    reference_law : position of the law whose covariance it is.
    whitened : (laws, observations) - whitened residuals, zero where there are no data.
    steps : of each law (unknowns,), from its values to its optimum.
    """

    chi_square: Floats
    scores: Floats
    reference_law: int
    whitened: Floats
    steps: tuple[Floats, ...]


def usual_errors(fit: Identification) -> list[Perturbation]:
    """The errors of tests that the intervals of an identification include, where their effects are kept."""
    return [effect for effect in fit.unmodelled if effect.included and effect.residual_change.size]


def under_common_covariance(
    fits: Sequence[Identification], errors: Sequence[Sequence[Perturbation]] = ()
) -> CommonCovarianceFits:
    """All laws under the covariance of the one that explains best with its own.

    errors : of tests by each law, which are integrated out.
    """
    plain = problems = [fit.linear_problem for fit in fits]
    if errors:
        problems = [linear.with_effects(own) for linear, own in zip(plain, errors, strict=True)]
    frames = max(effective_sample_size(one.residuals, fit.noise_model) for fit, one in zip(fits, plain, strict=True))
    own_scores = [score_under_own_covariance(fit, one, frames) for fit, one in zip(fits, problems, strict=True)]
    reference_law = int(np.argmin(own_scores))
    noise_model, reference_residuals = fits[reference_law].noise_model, plain[reference_law].residuals
    factors = [
        CovarianceFactor.of_residuals(with_covariance_of(reference_residuals, linear.residuals), noise_model)
        for linear in problems
    ]
    results = [
        _optimum_under(linear, factor, len(fit.u)) for linear, factor, fit in zip(problems, factors, fits, strict=True)
    ]
    chi_squares, scores, whitened, steps = zip(*results, strict=True)
    return CommonCovarianceFits(np.array(chi_squares), np.array(scores), reference_law, np.array(whitened), steps)


def with_covariance_of(reference: Residuals, residuals: Residuals) -> Residuals:
    """A law's residuals, with the derivatives that make the covariance, of the best law."""
    lives = residuals.log_life_sensitivity
    if lives is not None and reference.log_life_sensitivity is not None:
        lives = np.where(reference.present, reference.log_life_sensitivity, lives)

    def best(of_best: Floats, own: Floats) -> Floats:
        return np.where(reference.present, of_best, own)

    return replace(
        residuals,
        offset_sensitivity=best(reference.offset_sensitivity, residuals.offset_sensitivity),
        log_rate_sensitivity=best(reference.log_rate_sensitivity, residuals.log_rate_sensitivity),
        log_life_sensitivity=lives,
    )


def score_under_own_covariance(fit: Identification, linearised: LinearisedProblem, frames: float) -> float:
    """-2 ln of the evidence with the law's own scatter, whose variance components are penalised by `frames`.

    A law that needs a drift for what another follows must not set the covariance.
    """
    factor = CovarianceFactor.of_residuals(linearised.residuals, fit.noise_model)
    components = len(fit.noise_model.outputs) + autocorrelated_components(fit.noise_model)
    return _optimum_under(linearised, factor, len(fit.u))[1] + components * float(np.log(frames))


def _optimum_under(
    linearised: LinearisedProblem, factor: CovarianceFactor, parameter_count: int
) -> tuple[float, float, Floats, Floats]:
    """Chi-square with priors at the optimum within the bounds, -2 ln of the evidence, whitened residuals, step.

    Only nuisance parameters have priors here: the weak ones of a law's parameters must not favour the middle of bounds.
    """
    precision = linearised.precision.copy()
    precision[:parameter_count] = 1e-9 * precision[:parameter_count]
    without_parameter_priors = replace(linearised, precision=precision)
    step = np.zeros(precision.size)
    step[linearised.free] = without_parameter_priors.step_within(factor)
    chi_square, whitened = without_parameter_priors.chi_square(factor, step)
    stopped = linearised.residuals.stopped
    score = chi_square + stopped.log_variance + stopped.chi_square + factor.log_determinant
    score += occam_penalty(linearised, factor)
    return chi_square + stopped.chi_square, score, np.where(linearised.residuals.present, whitened, 0.0).ravel(), step


SAME_FUNCTION = 0.05
"""Range of ln of the ratio of two rates over all conditions, within which they are one function."""


def same_function(first: Floats, second: Floats) -> bool:
    """Whether two rates are multiples of one another in all tests; first, second : (points,) their logarithms."""
    with np.errstate(invalid="ignore"):
        difference = first - second
    return bool(np.isfinite(difference).all() and np.ptp(difference) < SAME_FUNCTION)


def _nearest_of(log_rate: Callable[[Floats], Floats], u: Floats, other: Floats) -> Floats:
    """(points,) ln of the rate of a law whose values, u (parameters,) at first, come nearest to another (points,)."""
    own = log_rate(u)
    steps = DIFFERENCE_STEP * np.eye(u.size)
    slopes = np.column_stack([(log_rate(u + h) - log_rate(u - h)) / (2.0 * DIFFERENCE_STEP) for h in steps])
    if not np.isfinite([*slopes.ravel(), *own, *other]).all():
        return own
    return np.asarray(own + slopes @ np.linalg.lstsq(slopes, other - own)[0])


class RatesOverTests:
    """The rates of identified laws over their tests, by which a simpler one stands for others.

    A law whose rate has a history, or depends on the material's condition, is no function of the points compared.
    """

    def __init__(self, fits: Sequence[Identification]) -> None:
        self.fits = fits
        self.log_rates: list[Callable[[Floats], Floats]] = [
            TermContributions.of_problem(fit.least_squares_problem).log_rate
            if fit.histories and fit.predictor is not None and not (fit.law.states or fit.law.conditions)
            else lambda _: np.array([np.nan])
            for fit in fits
        ]

    def standing(self, u: Sequence[Floats], scores: Floats) -> list[int]:
        """Of each law the position of the simpler one that stands for it, of more evidence; its own where none does.

        u : (parameters,) conditioned coordinates of each. scores : (laws,) -2 ln of the evidence.
        """
        log_rates = [log_rate(own) for log_rate, own in zip(self.log_rates, u, strict=True)]
        sizes, stands = [fit.u.size for fit in self.fits], list(range(len(self.fits)))
        for k in sorted(stands, key=lambda law: sizes[law]):
            simpler = [j for j, size in enumerate(sizes) if size < sizes[k] and scores[j] <= scores[k]]
            nearest = {j: _nearest_of(self.log_rates[j], u[j], log_rates[k]) for j in simpler}
            same = [j for j in simpler if same_function(nearest[j], log_rates[k])]
            stands[k] = stands[min(same, key=lambda law: float(scores[law]), default=k)]
        return stands


STRESS_POINTS = 21
"""Stresses at which local exponents are compared."""


@dataclass(frozen=True)
class EquivalentLaws:
    """Two laws that the tests cannot separate.

    first, second : their names, the better one first. chi_square : between their predictions on the tests.
    reduction : "m = 0" where the richer law becomes the other one so, and the tests allow it; else empty.
    sentence : for people.
    """

    first: str
    second: str
    chi_square: float
    reduction: str
    sentence: str

    def __str__(self) -> str:
        return self.sentence


def equivalent_laws(fits: Sequence[Identification]) -> tuple[EquivalentLaws, ...]:
    """The pairs of laws, the better one first, that their tests cannot separate, nearest predictions first."""
    whitened = under_common_covariance(fits).whitened
    pairs = []
    for a, b in combinations(range(len(fits)), 2):
        chi_square = float(((whitened[a] - whitened[b]) ** 2).sum())
        richer_law, reduction = _reduction_between(fits[a], fits[b])
        if chi_square < DECISIVE_EXCESS or reduction:
            sentence = _equivalence_sentence(fits[a], fits[b], chi_square, richer_law, reduction)
            pairs.append(EquivalentLaws(fits[a].law.name, fits[b].law.name, chi_square, reduction, sentence))
    return tuple(sorted(pairs, key=lambda pair: pair.chi_square))


def _reduction_between(first: Identification, second: Identification) -> tuple[str, str]:
    """(name of the richer law, "m = 0") where one law with a parameter off is the other, within its interval."""
    for richer, simpler in ((first, second), (second, first)):
        for name, value, law in _laws_with_parameter_off(richer.law):
            if _is_same_function(law, simpler.law) and _interval_contains(richer, name, value):
                return richer.law.name, f"{name} = {value:g}"
    return "", ""


def _laws_with_parameter_off(law: CreepLaw) -> Iterator[tuple[str, float, CreepLaw]]:
    """(parameter, its off value, the law that is left) for every parameter that can be switched off."""
    for name, param in law.table.items():
        if param.off is None:
            continue
        try:
            yield name, param.off, law.fix(**{name: param.off})
        except LawError:  # nothing is left of the law
            continue


def _is_same_function(first: CreepLaw, second: CreepLaw) -> bool:
    """Whether two laws are the same function of point and parameters, whatever these are called."""
    return first.fingerprint.rpartition("-")[2] == second.fingerprint.rpartition("-")[2]


def _interval_contains(fit: Identification, name: str, value: float) -> bool:
    (estimate,) = (candidate for candidate in fit.estimates if candidate.name == name)
    tolerance = 1e-6 * (estimate.high - estimate.low)
    return estimate.low - tolerance <= value <= estimate.high + tolerance


def _equivalence_sentence(
    a: Identification, b: Identification, chi_square: float, richer_law: str, reduction: str
) -> str:
    """What is the same, in what sense, and where."""
    names = f"{a.law.name} and {b.law.name}"
    parts = [f"{names} cannot be told apart by these tests: chi-square {chi_square:.2g} between their predictions"]
    if reduction:
        parts.append(f"{richer_law} with {reduction} is the other law, and the tests allow it")
    lowest, highest = a.ranges["stress"]
    constant_loads = all(_is_constant(h.load_levels) for h in a.histories)
    if highest <= 1.001 * lowest:
        parts.append(f"every test holds one stress, {lowest:.4g} MPa")
    elif not any(fit.law.uses(symbol) for fit in (a, b) for symbol in (strain, time)):
        parts.append(_exponent_sentence(a, b, lowest, highest))
    elif constant_loads and _differ_in_hardening(a.law, b.law):
        parts.append("no test changes its load, and hardening by strain and by time differ only after a change")
    return "; ".join(parts)


def _exponent_sentence(a: Identification, b: Identification, lowest: float, highest: float) -> str:
    grid = np.geomspace(lowest, highest, STRESS_POINTS)
    first_exponents, second_exponents = (local_exponent(fit.coordinates, grid)(fit.u) for fit in (a, b))
    ranges = [
        f"{float(exponents.min()):.2f} to {float(exponents.max()):.2f}"
        if np.ptp(exponents) > 0.005
        else f"{float(exponents[0]):.2f}"
        for exponents in (first_exponents, second_exponents)
    ]
    return (
        f"over {lowest:.4g} to {highest:.4g} MPa their local exponents are {ranges[0]} and {ranges[1]}, never more "
        f"than {float(np.abs(first_exponents - second_exponents).max()):.2g} apart"
    )


def _is_constant(levels: Floats) -> bool:
    """Whether a program holds one level, but for the ramp that reaches it."""
    return bool(np.ptp(levels[levels > 0]) <= 1e-3 * levels.max()) if (levels > 0).any() else True


def _differ_in_hardening(first: CreepLaw, second: CreepLaw) -> bool:
    """Whether one law hardens by its strain and the other by time."""
    hardening = [(law.uses(strain), law.uses(time)) for law in (first, second)]
    return hardening in ([(True, False), (False, True)], [(False, True), (True, False)])
