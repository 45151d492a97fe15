"""What the tests that were made know of an identified law: the information of its unknowns, and draws of its posterior.

The unknowns q = (u, s) of a law are its conditioned coordinates u and the nuisance parameters s that tests share, such
as the modulus of an alloy. The tests that were made know them with the information

    A = J'C^-1 J + P,

their own nuisance parameters integrated out. Everything is predicted by the reduced-order model where there is one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm, qmc

from creepkit.arrays import Floats
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, Residuals
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.selection.challenges import AlteredLaw
from creepkit.inverse.variance_components import scaled_inverse
from creepkit.records import History, Predictor, dimension_named


def predictor_of(fit: Identification) -> Predictor:
    """What planned tests are predicted with: the reduced-order model where the predictor of the fit has one."""
    assert fit.predictor is not None
    return fit.predictor.reduced_order_model() or fit.predictor


@dataclass(frozen=True, eq=False)
class KnownLaw:
    """An identified law and what the tests that were made know of its unknowns q = (u, s).

    measured : the problem of these tests, through the predictor of planned tests. x : (unknowns,) its values.
    shared : positions among x of the nuisance parameters that tests share. information : (q, q) A.
    chi_square : of the tests that were made, under the covariance of the noise model. sandwich : (q, q) T, with
    which T A^-1 T' has the covariance of the fit: other than 1 where values were not found by likelihood.
    held : (q, q) information of what is held beside the tests, such as the share of a second law.
    """

    fit: Identification
    measured: LeastSquaresProblem
    noise_model: NoiseModel
    x: Floats
    shared: tuple[int, ...]
    information: Floats
    chi_square: float
    sandwich: Floats
    held: Floats

    @classmethod
    def from_altered(cls, best: Identification, altered: AlteredLaw, noise_model: NoiseModel) -> KnownLaw:
        """A law altered as a challenge of a verdict says, with what is held of it."""
        u, e = np.split(altered.x, [altered.problem.parameter_count])
        nuisances = tuple(replace(n, value=float(value)) for n, value in zip(best.nuisances, e, strict=True))
        fit = replace(
            best,
            law=altered.problem.law,
            u=u,
            covariance=np.eye(u.size),
            error_covariance=None,
            nuisances=nuisances,
            samples=None,
            problem=None,
            linearised=None,
        )
        return cls.from_identification(fit, noise_model, altered.constraints.T @ altered.constraints)

    @classmethod
    def from_identification(cls, fit: Identification, noise_model: NoiseModel, held: Floats | float = 0.0) -> KnownLaw:
        """The information of the tests that were made, under a noise model, and of what is held of the unknowns."""
        predictor, count = predictor_of(fit), fit.u.size
        problem = LeastSquaresProblem.from_histories(fit.law, fit.histories, predictor, fit.settings, fit.reference)
        nuisances = problem.nuisance_parameters
        if fit.nuisances:
            sd = np.array([n.prior_sd for n in fit.nuisances], float)
            problem = problem.with_nuisances(replace(nuisances, sd=sd))
        residuals = fit.residuals_of(problem)
        factor = CovarianceFactor.of_residuals(residuals, noise_model)
        information = _information(problem, residuals, factor, count) + held
        shared = tuple(count + k for k, n in enumerate(nuisances.nuisances) if n.scope != "test")
        kept = [*range(count), *shared]
        marginal = scaled_inverse(scaled_inverse(information)[np.ix_(kept, kept)])
        is_altered = bool(np.any(held))
        sandwich = np.eye(len(marginal)) if is_altered else _sandwich(fit.by_tests_alone.covariance, marginal)
        chi_square = float((factor.whiten(residuals.values) ** 2).sum())
        of_kept = np.broadcast_to(held, information.shape)[np.ix_(kept, kept)]
        return cls(fit, problem, noise_model, fit.x, shared, marginal, chi_square, sandwich, of_kept)

    @property
    def size(self) -> int:
        """Number of parameters of the law, the first of q."""
        return self.fit.u.size

    def draws(self, count: int, seed: int) -> Floats:
        """(draws, q) deviations from the estimates, of the posterior: its samples where there are some, else normal.

        Values beyond a bound are put on it; s is drawn given u.
        """
        p, A = self.size, self.information
        unit = norm.ppf(np.clip(qmc.Sobol(A.shape[0], seed=seed).random(count), 1e-6, 1 - 1e-6))
        if self.fit.samples is not None:
            positions = np.linspace(0, len(self.fit.samples) - 1, count).round().astype(int)
            of_u = self.fit.samples[positions] - self.fit.u
        else:
            of_u = unit[:, :p] @ np.linalg.cholesky(scaled_inverse(A)[:p, :p]).T
        bounds = self.measured.bounds
        of_u = np.clip(self.fit.u + of_u, bounds.lower[:p], bounds.upper[:p]) - self.fit.u
        if not self.shared:
            return np.asarray(of_u)
        spread = scaled_inverse(A[p:, p:])
        of_s = unit[:, p:] @ np.linalg.cholesky(spread).T - of_u @ (A[:p, p:] @ spread)
        return np.concatenate([of_u, of_s], axis=1)

    def expansion(self, deviations: Floats) -> Expansion:
        """The chi-square of the tests that were made, to second order about deviations (draws, q) from the estimates.

        Derivatives to u are those at the draws, derivatives to nuisance parameters those at the estimates.
        """
        p, problem, e = self.size, self.measured, self.x[self.size :]
        residuals, nuisances = self.fit.residuals_of(problem), problem.nuisance_parameters
        assert residuals.jacobian is not None
        own = [k for k in range(p, self.x.size) if k not in self.shared]
        of_own = residuals.jacobian[..., own]
        sd = np.minimum(nuisances.sd, (nuisances.high - nuisances.low) / np.sqrt(12.0))
        effects = compact_effects(of_own * sd[[k - p for k in own]]) if own else None
        factor = CovarianceFactor.of_residuals(
            replace(residuals, random_effect_sensitivities=effects), self.noise_model
        )
        shift = of_own @ (e - nuisances.mean)[[k - p for k in own]]
        of_s = residuals.jacobian[..., list(self.shared)]
        points = np.concatenate([np.zeros((1, deviations.shape[1])), deviations])
        values, jacobian = problem.with_fixed_nuisances(e).candidate_jacobian(self.fit.u + points[:, :p])
        prior = nuisances.precision[[k - p for k in self.shared]]
        centre = (e - nuisances.mean)[[k - p for k in self.shared]]
        precision = np.concatenate([12.0 / problem.bounds.width[:p] ** 2, prior])
        chi_square, gradient, information = [], [], []
        for point, r, J_u in zip(points, values, jacobian, strict=True):
            r, J = r + of_s @ point[p:] - shift, np.concatenate([J_u, of_s], axis=-1)
            weighted = factor.inverse_times(np.concatenate([r[..., None], J], axis=-1))
            from_prior = centre + point[p:]
            chi_square.append(float((r * weighted[..., 0]).sum() + prior @ from_prior**2))
            gradient.append(np.einsum("tep,te->p", J, weighted[..., 0]) + np.r_[np.zeros(p), prior * from_prior])
            information.append(np.einsum("tep,teq->pq", J, weighted[..., 1:]) + np.diag(precision) + self.held)
        return Expansion(np.array(chi_square[1:]) - chi_square[0], np.stack(gradient[1:]), np.stack(information[1:]))


@dataclass(frozen=True, eq=False)
class Expansion:
    """Chi-squares to second order: c + 2 g'd + d'A d about each draw.

    chi_square : (draws,) c, above that of the estimates; gradient : (draws, q) g; information : (draws, q, q) A.
    """

    chi_square: Floats
    gradient: Floats
    information: Floats


def _information(problem: LeastSquaresProblem, residuals: Residuals, factor: CovarianceFactor, count: int) -> Floats:
    assert residuals.jacobian is not None
    precision = np.concatenate([12.0 / problem.bounds.width[:count] ** 2, problem.nuisance_parameters.precision])
    weighted = factor.inverse_times(residuals.jacobian)
    return np.asarray(np.einsum("tep,teq->pq", residuals.jacobian, weighted) + np.diag(precision))


def _sandwich(covariance: Floats, information: Floats) -> Floats:
    """(q, q) T of a fit's covariance (parameters, parameters) and the information (q, q) of its tests."""
    count = len(covariance)
    result = np.eye(len(information))
    by_information = _cholesky(scaled_inverse(information)[:count, :count])
    result[:count, :count] = _cholesky(covariance) @ np.linalg.inv(by_information)
    return np.asarray(result)


