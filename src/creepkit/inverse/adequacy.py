"""Adequacy: whether a law explains the tests to their noise, judged by noise that was not estimated from its misfit.

With r the residuals at the optimum under C0, the covariance of the noise that histories state (or that neighbouring
frames of each test show), of offsets and of scatter between tests,

    chi2 = r' C0^-1 r

has chi-square's distribution with n less the estimated unknowns degrees of freedom if the law is right and the noise
white; where the noise was estimated from nu frames, chi2 over its degrees of freedom has that of F. It is taken of all
outputs together and of each, and the least probability times their number is the p-value (Bonferroni). Below 0.3 % the
law leaves a model discrepancy: what must be added to the noise for the same chi-square. Offsets and the scatter of
rates were estimated from the same tests; a scatter beyond a factor of 2.7, or that bends over the stress, is misfit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import f

from creepkit.arrays import Floats
from creepkit.inverse.known_noise import KnownNoise, how_to_state_noise
from creepkit.inverse.largest_deviation import LargestDeviation, largest_deviation
from creepkit.inverse.noise_covariance import CovarianceFactor, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.nuisance_plausibility import ImplausibleNuisance
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.inverse.scatter_of_lives import with_scatter_of_lives
from creepkit.inverse.unmodelled_effects import UnmodelledEffect, with_random_effects
from creepkit.inverse.variance_components import LinearisedProblem, LinearSolution
from creepkit.records import History, is_logarithmic, output_unit

SIGNIFICANCE = 0.003
"""p-value below which a law does not explain the tests: three standard deviations of a normal one."""

IMPLAUSIBLE_CHI_SQUARE = 0.05
"""Reduced chi-square below which the noise that was stated is questioned: 4.5 times what the frames show."""

LARGEST_SCATTER = 1.0
"""Of ln rate between tests, a factor of 2.7: more is no scatter of one alloy."""

TREND_SIGNIFICANCE, FEWEST_TREND_TESTS = 0.01, 5
"""p-value below which rates of tests bend over the stress, and the tests that it takes to see that."""

NOTEWORTHY_EXPECTATION = 1.05
"""Mean reduced chi-square of a right law from which on it is said beside the one that was found."""

LARGEST_SHOWN_P_VALUE = 0.99
"""p-values above are shown as such: the least of several times their number is cut at 1."""

AdequacyVerdict = Literal["explains", "leaves a discrepancy", "cannot be judged"]


@dataclass(frozen=True)
class OutputAdequacy:
    """One output of all tests.

    frames : how many values count. noise : typical standard deviation of one, in the output's unit; noise_source :
    "stated" by the histories, or "estimated" from neighbouring frames. chi_square : over its degrees of freedom.
    p_value : of a larger one by chance. discrepancy : rms of predicted less measured beyond noise, in the output's
    unit, offsets and the scatter of rates and rupture lives taken out; 0 where there is nothing.
    """

    output: str
    frames: int
    noise: float
    noise_source: Literal["stated", "estimated"]
    chi_square: float
    p_value: float
    discrepancy: float

    @property
    def discrepancy_in_noises(self) -> float:
        """The discrepancy over the noise, each frame's over its own; 0 where there is no discrepancy."""
        return float(np.sqrt(max(self.chi_square - 1.0, 0.0))) if self.discrepancy > 0 else 0.0


