"""Intervals of a restricted likelihood: their covariance, and the freedom that estimated scatter leaves them.

The variance v of a parameter is a function of the sizes of scatter, which are uncertain themselves, with the expected
information I of the restricted likelihood. Matching two moments of v gives the freedom 2 v^2 / (g' I^-1 g), g the
gradient of v (Satterthwaite (1946), Biometrics Bull. 2, 110; Kenward & Roger (1997), Biometrics 53, 983).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.covariance import covariance
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import LinearisedProblem, LinearSolution, scaled_inverse, inverse_covariances
from creepkit.inverse.scatter import NoiseModel, fixed_components
from creepkit.inverse.weighting import NEGLIGIBLE_DRIFT
from creepkit.records import Nuisance

LOG_COMPONENT_STEP = 1e-3
"""Of the logarithm of a size, for differences of the covariance, which is smooth in it."""
MINIMUM_FREEDOM = 3.0
"""Below this a quantile says nothing but that the scatter is unknown."""


def restricted_covariance(
    linearised: LinearisedProblem, noise_model: NoiseModel, nuisances: Sequence[Nuisance], fixed: Collection[tuple[str, str]] = ()
) -> tuple[Floats, float]:
    """Posterior covariance of x = (u, e), (unknowns, unknowns), and its degrees of freedom.

    stated : (output, source) of sizes that are known beside those that nuisances give.
    Unknowns at their bounds count here as all others: their intervals reach inwards.
    """
    unconstrained = replace(linearised, free=np.ones_like(linearised.free))
    inverses, _ = inverse_covariances(linearised.residuals, noise_model)
    solution = unconstrained.solve(inverses)
    components = [component for component in _estimated_components(noise_model, nuisances) if component not in fixed]
    if not components:
        return solution.covariance, 1e9
    covariance_derivatives = [_covariance_derivative(linearised.residuals, noise_model, *one) for one in components]
    projected = [np.einsum("tep,tef,tfq->pq", solution.weighted_jacobian, s, solution.weighted_jacobian, optimize=True) for s in covariance_derivatives]
    information = _information(solution, inverses, covariance_derivatives, projected)
    gradient = np.stack([np.diag(solution.covariance @ p @ solution.covariance) for p in projected], axis=1)
    component_covariance = scaled_inverse(information + 1e-9 * np.diag(np.diag(information)) + 1e-12 * np.eye(len(components)))
    variance_of_variance = np.einsum("pj,jk,pk->p", gradient, component_covariance, gradient)
    freedom = 2.0 * np.diag(solution.covariance) ** 2 / np.maximum(variance_of_variance, 1e-300)
    determined = (unconstrained.jacobian != 0).any(axis=(0, 1))
    return solution.covariance, float(np.clip(np.median(freedom[determined]), MINIMUM_FREEDOM, 1e9))


def _information(solution: LinearSolution, inverses: Floats, covariance_derivatives: Sequence[Floats], projected: Sequence[Floats]) -> Floats:
    """I_ij = tr(Q C_i Q C_j) / 2 with Q = C^-1 - B M B', B = C^-1 J: the values that tests share tie them together.

    slopes : C_i of every test; pulled : B' C_i B.
    """
    weighted = [inverses @ slope for slope in covariance_derivatives]
    left_products = [np.einsum("tep,tef->tpf", solution.weighted_jacobian, slope, optimize=True) for slope in covariance_derivatives]
    right_products = [a @ solution.weighted_jacobian for a in weighted]
    shared = [solution.covariance @ own for own in projected]
    information = np.empty((len(covariance_derivatives), len(covariance_derivatives)))
    for i, j in np.ndindex(information.shape):
        own_term = np.einsum("tef,tfe->", weighted[i], weighted[j])
        cross_term = np.einsum("pq,tqe,tep->", solution.covariance, left_products[j], right_products[i], optimize=True)
        information[i, j] = 0.5 * float(own_term - 2.0 * cross_term + np.trace(shared[i] @ shared[j]))
    return information


def _estimated_components(noise_model: NoiseModel, nuisances: Sequence[Nuisance]) -> list[tuple[str, str]]:
    """(output, source) of the sizes that the data were asked for; "" for the rate."""
    fixed = fixed_components(nuisances, list(noise_model.outputs))
    components = []
    for output, output_noise in noise_model.outputs.items():
        names = ["noise"] + ["misfit"] * (output_noise.misfit > 0) + ["offset"] * (output_noise.offset > 0)
        names += ["drift", "reach"] * (output_noise.drift > NEGLIGIBLE_DRIFT)
        components += [(output, name) for name in names if (output, name) not in fixed]
    return components + ([("", "rate")] if noise_model.rate > 0 and ("", "rate") not in fixed else [])


def _covariance_derivative(residuals: Residuals, noise_model: NoiseModel, output: str, name: str) -> Floats:
    """Derivative of the covariances to the logarithm of one size, (tests, entries, entries)."""

    def at(shift: float) -> Floats:
        factor = float(np.exp(shift))
        if not output:
            return covariance(residuals, replace(noise_model, rate=noise_model.rate * factor))
        return covariance(residuals, noise_model.with_output(output, **{name: getattr(noise_model[output], name) * factor}))

    return np.asarray((at(LOG_COMPONENT_STEP) - at(-LOG_COMPONENT_STEP)) / (2.0 * LOG_COMPONENT_STEP))
