"""Degrees of freedom of the variances that a rupture assessment adds up: Satterthwaite's for mixed models.

A predicted log time has a variance V(theta) that depends on the variances theta = (of a test, of each kind of effect),
through the covariance C of the location parameters as well as directly. With A the covariance of the estimated theta,
V has 2 V^2 / (g' A g) degrees of freedom, g = dV / dtheta (Giesbrecht, Burns (1985), Biometrics 41, 477; Fai, Cornelius
(1996), J. Stat. Comput. Simul. 54, 363; for a sum of independent variances this is Satterthwaite (1946), Biometrics
Bull. 2, 110). So a median time whose error comes from a few heats has about as many degrees of freedom as there are
heats less one, however many tests there are.

C, its derivatives and A (by the restricted likelihood) are those of the normal model of the tests that broke: with
Z the members of the effects, V = theta_0 I + sum theta_g Z_g Z_g'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats, frozen

MOST_LEVELS = 400
"""Of one kind of effect: with more its variance is taken for known."""

LEAST_INFORMATION = 1e-10
"""Of the largest: combinations of variances that the tests do not tell apart are left out of A."""


@dataclass(frozen=True, eq=False)
class VarianceFreedom:
    """What degrees of freedom are found from, for kinds 0 (tests of one heat) and 1, 2 ... (effects).

    variances : (kinds,) of log10 of time. uncertainty : (kinds, kinds), their covariance A.
    derivatives : (kinds, location, location), of the covariance of the location parameters by each variance.
    most : tests that broke less location parameters.
    """

    variances: Floats
    uncertainty: Floats
    derivatives: Floats
    most: float

    def of(self, location: Floats, *, between: bool = False, within: bool = False) -> Floats:
        """(points,) of the variance of a prediction, with that between effects and within heats where included.

        location : (points, location), derivatives of the prediction by the location parameters.
        """
        gradient = np.einsum("pi,kij,pj->pk", location, self.derivatives, location)
        gradient[:, 1:] += between
        gradient[:, 0] += within
        variance = gradient @ self.variances
        error = np.einsum("pk,kl,pl->p", gradient, self.uncertainty, gradient)
        with np.errstate(divide="ignore", invalid="ignore"):
            freedom = 2.0 * variance**2 / error
        return np.asarray(np.clip(np.where(np.isfinite(freedom), freedom, self.most), 1.0, self.most))

    def transformed(self, jacobian: Floats) -> VarianceFreedom:
        """The same for other location parameters, jacobian @ those of now.

        jacobian : (others, parameters).
        """
        derivatives = np.einsum("mi,kij,nj->kmn", jacobian, self.derivatives, jacobian)
        return VarianceFreedom(self.variances, self.uncertainty, frozen(derivatives), self.most)


def variance_freedom(
    columns: Floats, members: Sequence[Floats], within: float, between: Sequence[float]
) -> VarianceFreedom:
    """Of a linear model with effects.

    columns : (tests, location). members : (tests, levels) of zeros and ones, one for each kind. within : variance of a
    test. between : variances of effects.
    """
    kept = [(Z, v) for Z, v in zip(members, between, strict=True) if Z.shape[1] <= MOST_LEVELS]
    levels = [Z.shape[1] for Z, _ in kept]
    Z = np.column_stack([np.zeros((len(columns), 0)), *(Z for Z, _ in kept)])
    spread = np.repeat([v for _, v in kept], levels) if kept else np.zeros(0)
    parts = [slice(end - count, end) for count, end in zip(levels, np.cumsum(levels), strict=True)]

    def solved(right: Floats) -> Floats:
        """V^-1 right, by Woodbury's identity."""
        inner = within * np.eye(spread.size) + spread[:, None] * (Z.T @ Z)
        return np.asarray((right - Z @ np.linalg.solve(inner, spread[:, None] * (Z.T @ right))) / within)

    VX, VZ = solved(columns), solved(Z)
    C = np.linalg.pinv(columns.T @ VX, hermitian=True)
    PZ = VZ - VX @ (C @ (columns.T @ VZ))
    ZPZ = Z.T @ PZ
    # P V P = P and tr(P V) = tests - location give the traces that tests alone would need a square matrix for.
    mixed = [float((PZ[:, part] ** 2).sum()) for part in parts]
    free = float(max(len(columns) - columns.shape[1], 1))
    trace = (free - float(spread @ np.diag(ZPZ))) / within
    square = (trace - sum(v * m for (_, v), m in zip(kept, mixed, strict=True))) / within
    information = np.empty((len(kept) + 1, len(kept) + 1))
    information[0, 0] = square
    information[0, 1:] = information[1:, 0] = mixed
    for i, one in enumerate(parts):
        for j, other in enumerate(parts):
            information[i + 1, j + 1] = float((ZPZ[one, other] ** 2).sum())
    slopes = [C @ (VX.T @ VX) @ C]
    for part in parts:
        side = C @ (columns.T @ VZ[:, part])
        slopes.append(side @ side.T)
    uncertainty = np.linalg.pinv(0.5 * information, rcond=LEAST_INFORMATION, hermitian=True)
    return VarianceFreedom(frozen([within, *(v for _, v in kept)]), frozen(uncertainty), frozen(np.array(slopes)), free)
