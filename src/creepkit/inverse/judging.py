"""Judging a law: chi-square of its residuals under noise that was not estimated from its misfit.

With r the residuals at the optimum under C0, the covariance of the noise that histories state (or that neighbouring
frames of each test show), of offsets and of scatter between tests,

    chi2 = r' C0^-1 r

has chi-square's distribution with n less the estimated unknowns degrees of freedom if the law is right and the noise
white; where the noise was estimated from nu frames, chi2 over its degrees of freedom has that of F. It is taken of all
outputs together and of each, and the least probability times their number is the p-value (Bonferroni). Below 0.3 % the
law leaves a model discrepancy: what must be added to the noise for the same chi-square. Offsets and the scatter of
rates were estimated from the same tests; a scatter beyond a factor of 2.7, or one that something else explains (see
inverse.rate_explanations), is misfit.

The residuals at the optimum are linear in the unknowns and in the random effects of tests. Unknowns and effects that
minimise chi2 are taken out, each test with its own rate, life and offset; what is left is judged reading by reading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.stats import chi2

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.adequacy import Adequacy, LargestDeviation, OutputAdequacy, Remedy
from creepkit.inverse.iterative_estimation import judged_at
from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NEGLIGIBLE_DISCREPANCY, NoiseModel, OutputNoise, Residuals
from creepkit.inverse.nuisance_parameters import DRIFT, Perturbation
from creepkit.inverse.observation_vector import LINEAR_COORDINATE_LENGTH
from creepkit.inverse.perturbations import sizes_of_effect
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.variance_components import LinearisedProblem, LinearSolution
from creepkit.limits import SIGNIFICANCE
from creepkit.records import History, is_logarithmic

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

LOCAL_FRAMES = 5
"""Frames whose mean deviation says when a law misses a test."""

UNUSUAL = 0.2
"""Share of campaigns whose errors are together larger than usual ones."""


@dataclass(frozen=True, eq=False)
class JudgedResiduals:
    """What is left of every observation; only those where `known.judged` count.

    residuals : at the optimum, with the random effects of tests. known : the noise they are judged by.
    deviation : (tests, observations) predicted less measured, in the output's unit, offsets, rates and lives of tests
        taken out.
    contributions, marginal : (tests, observations) to chi-square, that of all outputs together and that of the output
        alone.
    share_of_freedom : degrees of freedom of one observation.
    """

    residuals: Residuals
    known: KnownNoise
    deviation: Floats
    contributions: Floats
    marginal: Floats
    share_of_freedom: float

    def reduced_chi_square(self, mask: Bools) -> float:
        """Chi-square of some observations over their degrees of freedom; NaN of none. mask : (tests, observations)."""
        counted = mask & self.known.judged
        if not counted.any():
            return float("nan")
        return float(self.contributions[counted].sum()) / (self.share_of_freedom * float(counted.sum()))


@dataclass(frozen=True, eq=False)
class Judge:
    """What laws, or one law with perturbations, are judged by: a problem and the noise that is known without a law.

    noise_model : of the estimate, for offsets and scatter between tests. predictor_errors : {output: standard
    deviation} of what the predictor is wrong by, in the output's unit. histories : with all frames.
    """

    problem: LeastSquaresProblem
    noise_model: NoiseModel
    predictor_errors: Mapping[str, float]
    histories: Sequence[History]

    @cached_property
    def known(self) -> KnownNoise:
        """The noise that the histories state or show."""
        return KnownNoise.of_histories(self.problem.observations, self.histories)

    def residuals(self, linear: LinearisedProblem) -> JudgedResiduals | None:
        """What is left at the optimum of the problem, made linear there; None where no noise is known."""
        known = self.known.where(linear.residuals.offset_sensitivity > 0)
        if not known.judged.any():
            return None
        judged = linear.residuals.where(known.judged & linear.residuals.present)
        residuals = replace(judged, relative_noise=known.sd)
        independent, reduced = self._independent_noise, replace(linear, residuals=residuals)
        solution = _within_bounds(reduced, CovarianceFactor.of_residuals(residuals, independent))
        noise = NoiseModel({name: OutputNoise(one.noise) for name, one in independent.outputs.items()})
        plain = replace(residuals, random_effect_sensitivities=None, rate_errors=None)
        of_frames = CovarianceFactor.of_residuals(plain, noise).blocks
        white = np.einsum("tef,tf->te", of_frames, solution.weighted_residuals)
        return JudgedResiduals(
            linear.residuals,
            known,
            np.asarray(white / np.where(residuals.offset_sensitivity > 0, residuals.offset_sensitivity, 1.0)),
            solution.residuals * solution.weighted_residuals,
            _marginal_contributions(residuals, solution, independent),
            _freedom(reduced, solution) / float(known.judged.sum()),
        )

    def adequacy(self, linear: LinearisedProblem) -> Adequacy:
        """The adequacy of a law at the optimum of the problem, made linear there."""
        observations, judged = self.problem.observations, self.residuals(linear)
        if judged is None:
            nan = float("nan")
            few = self.known.few_frames
            return Adequacy((), nan, 0.0, nan, nan, None, not_judged=observations.outputs, few_frames=few)
        known, share_of_freedom = judged.known, judged.share_of_freedom
        outputs = []
        for position, name in enumerate(observations.outputs):
            mask = known.judged & (observations.output_index == position)
            if not mask.any():
                continue
            freedom = share_of_freedom * float(mask.sum())
            reduced = float(judged.marginal[mask].sum()) / freedom
            p_value = float(known.distribution(share_of_freedom, mask).sf(reduced))
            noise = float(np.median(known.sd[mask]))
            # In its unit from the deviations themselves: their share of chi-square is another where noise varies.
            square = float((judged.deviation[mask] ** 2).mean()) / share_of_freedom * max(1.0 - 1.0 / reduced, 0.0)
            discrepancy = float(np.sqrt(square))
            source: Literal["stated", "estimated"] = "stated" if observations.stated[position] else "estimated"
            outputs.append(OutputAdequacy(name, int(mask.sum()), noise, source, reduced, p_value, discrepancy))
        freedom = share_of_freedom * float(known.judged.sum())
        reduced = judged.reduced_chi_square(known.judged)
        by_chance = known.distribution(share_of_freedom, known.judged)
        pooled = float(by_chance.sf(reduced))
        p_values = [pooled, *(o.p_value for o in outputs)] if len(outputs) > 1 else [pooled]
        p_value = min(1.0, len(p_values) * min(p_values))
        # Outputs that are each within chance may be beyond it together: all of them have then left something.
        alone = any(o.p_value < SIGNIFICANCE for o in outputs)
        left = [p_value < SIGNIFICANCE and (o.p_value < SIGNIFICANCE or not alone) for o in outputs]
        outputs = [o if kept else replace(o, discrepancy=0.0) for o, kept in zip(outputs, left, strict=True)]
        return Adequacy(
            tuple(outputs),
            reduced,
            freedom,
            p_value,
            _correlation(self.noise_model),
            self._largest_deviation(judged),
            rate_scatter=self.noise_model.rate,
            expected_chi_square=float(by_chance.mean()),
            critical_chi_square=float(by_chance.isf(SIGNIFICANCE / len(p_values))),
            smallest_p_value=min(p_values),
        )

    def remedies(self, linear: LinearisedProblem, effects: Sequence[Perturbation]) -> tuple[Remedy, ...]:
        """The effects with which a law that is rejected would explain the tests, as they would have to be.

        A drift in one test alone is a rate that changes with time, which a law may have: nothing tells the two apart.
        """
        remedies = []
        for effect in effects:
            is_of_law = effect.common or (effect.kind == DRIFT and effect.tests == 1)
            if not is_of_law and self.adequacy(linear.with_effects([effect])).explains:
                sizes = sizes_of_effect(linear, effect, self.noise_model)
                taken = replace(effect, size=effect.size * float(np.abs(sizes).max()))
                is_usual = float(chi2.sf((sizes**2).sum(), sizes.size)) > UNUSUAL
                change = 100 * np.expm1(effect.per_kelvin * taken.size)
                by_rate = f" ({change:.2g} % of the rate, by an assumed activation energy)" if effect.assumed else ""
                remedies.append(Remedy(effect.kind, f"{taken.description}{by_rate}", is_usual))
        return tuple(remedies)

    @property
    def _independent_noise(self) -> NoiseModel:
        """Known noise (relative to one unit of the output), the predictor's error, and offsets and scatter of tests."""
        observations, outputs = self.problem.observations, {}
        for name, transform in zip(observations.outputs, observations.transforms, strict=True):
            scale = getattr(transform, "scale", None)
            drift = self.predictor_errors.get(name, 0.0) / scale if scale else 0.0
            offset = self.noise_model[name].offset
            outputs[name] = OutputNoise(1.0, offset=offset, drift=drift, correlation_length=1.0)
        return NoiseModel(outputs, self.noise_model.rate, life=self.noise_model.life)

    def _largest_deviation(self, judged: JudgedResiduals) -> LargestDeviation | None:
        """Where the deviation is largest over the known noise."""
        observations, histories = self.problem.observations, self.histories
        known, deviation = judged.known, judged.deviation
        series = [
            (test, observations.outputs[position], judged_index)
            for test, position, index in observations.series
            if (judged_index := index[known.judged[test, index]]).size
        ]
        if not series:
            return None

        def in_noises(one: tuple[int, str, Ints]) -> Floats:
            return np.asarray(deviation[one[0], one[2]] / known.sd[one[0], one[2]])

        worst = max(series, key=lambda one: float((in_noises(one) ** 2).mean()))
        test, name, index = worst
        width = min(LOCAL_FRAMES, index.size)
        weights = np.full(width, 1.0 / width)
        means = np.convolve(deviation[test, index], weights, mode="valid")
        noises = np.abs(np.convolve(in_noises(worst), weights, mode="valid"))
        k = int(np.argmax(noises))
        time = float(observations.times[test, index[k + width // 2]])
        rms = float(np.sqrt((deviation[test, index] ** 2).mean()))
        return LargestDeviation(histories[test].name, name, time, float(means[k]), float(noises[k]), rms)


def judged_residuals_of(fit: Identification) -> JudgedResiduals | None:
    """What is left of an identification with its histories, as it was judged; None where no noise is known."""
    problem = fit.least_squares_problem
    error = fit.numerical_error
    errors = problem.predictor.error if error is None else error.remaining
    linear = judged_at(problem, fit.linear_problem, fit.noise_model)
    return Judge(problem, fit.noise_model, errors, fit.histories).residuals(linear)


def _marginal_contributions(residuals: Residuals, solution: LinearSolution, noise_model: NoiseModel) -> Floats:
    """(tests, observations) whose sum over an output is its own chi-square, as if it alone were known.

    Outputs share the rate of a test, and their noise may be correlated: that of all together is not a sum of theirs.
    """
    out = np.zeros_like(solution.residuals)
    for position in range(len(noise_model.outputs)):
        mask = residuals.present & (residuals.output_index == position)
        factor = CovarianceFactor.of_residuals(replace(residuals, present=mask), noise_model)
        out[mask] = factor.whiten(solution.residuals)[mask] ** 2
    return out


def _within_bounds(linear: LinearisedProblem, factor: CovarianceFactor) -> LinearSolution:
    """The optimum of the linear problem within its bounds."""
    residuals = linear.residuals.values + linear.jacobian @ linear.step_within(factor)
    return replace(linear.solve(factor), residuals=residuals, weighted_residuals=factor.inverse_times(residuals))


def _freedom(linear: LinearisedProblem, solution: LinearSolution) -> float:
    """Observations less the unknowns that they determine: n - p + tr(M P), with M the covariance and P the priors."""
    prior = linear.precision[linear.free]
    determined = prior.size - float((np.diag(solution.covariance) * prior).sum())
    return max(float(linear.residuals.present.sum()) - determined, 1.0)


def _correlation(noise_model: NoiseModel) -> float:
    if not noise_model.discrepancy > NEGLIGIBLE_DISCREPANCY:
        return float("nan")
    decades = any(is_logarithmic(name) for name in noise_model.outputs)
    return noise_model.discrepancy_length / (1.0 if decades else LINEAR_COORDINATE_LENGTH)