@dataclass(frozen=True)
class Adequacy:
    """Whether a law explains the tests to their noise.

    verdict : "explains", "leaves a discrepancy" or "cannot be judged". outputs : one by one; those without known noise
    are missing. chi_square : of all of them, over `freedom`, its degrees of freedom. p_value : the least of all and of
    each, times their number. correlation : of what is left, as a share of the test (of outputs that span decades: the
    ln of a factor in time); NaN where nothing is. largest : where the law misses most; None if nothing is known.
    remedies : unmodelled effects, such as "a thickness of 0.01 mm", with any of which the law would explain the tests.
    rate_scatter : standard deviation of ln rate between tests, which was estimated from them, and rate_trend_p_value :
        of a bend of these rates over stress, by which a law shows that it misses the dependence on stress.
    implausible : nuisances that lie far from their priors, without which the law would not explain the tests.
    expected_chi_square : what `chi_square` is in the mean if the law is right: above one where noise is estimated from
        few frames. not_judged : the outputs, where nothing can be judged, and few_frames : the tests, each with how
        many frames it has, where these are too few to show the noise.
    """

    verdict: AdequacyVerdict
    outputs: tuple[OutputAdequacy, ...]
    chi_square: float
    freedom: float
    p_value: float
    correlation: float
    largest: LargestDeviation | None
    remedies: tuple[str, ...] = ()
    rate_scatter: float = 0.0
    rate_trend_p_value: float = 1.0
    implausible: tuple[ImplausibleNuisance, ...] = ()
    expected_chi_square: float = 1.0
    not_judged: tuple[str, ...] = ()
    few_frames: tuple[tuple[str, int], ...] = ()

    @property
    def explains(self) -> bool:
        """Whether the law explains the tests to their noise."""
        return self.verdict == "explains"

    def judges(self, output: str) -> bool:
        """Whether the noise of an output is known well enough to judge a law by."""
        return any(one.output == output for one in self.outputs)

    @property
    def rejects(self) -> bool:
        """Whether the law leaves what noise does not explain: its values describe the law and not the tests."""
        return self.verdict == "leaves a discrepancy"

    @property
    def explains_plausibly(self) -> bool:
        """Whether it explains them with nuisances of plausible size."""
        return self.explains and not self.implausible

    @property
    def qualification(self) -> str:
        """What follows "explains the tests" where it takes nuisances of implausible size; "" where it does not."""
        if not self.implausible:
            return ""
        more = len(self.implausible) - 1
        others = f" (and {more} more such nuisance{'s' * (more > 1)})" if more else ""
        return f" only with {self.implausible[0].description}{others}"

    @property
    def discrepancy_in_noises(self) -> float:
        """The largest discrepancy of an output, over its noise."""
        return max((o.discrepancy_in_noises for o in self.outputs), default=float("nan"))

    @property
    def _chi_square_text(self) -> str:
        expected = ""
        if self.expected_chi_square > NOTEWORTHY_EXPECTATION:
            expected = f" (expected {self.expected_chi_square:.3g} for a correct law, as the noise itself is estimated)"
        return f"reduced chi-square {self.chi_square:.3g} with {self.freedom:.0f} degrees of freedom{expected}"

    @property
    def _p_value_text(self) -> str:
        """The p-value; where it is the least of several, how many."""
        p, count = self.p_value, len(self.outputs)
        several = f" (Bonferroni, {count + 1} comparisons)" if count > 1 else ""
        if p > LARGEST_SHOWN_P_VALUE:
            return f"p > {LARGEST_SHOWN_P_VALUE:g}{several}"
        if p <= 1e-12:
            return f"p < 1e-12{several}"
        return f"p = {p:.{2 if self.explains else 1}g}{several}"

    def __getitem__(self, output: str) -> OutputAdequacy:
        for one in self.outputs:
            if one.output == output:
                return one
        raise KeyError(output)

    def __str__(self) -> str:
        """One sentence: the verdict, with what is left and where."""
        if self.verdict == "cannot be judged":
            return f"cannot be judged: {how_to_state_noise(self.not_judged, self.few_frames)}"
        source = " and ".join(dict.fromkeys(o.noise_source for o in self.outputs))
        if self.explains:
            slow = np.isfinite(self.correlation)
            correlated = "; what is left is autocorrelated, noise or the law's own" if slow else ""
            scatter = ""
            if self.rate_scatter > 0:
                scatter = f", with rates of tests that scatter by {100 * self.rate_scatter:.2g} %"
            if self.chi_square < IMPLAUSIBLE_CHI_SQUARE:
                scatter += " (far larger than what the frames show: check its unit)"
            found = f"{self._chi_square_text}, {self._p_value_text}{correlated}"
            return f"explains the tests to their {source} noise{self.qualification}{scatter}: {found}"
        parts = [
            f"{o.discrepancy:.2g}{' ' + output_unit(o.output) if output_unit(o.output) else ''} of {o.output} "
            f"({o.discrepancy_in_noises:.2g} times its {o.noise_source} noise)"
            for o in sorted(self.outputs, key=lambda o: -o.discrepancy_in_noises)
            if o.discrepancy > 0
        ]
        if self.rate_scatter > LARGEST_SCATTER:
            parts.append(f"rates of tests that scatter by a factor of {np.exp(self.rate_scatter):.2g}")
        elif self.rate_trend_p_value < TREND_SIGNIFICANCE:
            parts.append(f"rates of tests that bend over the stress (p = {self.rate_trend_p_value:.1g})")
        where = f"; most in {self.largest}" if self.largest is not None else ""
        if self.remedies:
            where += f"; it would explain them with {' or with '.join(self.remedies)}, which nobody modelled"
        rest = f"leaves {' and '.join(parts) or 'more than noise'} unexplained"
        return f"{rest} ({self._chi_square_text}, {self._p_value_text}){where}"