def _cholesky(covariance: Floats) -> Floats:
    """(n, n) Cholesky factor of a covariance (n, n), whose scales may differ by many orders."""
    scale = np.sqrt(np.diag(covariance))
    return np.asarray(scale[:, None] * np.linalg.cholesky(covariance / np.outer(scale, scale)))


def nuisances_of_planned(law: KnownLaw, planned: Sequence[History], *, of_made: bool = False) -> NuisanceParameters:
    """The nuisance parameters of planned tests beside those of the tests that were made, for the planned ones alone.

    A planned test is of the length that it states, whatever was measured of others. of_made : for all of the tests.
    """
    measured, made = law.measured, law.measured.histories
    nuisances = NuisanceParameters.from_histories(law.fit.settings.nuisances, [*made, *planned], measured.predictor)
    spread = {n.kind: n.prior_sd for n in law.fit.nuisances}
    mean, sd = nuisances.mean.copy(), nuisances.sd.copy()
    by_name = {h.name: h for h in planned}
    for k, (n, owner) in enumerate(zip(nuisances.nuisances, nuisances.owners, strict=True)):
        sd[k] = spread.get(n.kind, sd[k])
        if n.is_length and n.scope == "test" and owner in by_name:
            length = dimension_named(measured.predictor.for_history(by_name[owner]), n.kind)
            mean[k] = by_name[owner].geometry.get(length.name, mean[k]) if length is not None else mean[k]
    first = 0 if of_made else len(made)
    index = {key: positions[first:] for key, positions in nuisances.test_index.items()}
    return replace(nuisances, mean=mean, sd=sd, test_index=index)


def values_of_nuisances(nuisances: NuisanceParameters, law: KnownLaw, deviation: Floats | None = None) -> Floats:
    """(nuisances,) as estimated, of planned tests their prior means; deviation : (shared,) from the estimates."""
    known = {(n.key, n.owner): n.value for n in law.fit.nuisances}
    if deviation is not None:
        shared = [law.fit.nuisances[k - law.size] for k in law.shared]
        known |= {(n.key, n.owner): n.value + float(d) for n, d in zip(shared, deviation, strict=True)}
    parameters = zip(nuisances.nuisances, nuisances.owners, nuisances.mean, strict=True)
    return np.array([known.get((n.key, owner), float(mean)) for n, owner, mean in parameters])


def compact_effects(effects: Floats) -> Floats:
    """(tests, observations, own effects) the effects of each test alone, in its first columns.

    effects : (tests, observations, effects) -.
    """
    counts = (np.abs(effects).sum(axis=1) > 0).sum(axis=1)
    compact = np.zeros((*effects.shape[:2], max(int(counts.max(initial=0)), 1)))
    for k, test in enumerate(effects):
        columns = np.flatnonzero(np.abs(test).sum(axis=0) > 0)
        compact[k, :, : columns.size] = test[:, columns]
    return compact
