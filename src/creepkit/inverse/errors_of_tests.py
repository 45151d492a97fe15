"""Errors that tests usually have, in the covariance under which the values of a law are found.

Those of the perturbations (see inverse.perturbations) that the settings name, settings.usual_errors, are in the
covariance under which values are found by likelihood: with s their effects on the residuals, one standard deviation of
the usual size each,

    C = C0 + sum of s s',

one s for each test of what its tests have independently, one s over all tests of what an instrument has in all of them,
which no number of tests averages out. So tests count by how exactly they are known, and the covariance of the values,
(J'C^-1 J + P)^-1, includes the errors; a further test never widens it. The noise model, and what a law is judged by, is
C0. Values that are not found by likelihood stay as they are, and their covariance is that under C.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.noise_model import NoiseModel, components_fixed_by_priors
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT
from creepkit.inverse.perturbation import Perturbation
from creepkit.inverse.perturbations import of_lengths_and_instruments, rate_slopes
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.residuals import life_sensitivity
from creepkit.inverse.uncertainty.laplace_approximation import covariance_of_values, positive_semidefinite
from creepkit.inverse.uncertainty.rate_scatter import redundant_rates
from creepkit.inverse.variance_components import LinearisedProblem, restricted_log_likelihood

SCATTER_NODES = 60
"""Standard deviations over which the scatter by errors of single tests is averaged."""


LIFE_SHARES = (0.0, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Shares of the scatter of rupture times that are tried as a scatter of lives in curves."""


RATE, LIFE = "rate of a test", "life of a test"
"""Kinds of what is included beside lengths and instruments, each test by itself: ln rate by temperatures and loads,
beyond the scatter that was estimated; the scatter of lives, as estimated of rupture times, in curves that are followed
to rupture."""


def errors_of_tests(
    problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem, noise_model: NoiseModel
) -> tuple[Perturbation, ...]:
    """Errors at x (unknowns,), of which those count that the settings include; none where they include none.

    Those of lengths and instruments, then RATE and LIFE.
    """
    if not problem.settings.included_errors:
        return ()
    rates = _usual_scatter(problem, x, linear, noise_model)
    changes = {
        RATE: rates[:, None] * linear.residuals.log_rate_sensitivity,
        LIFE: effect_of_lives(problem, linear, noise_model),
    }
    own = [
        Perturbation(kind, 1.0, "", residual_change=change, tests=len(rates), included=True)
        for kind, change in changes.items()
        if change.any()
    ]
    return (*of_lengths_and_instruments(problem, x, linear), *own)


def with_errors(linear: LinearisedProblem, errors: Sequence[Perturbation]) -> LinearisedProblem:
    """The linear problem with the errors in its covariance that are included."""
    return linear.with_effects(one for one in errors if one.included)


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


def _usual_scatter(
    problem: LeastSquaresProblem, x: Floats, linear: LinearisedProblem, noise_model: NoiseModel
) -> Floats:
    """(tests,) standard deviation of ln rate by temperatures and loads that are off in each test by itself.

    x : (unknowns,) the optimum. The standard deviation that the usual errors make is that of a prior of the scatter,
    half of a normal distribution: what is added is its mean square, given the estimate, beyond that; all of it where no
    test is redundant: where no combination of rates of tests is left that the law does not move. Nothing is added where
    the settings state the scatter, and in one test, whose error is the common one.
    """
    included, settings, tests = problem.settings.included_errors, problem.settings, len(problem.histories)
    if tests == 1 or ("", "rate") in components_fixed_by_priors(settings.nuisances, list(noise_model.outputs)):
        return np.zeros(tests)
    own = any(n.kind == "temperature" for n in settings.nuisances)
    kelvin, load = 0.0 if own else included.get("temperature", 0.0), included.get("load", 0.0)
    redundant = redundant_rates(linear, noise_model) if noise_model.rate > 0 else 0
    usual = rate_slopes(problem, x) ** 2 @ np.array([kelvin, load]) ** 2
    return np.sqrt([_mean_square(float(one), noise_model.rate, redundant) for one in usual])


def _mean_square(usual: float, estimate: float, redundant: int) -> float:
    """Mean square of ln rate by scatter of which `usual` is the prior variance, beyond the square of its estimate."""
    if not usual > 0:
        return 0.0
    s = np.geomspace(1e-3, 5.0, SCATTER_NODES) * np.sqrt(usual)
    log_weight = (1 - redundant) * np.log(s) - 0.5 * redundant * (estimate / s) ** 2 - 0.5 * s**2 / usual
    weight = np.exp(log_weight - log_weight.max())
    return max(float(weight @ s**2 / weight.sum()) - estimate**2, 0.0)


def error_covariances(
    linear: LinearisedProblem, noise_model: NoiseModel, errors: Sequence[Perturbation], working_noise: NoiseModel | None
) -> tuple[Floats, Floats]:
    """(unknowns, unknowns) what errors of tests add to the covariance of x: all of them, and those common to all tests.

    working_noise : under which values were found that are not by likelihood.
    """
    of_instruments = [one for one in errors if one.common]
    without, with_common, with_all = (
        covariance_of_values(with_errors(linear, some), noise_model, working_noise)
        for some in ((), of_instruments, errors)
    )
    of_all, of_common = (positive_semidefinite(c - without, np.sqrt(np.diag(c))) for c in (with_all, with_common))
    return of_all, of_common
