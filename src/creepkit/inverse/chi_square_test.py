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
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from creepkit.inverse.adequacy import LARGEST_SCATTER, Adequacy, OutputAdequacy
from creepkit.inverse.explanation import Explanation
from creepkit.inverse.judged_residuals import judged_residuals
from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.largest_deviation import largest_deviation
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.perturbation import Perturbation
from creepkit.inverse.perturbations import sizes_of_effect, with_random_effects
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.variance_components import LinearisedProblem
from creepkit.records import History, is_logarithmic

SIGNIFICANCE = 0.003
"""p-value below which a law does not explain the tests: three standard deviations of a normal one."""


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
    known = known or KnownNoise.of_histories(observations, histories)
    judged = judged_residuals(problem, linear, noise_model, predictor_errors, known)
    if judged is None:
        nan = float("nan")
        nothing = Adequacy("cannot be judged", (), nan, 0.0, nan, nan, None, not_judged=observations.outputs)
        return replace(nothing, few_frames=known.few_frames)
    known, share_of_freedom = judged.known, judged.share_of_freedom
    outputs = []
    for position, name in enumerate(observations.outputs):
        mask = known.judged & (observations.output_index == position)
        if not mask.any():
            continue
        freedom = share_of_freedom * float(mask.sum())
        reduced = float(judged.marginal[mask].sum()) / freedom
        p_value = known.chance_of_larger(reduced, share_of_freedom, mask)
        noise = float(np.median(known.sd[mask]))
        # In its unit from the deviations themselves: their share of chi-square is another where noise varies.
        square = float((judged.deviation[mask] ** 2).mean()) / share_of_freedom * max(1.0 - 1.0 / reduced, 0.0)
        discrepancy = float(np.sqrt(square))
        source: Literal["stated", "estimated"] = "stated" if observations.stated[position] else "estimated"
        outputs.append(OutputAdequacy(name, int(mask.sum()), noise, source, reduced, p_value, discrepancy))
    freedom = share_of_freedom * float(known.judged.sum())
    reduced = judged.reduced_chi_square(known.judged)
    pooled = known.chance_of_larger(reduced, share_of_freedom, known.judged)
    p_values = [pooled, *(o.p_value for o in outputs)] if len(outputs) > 1 else [pooled]
    p_value = min(1.0, len(p_values) * min(p_values))
    # Outputs that are each within chance may be beyond it together: all of them have then left something.
    alone = any(o.p_value < SIGNIFICANCE for o in outputs)
    left = [p_value < SIGNIFICANCE and (o.p_value < SIGNIFICANCE or not alone) for o in outputs]
    outputs = [o if kept else replace(o, discrepancy=0.0) for o, kept in zip(outputs, left, strict=True)]
    explained = p_value >= SIGNIFICANCE and not noise_model.rate > 0.99 * LARGEST_SCATTER
    return Adequacy(
        "explains" if explained else "leaves a discrepancy",
        tuple(outputs),
        reduced,
        freedom,
        p_value,
        _correlation(noise_model),
        largest_deviation(observations, known, judged.deviation, histories),
        rate_scatter=noise_model.rate,
        expected_chi_square=known.expected(share_of_freedom, known.judged),
        critical_chi_square=known.critical(SIGNIFICANCE / len(p_values), share_of_freedom, known.judged),
        smallest_p_value=min(p_values),
    )


def adequacy_with_remedies(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    predictor_errors: Mapping[str, float],
    histories: Sequence[History],
    effects: Sequence[Perturbation],
    explanations: tuple[Explanation, ...],
) -> Adequacy:
    """The same, rejected where rates of tests are explained otherwise, with effects that would explain the tests."""
    known = KnownNoise.of_histories(problem.observations, histories)
    adequacy = adequacy_of(problem, linear, noise_model, predictor_errors, histories, known)
    if not adequacy.rejects:
        return adequacy.with_explanations(explanations)
    remedies = [
        replace(
            effect, size=effect.size * float(np.abs(sizes_of_effect(linear, effect, noise_model)).max())
        ).description
        for effect in effects
        if not effect.common
        and adequacy_of(
            problem, with_random_effects(linear, [effect]), noise_model, predictor_errors, histories, known
        ).explains
    ]
    return replace(adequacy, remedies=tuple(remedies)).with_explanations(explanations)


def _correlation(noise_model: NoiseModel) -> float:
    from creepkit.inverse.noise_model import NEGLIGIBLE_DISCREPANCY
    from creepkit.inverse.observation_vector import LINEAR_COORDINATE_LENGTH

    if not noise_model.discrepancy > NEGLIGIBLE_DISCREPANCY:
        return float("nan")
    decades = any(is_logarithmic(name) for name in noise_model.outputs)
    return noise_model.discrepancy_length / (1.0 if decades else LINEAR_COORDINATE_LENGTH)
