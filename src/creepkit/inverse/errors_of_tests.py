"""Errors that tests usually have, in the covariance under which the values of a law are found.

Those of the perturbations (see inverse.perturbations) that the settings name, settings.usual_errors, are in the
covariance under which values are found by likelihood: with s their effects on the residuals, one standard deviation of
the usual size each,

    C = C0 + sum of s s',

one s for each test of what its tests have independently, one s over all tests of what an instrument has in all of them,
which no number of tests averages out. C0 has the scatter of rates between tests with its expected square, given the
tests: temperatures and loads that are off in each by itself are part of it, and counted once. So tests count by how
exactly they are known, and the covariance of the values, (J'C^-1 J + P)^-1, includes the errors; a further test never
widens it. The noise model, and what a law is judged by, has the scatter as estimated. Values that are not found by
likelihood stay as they are, and their covariance is that under C.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.noise_covariance import effective_sample_size
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT
from creepkit.inverse.perturbation import Perturbation
from creepkit.inverse.perturbations import of_lengths_and_instruments, rate_slopes
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.residuals import life_sensitivity
from creepkit.inverse.uncertainty.laplace_approximation import (
    covariance_of_values,
    known_to_freedom,
    positive_semidefinite,
)
from creepkit.inverse.uncertainty.rate_scatter import rate_scatter
from creepkit.inverse.variance_components import LinearisedProblem, restricted_log_likelihood

LIFE_SHARES = (0.0, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Shares of the scatter of rupture times that are tried as a scatter of lives in curves."""


RATE, LIFE = "rate of a test", "life of a test"
"""Kinds of what is included beside lengths and instruments, each test by itself: ln rate by temperatures and loads,
where no nuisance lets rates scatter; the scatter of lives, as estimated of rupture times, in curves that are followed
to rupture."""


def errors_of_tests(
    problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem, noise_model: NoiseModel, among: int = 1
) -> tuple[Perturbation, ...]:
    """Errors at x (unknowns,), of which those count that the settings include; none where they include none.

    Those of lengths and instruments, then RATE and LIFE. among : how many tests there are, with others than these.
    """
    included, tests = problem.settings.included_errors, max(among, len(problem.histories))
    if not included:
        return ()
    kinds = {n.kind for n in problem.settings.nuisances}
    changes = {LIFE: effect_of_lives(problem, linear, noise_model)}
    if tests > 1 and "rate" not in kinds:
        kelvin = 0.0 if "temperature" in kinds else included.get("temperature", 0.0)
        sizes = np.array([kelvin, included.get("load", 0.0)])
        rates = np.linalg.norm(rate_slopes(problem, x) * sizes, axis=1)
        changes[RATE] = rates[:, None] * linear.residuals.log_rate_sensitivity
    made = [Perturbation(kind, 1.0, "", residual_change=s, tests=tests, included=True) for kind, s in changes.items()]
    own = [one for one in made if one.residual_change.any()]
    return (*of_lengths_and_instruments(problem, x, linear, among), *own)


def effect_of_lives(problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel) -> Floats:
    """(tests, observations) change of residuals by the scatter of lives, one standard deviation, beside that of rates.

    What rupture times miss a law by is a scatter of lives as far as the curves show it: specimens may as well break
    before the law's creep runs away, at whatever rate. Of LIFE_SHARES of it the one is taken that makes the readings
    likeliest, at the optimum of the linear problem.
    """
    lives = noise_model[RUPTURE_OUTPUT].misfit if RUPTURE_OUTPUT in noise_model.outputs else 0.0
    effect = lives * life_sensitivity(linear.residuals, problem.observations)
    if not effect.any():
        return effect

    def log_likelihood(share: float) -> float:
        affected = replace(linear, residuals=linear.residuals.with_effects([share * effect]))
        return restricted_log_likelihood(affected, noise_model)

    return effect * max(LIFE_SHARES, key=log_likelihood)


def with_expected_scatter(
    problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel
) -> NoiseModel:
    """The noise model with the root of the expected square of the scatter of ln rate between tests.

    Few tests hardly show how they scatter, as by temperatures and loads that are off in each by itself; see
    uncertainty.rate_scatter for the prior. As it is where no nuisance has it or that states it, and of one test, whose
    error is the common one.
    """
    scatter = replace(rate_scatter(problem, linear, noise_model), members={})
    if len(problem.histories) == 1 or scatter.known is not None:
        return noise_model
    return replace(noise_model, rate=max(noise_model.rate, scatter.posterior.mean_square("test") ** 0.5))


def covariances_of_values_with_errors(
    linear: LinearisedProblem, noise_model: NoiseModel, errors: Sequence[Perturbation], working_noise: NoiseModel | None
) -> tuple[Floats, Floats, Floats]:
    """(unknowns, unknowns) covariance of x by the tests alone, what errors add to it, and what common ones add.

    noise_model : with the expected scatter of rates. working_noise : under which values were found that are not by
    likelihood.
    """

    def under(some: Sequence[Perturbation], noise: NoiseModel = noise_model) -> Floats:
        return covariance_of_values(linear.with_errors(some), noise, working_noise)

    alone, with_common, with_all = (under(some) for some in ((), [e for e in errors if e.common], errors))
    of_all, of_common = (positive_semidefinite(c - alone, np.sqrt(np.diag(c))) for c in (with_all, with_common))
    of_readings = replace(noise_model, rate=0.0)
    freedom = effective_sample_size(linear.residuals, of_readings) - linear.precision.size
    return known_to_freedom(alone, under((), of_readings), freedom), of_all, of_common
