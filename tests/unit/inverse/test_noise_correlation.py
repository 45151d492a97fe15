"""Noise of two outputs that is correlated in each frame: generalised least squares, intervals, chi-square."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.observation_vector import thinned_history
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.settings import IdentificationSettings
from helpers.correlated_noise import BARS, LAW, NOISE, PAIR, least_squares, measured
from helpers.steady_rate_predictor import Steady
from helpers.two_outputs_predictor import TwoOutputs

SETTINGS = IdentificationSettings(
    starts=1, sobol_points=8, frames=60, weights="likelihood", nuisances=(), usual_errors="none"
)


def exactly_known(problem: LeastSquaresProblem) -> tuple[LeastSquaresProblem, NoiseModel]:
    """The problem under the stated noise and no other."""
    noise = NoiseModel({name: OutputNoise(NOISE[name]) for name in problem.observations.outputs})
    start = problem.coordinates.u(LAW.to_internal({"A": 1e-15})[0])
    return problem.with_covariance(CovarianceFactor.of_residuals(problem.residuals(start), noise)), noise


@pytest.mark.parametrize("rho", [0.0, 0.9, -0.9, 0.5])
def test_the_optimum_is_that_of_generalised_least_squares(rho: float) -> None:
    tests = measured(rho, seed=3)
    problem, _ = exactly_known(LeastSquaresProblem.from_histories(LAW, tests, TwoOutputs(), SETTINGS))
    start = problem.coordinates.u(LAW.to_internal({"A": 1e-15})[0])
    minimum = problem.minimise(start)
    factor, sd = least_squares(tests, rho)
    rate = float(np.exp(problem.coordinates.theta(minimum.x)[0])) / 1e-15
    assert rate == pytest.approx(factor, rel=1e-6)
    information = float((problem.jacobian(minimum.x) ** 2).sum())
    assert rate * information**-0.5 == pytest.approx(sd, rel=1e-4)
    # and the correlation matters: without it both would be others
    if rho:
        assert abs(least_squares(tests, 0.0)[0] - factor) > 0.01 * sd
        assert sd != pytest.approx(least_squares(tests, 0.0)[1], rel=0.05)


def test_intervals_hold_where_the_correlation_is_stated() -> None:
    """95 % intervals over 60 draws at a correlation of 0.9: 54 or more hold the truth (p of fewer: 0.02).

    One that takes the outputs for independent holds it less or more often than it says, and errs by more.
    """
    held, errors, widths = 0, [], []
    for seed in range(60):
        fit = identify(LAW, measured(0.9, seed), TwoOutputs(), settings=SETTINGS)
        one = fit.estimates[0]
        held += one.low <= 1e-15 <= one.high
        errors.append(float(np.log(fit.values["A"] / 1e-15)))
        widths.append(0.5 * float(np.log(one.high / one.low)))
    assert held >= 54
    sd = least_squares(measured(0.9, 0), 0.9)[1]
    assert np.std(errors) == pytest.approx(sd, rel=0.25)
    assert np.median(widths) == pytest.approx(1.96 * sd, rel=0.25)
    independent = least_squares(measured(0.9, 0), 0.0)[1]
    assert sd < 0.7 * independent  # outputs that move against each other, with noise that does not, say more


def test_a_missing_frame_and_an_unknown_noise_leave_the_other_pairs() -> None:
    """NaN in one output, or in its standard deviation: the covariance is that of the pairs that are left."""
    test = measured(0.8, seed=5)[0]
    width, sd = np.array(test.outputs["width"]), np.array(test.standard_deviation["width"])
    width[[3, 7]], sd[11] = np.nan, np.nan
    test = test.replace(
        outputs={**test.outputs, "width": width}, standard_deviation={**test.standard_deviation, "width": sd}
    )
    assert test.noise_correlation == {PAIR: 0.8}
    problem = LeastSquaresProblem.from_histories(LAW, [test], TwoOutputs(), SETTINGS)
    observations = problem.observations
    assert observations.present.sum() == 58
    residuals, noise = problem.residuals(problem.bounds.centre), NoiseModel({n: OutputNoise(NOISE[n]) for n in PAIR})
    c = CovarianceFactor.of_residuals(residuals, noise).blocks[0]
    shown = np.sqrt(np.diag(c))
    for k in range(58):
        same = np.flatnonzero(observations.frame_index[0, :58] == observations.frame_index[0, k])
        others = np.setdiff1d(same, [k])
        correlations = c[k, :58] / (shown[k] * shown[:58])
        np.testing.assert_allclose(correlations[others], 0.8, rtol=1e-4)
        np.testing.assert_allclose(np.delete(correlations, same), 0.0, atol=1e-12)
    assert sorted(np.bincount(observations.frame_index[0, :58]))[:2] == [1, 1]


class Logarithmic(Steady):
    """Predicts a strain, whose transform is a logarithm, and an amplitude, in proportion to it."""

    outputs = ("strain", "amplitude")

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        found = Steady().predict(law, theta, histories, sensitivities=True)
        gain = np.array([1.0, 40.0])
        jacobian = found.jacobian * gain[:, None] if sensitivities else None
        return replace(found, values=found.values * gain, outputs=self.outputs, jacobian=jacobian)


def test_the_correlation_goes_through_the_transforms_of_outputs() -> None:
    """To first order: of draws of the noise of a strain, in its logarithm, with that of an amplitude."""
    bar, rho = BARS[0], -0.7
    strain = bar.outputs["strain"]
    sd = {"strain": 0.01 * strain, "amplitude": np.full(strain.size, 0.02)}
    test = bar.replace(
        outputs={"strain": strain, "amplitude": 40.0 * strain}, standard_deviation=sd,
        noise_correlation={("strain", "amplitude"): rho},
    )  # fmt: skip
    problem = LeastSquaresProblem.from_histories(LAW, [test], Logarithmic(), SETTINGS)
    observations = problem.observations
    pairs = zip(observations.outputs, observations.noise, strict=True)
    noise = NoiseModel({name: OutputNoise(float(size)) for name, size in pairs})
    c = CovarianceFactor.of_residuals(
        problem.residuals(problem.coordinates.u(LAW.to_internal({"A": 1e-15})[0])), noise
    ).blocks[0]
    errors = np.linalg.cholesky([[1.0, rho], [rho, 1.0]]) @ np.random.default_rng(0).standard_normal((20000, 2, 1))
    for frame in (12, 29):
        places = [int(np.flatnonzero((observations.output_index[0] == k) & (observations.frame_index[0] == frame))[0])
                  for k in (0, 1)]  # fmt: skip
        drawn = np.array([
            observations.transforms[k].forward(test.outputs[n][frame] + sd[n][frame] * errors[:, k, 0])
            for k, n in enumerate(observations.outputs)
        ])  # fmt: skip
        np.testing.assert_allclose(c[np.ix_(places, places)], np.cov(drawn), rtol=0.05)


def test_thinned_and_planned_histories_keep_it() -> None:
    test = measured(0.6, seed=2)[0]
    assert thinned_history(test, 10).noise_correlation == {PAIR: 0.6}
    plan = test.replace(times=np.array([1.0, 2.0]), outputs={}, standard_deviation={})
    assert plan.noise_correlation == {PAIR: 0.6}
    assert plan.replace(outputs={"amplitude": np.zeros(2)}).noise_correlation == {}


# ---- noise that is not stated ---------------------------------------------------------------------------------------


def unstated(rho: float, seed: int, told: bool):
    """Tests whose noise is correlated by rho; told : whether they say so."""
    return [
        h.replace(standard_deviation={}, noise_correlation={PAIR: rho} if told else {}) for h in measured(rho, seed)
    ]


@pytest.mark.parametrize("rho", [0.9, -0.9])
def test_the_correlation_acts_where_the_noise_is_estimated(rho: float) -> None:
    """Estimates and intervals are those of generalised least squares with the noise that was planted.

    Over four draws the mean half width lies within 25 % of 1.96 of its standard deviations (the noise is estimated from
    60 frames of each output, some 9 %), and the likelihood is higher with the correlation than without.
    """
    widths, gains = [], []
    for seed in range(4):
        told = identify(LAW, unstated(rho, seed, True), TwoOutputs(), settings=SETTINGS)
        silent = identify(LAW, unstated(rho, seed, False), TwoOutputs(), settings=SETTINGS)
        one = told.estimates[0]
        widths.append(0.5 * float(np.log(one.high / one.low)))
        gains.append(told.log_likelihood - silent.log_likelihood)
        assert np.isfinite([one.low, one.value, one.high]).all()
    sd = least_squares(measured(rho, 0), rho)[1]
    assert np.mean(widths) == pytest.approx(1.96 * sd, rel=0.25)
    assert min(gains) > 20.0  # 60 frames of two outputs at 0.9: about -30 ln(1 - 0.81) = 50