def adequacy_of(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    predictor_errors: Mapping[str, float],
    histories: Sequence[History],
    known: KnownNoise | None = None,
) -> Adequacy:
    """The adequacy of a law at the optimum of a problem.

    linear : the problem made linear there. noise_model : of its estimate, for offsets and scatter between tests.
    predictor_errors : {output: standard deviation} of what the predictor is wrong by, in the output's unit.
    histories : with all frames. known : the noise that these show, where it was found before.
    """
    observations = problem.observations
    linear = with_scatter_of_lives(linear, observations, noise_model)
    known = (known or KnownNoise.of_histories(observations, histories)).where(linear.residuals.offset_sensitivity > 0)
    if not known.judged.any():
        nan = float("nan")
        nothing = Adequacy("cannot be judged", (), nan, 0.0, nan, nan, None, not_judged=observations.outputs)
        return replace(nothing, few_frames=known.few_frames)
    residuals = _of_judged(linear.residuals, known)
    independent = _independent_noise(observations, known, noise_model, predictor_errors)
    judged_problem = replace(linear, residuals=residuals)
    solution = _within_bounds(judged_problem, CovarianceFactor.of_residuals(residuals, independent))
    white = _white_part(residuals, solution, independent)
    share_of_freedom = _freedom(judged_problem, solution) / float(known.judged.sum())
    contributions = solution.residuals * solution.weighted_residuals
    marginal = _marginal_contributions(residuals, solution, independent)
    outputs = []
    for position, name in enumerate(observations.outputs):
        mask = known.judged & (observations.output_index == position)
        if not mask.any():
            continue
        freedom = share_of_freedom * float(mask.sum())
        reduced = float(marginal[mask].sum()) / freedom
        p_value = known.chance_of_larger(reduced, share_of_freedom, mask)
        noise = float(np.median(known.sd[mask]))
        # In its unit from the deviations themselves: their share of chi-square is another where noise varies.
        square = float((white[mask] ** 2).mean()) / share_of_freedom * max(1.0 - 1.0 / reduced, 0.0)
        discrepancy = float(np.sqrt(square))
        source: Literal["stated", "estimated"] = "stated" if observations.stated[position] else "estimated"
        outputs.append(OutputAdequacy(name, int(mask.sum()), noise, source, reduced, p_value, discrepancy))
    freedom = share_of_freedom * float(known.judged.sum())
    reduced = float(contributions[known.judged].sum()) / freedom
    pooled = known.chance_of_larger(reduced, share_of_freedom, known.judged)
    p_values = [pooled, *(o.p_value for o in outputs)] if len(outputs) > 1 else [pooled]
    p_value = min(1.0, len(p_values) * min(p_values))
    # Outputs that are each within chance may be beyond it together: all of them have then left something.
    alone = any(o.p_value < SIGNIFICANCE for o in outputs)
    left = [p_value < SIGNIFICANCE and (o.p_value < SIGNIFICANCE or not alone) for o in outputs]
    outputs = [o if kept else replace(o, discrepancy=0.0) for o, kept in zip(outputs, left, strict=True)]
    scatter, trend = _scatter_of_rates(problem, linear.residuals, noise_model)
    explained = p_value >= SIGNIFICANCE and scatter <= LARGEST_SCATTER and not trend < TREND_SIGNIFICANCE
    return Adequacy(
        "explains" if explained else "leaves a discrepancy",
        tuple(outputs),
        reduced,
        freedom,
        p_value,
        _correlation(noise_model),
        largest_deviation(observations, known, white, histories),
        rate_scatter=scatter,
        rate_trend_p_value=trend,
        expected_chi_square=known.expected(share_of_freedom, known.judged),
    )


