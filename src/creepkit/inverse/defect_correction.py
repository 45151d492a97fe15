"""Defect correction: the error of a predictor, found by one run of a more exact one and added to its predictions.

With y(x) the predictor and z(x) a more exact one (the same specimen on a finer mesh in smaller steps, or the specimen
that a surrogate stands for), z(x) is nearly y(x) + [z(x0) - y(x0)] in the neighbourhood of x0: the defect changes
slowly with the values, so that it is worth one run, and the last steps of an estimate then are those of the more exact
predictor. What is left of the defect is taken as a tenth of it, correlated as the curve is (measured for the bulge
test: 0.5 um of the amplitude before, 0.03 um after; tests/benchmarks/dimple_accuracy.py measures the same error).

Source: K. Bohmer, P. Hemker and H. Stetter, The defect correction approach, Computing Supplementum 5 (1984) 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.variance_components import scaled_inverse
from creepkit.records import History, Prediction, Predictor, Status

REMAINING_DEFECT = 0.1
"""Of a defect, standard deviation of what is left of it."""


@dataclass(frozen=True)
class NumericalError:
    """What the predictor of an identification was found to be wrong by at the optimum, and that it was corrected.

    predictor, refined : names of the predictor and of the more exact one.
    size : {output: rms of the difference}, in the output's unit. noises : the largest of them, in noises.
    shift : by how much the values would differ without the correction: the largest change of an unknown, in its
        posterior standard deviations, to first order.
    incomplete : tests that the more exact predictor does not follow to their end; they are not corrected.
    settled : whether another correction would move the values by less than half a standard deviation.
    """

    predictor: str
    refined: str
    size: Mapping[str, float]
    noises: float
    shift: float
    incomplete: tuple[str, ...] = ()
    settled: bool = True

    @property
    def confirms(self) -> bool:
        """Whether the more exact predictor reaches the end of every test, and values stay where it has corrected."""
        return self.settled and not self.incomplete

    @property
    def remaining(self) -> dict[str, float]:
        """{output: standard deviation} of what is left of the error, in the output's unit."""
        return {name: REMAINING_DEFECT * size for name, size in self.size.items()}


def correct_defect(problem: LeastSquaresProblem, x: Floats) -> tuple[LeastSquaresProblem, NumericalError | None]:
    """The problem with its predictor corrected at x (unknowns,) by the more exact one, if it has one."""
    refined = problem.predictor.refined()
    if refined is None or problem.observations.followed_to_rupture.any():
        return problem, None
    observations, prediction = problem.observations, problem.predicted_by(refined, x)
    coarse = _predicted(problem, x)
    exact = observations.select_outputs(prediction.values, prediction)[0]
    complete = np.isin(prediction.status[0], (Status.COMPLETE, Status.OUTSIDE_DOMAIN))
    known = observations.present & complete[:, None] & np.isfinite(exact) & np.isfinite(coarse)
    correction = np.where(known, exact - coarse, 0.0)
    incomplete = tuple(h.name for h, whole in zip(problem.histories, complete, strict=True) if not whole)
    sizes, noises = {}, 0.0
    for position, name in enumerate(observations.outputs):
        mask, noise = known & (observations.output_index == position), float(observations.noise[position])
        if mask.any():
            sizes[name] = float(np.sqrt(np.mean(correction[mask] ** 2)))
            noises = max(noises, sizes[name] / noise) if noise > 0 else noises
    label = f"{refined.label} on a finer mesh" if refined.label == problem.predictor.label else refined.label
    error = NumericalError(problem.predictor.label, label, sizes, noises, float("nan"), incomplete)
    return problem.with_correction(correction), error


def with_cheaper_predictor(problem: LeastSquaresProblem, x: Floats, predictor: Predictor) -> LeastSquaresProblem:
    """The problem through a cheaper predictor, which is corrected at x (unknowns,) so that it agrees there."""
    observations, cheaper = problem.observations, problem.with_predictor(predictor)
    own, others = (
        observations.inverse(p.residuals(x).values + observations.transformed_values) for p in (problem, cheaper)
    )
    return cheaper.with_correction(np.asarray(own - others))


def with_correction_at_frames(
    problem: LeastSquaresProblem, histories: Sequence[History], prediction: Prediction
) -> Prediction:
    """A prediction of one candidate at all frames of histories, with the problem's correction interpolated in time."""
    if problem.correction is None:
        return prediction
    values = np.array(prediction.values)
    for test, position, index in problem.observations.series:
        name, times = problem.observations.outputs[position], histories[test].times
        if name in prediction.outputs:
            correction = np.interp(times, problem.observations.times[test, index], problem.correction[test, index])
            values[0, test, : times.size, prediction.outputs.index(name)] += correction
    return replace(prediction, values=values)


def _predicted(problem: LeastSquaresProblem, x: Floats) -> Floats:
    """(tests, observations) what the predictor itself says at x (unknowns,), in the output's unit."""
    observations, problem = problem.observations, problem.about_rates(x, None)
    corrected = observations.inverse(problem.residuals(x).values + observations.transformed_values)
    return corrected if problem.correction is None else corrected - problem.correction


def shift_of_values(problem: LeastSquaresProblem, x: Floats, change: Floats) -> float:
    """By how much values at x (unknowns,) would move with another prediction: the largest, in standard deviations.

    change : (tests, observations) of the prediction, in the output's unit. To first order, under its covariance.
    """
    jacobian = problem.jacobian(x)
    covariance = scaled_inverse(jacobian.T @ jacobian + np.diag(12.0 / problem.bounds.width**2))
    whitened = problem.whiten(problem.residuals(x).offset_sensitivity * change)
    shift = covariance @ (jacobian[: whitened.size].T @ whitened)
    return float(np.abs(shift / np.sqrt(np.diag(covariance))).max())
