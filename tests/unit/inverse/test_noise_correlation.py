"""Noise of two outputs that is correlated in each frame: generalised least squares, intervals, chi-square."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, covariance
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.settings import IdentificationSettings
from helpers.correlated_noise import BARS, LAW, NOISE, least_squares, measured
from helpers.steady_rate_predictor import Steady
from helpers.two_outputs_predictor import TwoOutputs

SETTINGS = IdentificationSettings(starts=1, sobol_points=8, frames=60, weights="likelihood", nuisances=())


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


class Logarithmic(Steady):
    """Predicts a strain, whose transform is a logarithm, and an amplitude, in proportion to it."""

    outputs = ("strain", "amplitude")

    def predict(self, law, theta, histories, *, sensitivities=False):
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
    c = covariance(problem.residuals(problem.coordinates.u(LAW.to_internal({"A": 1e-15})[0])), noise)[0]
    errors = np.linalg.cholesky([[1.0, rho], [rho, 1.0]]) @ np.random.default_rng(0).standard_normal((20000, 2, 1))
    for frame in (12, 29):
        places = [int(np.flatnonzero((observations.output_index[0] == k) & (observations.frame_index[0] == frame))[0])
                  for k in (0, 1)]  # fmt: skip
        drawn = np.array([
            observations.transforms[k].forward(test.outputs[n][frame] + sd[n][frame] * errors[:, k, 0])
            for k, n in enumerate(observations.outputs)
        ])  # fmt: skip
        np.testing.assert_allclose(c[np.ix_(places, places)], np.cov(drawn), rtol=0.05)