def adequacy_with_remedies(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    predictor_errors: Mapping[str, float],
    histories: Sequence[History],
    effects: Sequence[UnmodelledEffect],
) -> Adequacy:
    """The same, with those of the unmodelled effects named with which the law would explain the tests."""
    known = KnownNoise.of_histories(problem.observations, histories)
    adequacy = adequacy_of(problem, linear, noise_model, predictor_errors, histories, known)
    if not adequacy.rejects:
        return adequacy
    remedies = [
        effect.description
        for effect in effects
        if adequacy_of(
            problem, with_random_effects(linear, [effect]), noise_model, predictor_errors, histories, known
        ).explains
    ]
    return replace(adequacy, remedies=tuple(remedies))


def _scatter_of_rates(
    problem: LeastSquaresProblem, residuals: Residuals, noise_model: NoiseModel
) -> tuple[float, float]:
    """Standard deviation of ln rate between tests, and the p-value of a bend of it over stress; 0 and 1 for none.

    The scatter was estimated from the same tests: a law that misses the dependence on stress makes it, and it then
    bends over the stress. The p-value is that of the square of ln stress in a regression (F test).
    """
    rates = predicted_random_effects(residuals, noise_model)[1]
    stresses = np.log([float(np.median(reference_stresses(h, problem.predictor))) for h in problem.histories])
    if not noise_model.rate > 0:
        return 0.0, 1.0
    if len(rates) < FEWEST_TREND_TESTS or np.unique(stresses.round(3)).size < 3:
        return noise_model.rate, 1.0
    x = stresses - stresses.mean()
    squares = [
        float(((rates - design @ np.linalg.lstsq(design, rates, rcond=None)[0]) ** 2).sum())
        for design in (np.stack([x**k for k in range(degree + 1)], axis=1) for degree in (1, 2))
    ]
    freedom = len(rates) - 3
    ratio = (squares[0] - squares[1]) / max(squares[1] / freedom, 1e-300)
    return noise_model.rate, float(f.sf(ratio, 1.0, freedom))


def _of_judged(residuals: Residuals, known: KnownNoise) -> Residuals:
    """The residuals of observations that are judged, tests of equal weight; the others are not there."""
    assert residuals.jacobian is not None
    mask = known.judged & residuals.present
    return replace(
        residuals,
        values=np.where(mask, residuals.values, 0.0),
        jacobian=np.where(mask[..., None], residuals.jacobian, 0.0),
        offset_sensitivity=np.where(mask, residuals.offset_sensitivity, 0.0),
        log_rate_sensitivity=np.where(mask, residuals.log_rate_sensitivity, 0.0),
        present=mask,
        test_weights=np.ones(len(mask)),
        relative_noise=known.sd,
    )


def _independent_noise(
    observations: ObservationVector, known: KnownNoise, noise_model: NoiseModel, predictor_errors: Mapping[str, float]
) -> NoiseModel:
    """Known noise (relative to one unit of the output), the predictor's error, and offsets and scatter of tests."""
    outputs = {}
    for name, transform in zip(observations.outputs, observations.transforms, strict=True):
        scale = getattr(transform, "scale", None)
        drift = predictor_errors.get(name, 0.0) / scale if scale else 0.0
        outputs[name] = OutputNoise(1.0, offset=noise_model[name].offset, drift=drift, correlation_length=1.0)
    return NoiseModel(outputs, noise_model.rate)


def _marginal_contributions(residuals: Residuals, solution: LinearSolution, noise_model: NoiseModel) -> Floats:
    """(tests, observations) whose sum over an output is its own chi-square.

    That of outputs whose noise is correlated is not a sum of theirs: each is then taken as if it alone were known.
    """
    if residuals.shared_noise is None:
        return solution.residuals * solution.weighted_residuals
    out = np.zeros_like(solution.residuals)
    for position in range(len(noise_model.outputs)):
        mask = residuals.present & (residuals.output_index == position)
        factor = CovarianceFactor.of_residuals(replace(residuals, present=mask), noise_model)
        out[mask] = factor.whiten(solution.residuals)[mask] ** 2
    return out


def _within_bounds(linear: LinearisedProblem, factor: CovarianceFactor) -> LinearSolution:
    """The optimum of the linear problem within its bounds, or the point itself where the step gains nothing."""
    solution, residuals = linear.solve(factor), linear.residuals
    present = residuals.present
    columns = np.concatenate([linear.jacobian, residuals.values[..., None]], axis=-1)
    whitened = factor.whiten(columns)[present]
    root_prior = np.sqrt(linear.precision[linear.free])
    matrix = np.concatenate([whitened[:, :-1], np.diag(root_prior)])
    target = -np.concatenate([whitened[:, -1], root_prior * linear.prior_residual[linear.free]])
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    low, high = linear.step_bounds[:, linear.free] * scale
    step = lsq_linear(matrix / scale, target, bounds=(np.minimum(low, -1e-12), np.maximum(high, 1e-12))).x / scale
    moved = residuals.values + linear.jacobian @ step
    candidates = [(values, factor.inverse_times(values)) for values in (moved, residuals.values)]
    values, weighted = min(candidates, key=lambda pair: float((pair[0] * pair[1]).sum()))
    return replace(solution, residuals=values, weighted_residuals=weighted)


def _freedom(linear: LinearisedProblem, solution: LinearSolution) -> float:
    """Observations less the unknowns that they determine: n - p + tr(M P), with M the covariance and P the priors."""
    prior = linear.precision[linear.free]
    determined = prior.size - float((np.diag(solution.covariance) * prior).sum())
    return max(float(linear.residuals.present.sum()) - determined, 1.0)


def _correlation(noise_model: NoiseModel) -> float:
    from creepkit.inverse.noise_model import NEGLIGIBLE_DISCREPANCY
    from creepkit.inverse.observation_vector import LINEAR_COORDINATE_LENGTH

    if not noise_model.discrepancy > NEGLIGIBLE_DISCREPANCY:
        return float("nan")
    decades = any(is_logarithmic(name) for name in noise_model.outputs)
    return noise_model.discrepancy_length / (1.0 if decades else LINEAR_COORDINATE_LENGTH)


def _white_part(residuals: Residuals, solution: LinearSolution, noise_model: NoiseModel) -> Floats:
    """(tests, observations) what is left in the output's unit once offsets and rates of tests are taken out."""
    white = residuals.white_covariance_times(solution.weighted_residuals, noise_model)
    return np.asarray(white / np.where(residuals.offset_sensitivity > 0, residuals.offset_sensitivity, 1.0))
