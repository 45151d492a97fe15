"""What the tests that were made know of identified laws, and what these expect of planned tests.

The unknowns q = (u, s, c) of a law are its conditioned coordinates u, the nuisance parameters s that tests share, such
as the modulus of an alloy, and the errors c, in their standard deviations, that an instrument has in all tests alike:
those usual errors that intervals include (inverse.perturbations). The tests that were made know them with the
information

    A = J'C^-1 J + P,

their own nuisance parameters and errors integrated out. The outcome of a planned test is y = m + K (q - q_0) + e, all
over the Cholesky factor of its covariance: white noise, drift and discrepancy of the noise model, and as random effects
its own offset, its own rate, its own nuisance parameters with their priors, and its own usual errors. Afterwards the
information is A + K'K. Everything is predicted by the reduced-order model where there is one.

A ranking compares laws under one covariance, that of the law which explains the tests best. What is expected if a law
is true is therefore whitened by what that law predicts: noise depends on it where outputs are compared by logarithms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.stats import norm, qmc

from creepkit.arrays import Bools, Floats
from creepkit.inverse.identification import Identification
from creepkit.inverse.minimum_rates import with_minimum_rates
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, Residuals
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.perturbations import RATE, errors_of_tests, with_derivatives_to_lengths
from creepkit.inverse.problem import EvaluationCache, LeastSquaresProblem
from creepkit.inverse.reference_conditions import reference_condition
from creepkit.inverse.residuals import candidate_residuals
from creepkit.inverse.selection.challenges import AlteredLaw
from creepkit.inverse.variance_components import LinearisedProblem, scaled_inverse
from creepkit.records import History, Predictor, Status, dimension_named


def predictor_of(fit: Identification) -> Predictor:
    """What planned tests are predicted with: the reduced-order model where the predictor of the fit has one."""
    assert fit.predictor is not None
    return fit.predictor.reduced_order_model() or fit.predictor


@dataclass(frozen=True, eq=False)
class KnownLaw:
    """An identified law and what the tests that were made know of its unknowns q = (u, s).

    measured : the problem of these tests, through the predictor of planned tests. x : (unknowns,) its values.
    shared : positions among x of the nuisance parameters that tests share. information : (q, q) A.
    of_ranking : whether the usual errors of tests are those of a ranking of laws. errors : of these tests.
    chi_square : of the tests that were made, under the covariance of the noise model. sandwich : (q, q) T, with
    which T A^-1 T' has the covariance of the fit: other than 1 where values were not found by likelihood.
    held : (q, q) information of what is held beside the tests, such as the share of a second law.
    """

    fit: Identification
    measured: LeastSquaresProblem
    noise_model: NoiseModel
    x: Floats
    shared: tuple[int, ...]
    of_ranking: bool
    errors: UsualErrors
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
        return cls.from_identification(fit, noise_model, altered.constraints.T @ altered.constraints, of_ranking=True)

    @classmethod
    def from_identification(
        cls, fit: Identification, noise_model: NoiseModel, held: Floats | float = 0.0, *, of_ranking: bool = False
    ) -> KnownLaw:
        """The information of the tests that were made, under a noise model, and of what is held of the unknowns.

        of_ranking : whether the usual errors are those of a ranking of laws, and not those of intervals.
        """
        predictor, count = predictor_of(fit), fit.u.size
        problem = LeastSquaresProblem.from_histories(fit.law, fit.histories, predictor, fit.settings, fit.reference)
        problem = with_derivatives_to_lengths(problem)
        nuisances = problem.nuisance_parameters
        if fit.nuisances:
            sd = np.array([n.prior_sd for n in fit.nuisances], float)
            problem = problem.with_nuisances(replace(nuisances, sd=sd))
        linear = problem.linearised(fit.x)
        errors = UsualErrors.of(problem, linear, noise_model, len(fit.histories) + 1, of_ranking=of_ranking)
        residuals = linear.residuals.with_effects(errors.own)
        factor = CovarianceFactor.of_residuals(residuals, noise_model)
        unknowns = _with_columns(residuals.jacobian, errors.common.values())
        weighted, further = factor.inverse_times(unknowns), len(errors.common)
        of_x = np.pad(np.broadcast_to(held, (fit.x.size, fit.x.size)), (0, further))
        information = np.einsum("tep,teq->pq", unknowns, weighted) + of_x
        information += np.diag(np.concatenate([linear.precision, np.ones(further)]))
        shared = tuple(count + k for k, n in enumerate(nuisances.nuisances) if n.scope != "test")
        kept = [*range(count), *shared, *range(fit.x.size, fit.x.size + further)]
        marginal = scaled_inverse(scaled_inverse(information)[np.ix_(kept, kept)])
        sandwich = np.eye(len(marginal)) if np.any(held) else _sandwich(fit.covariance, marginal)
        chi_square = float((factor.whiten(residuals.values) ** 2).sum())
        known = (marginal, chi_square, sandwich, of_x[np.ix_(kept, kept)])
        return cls(fit, problem, noise_model, fit.x, shared, of_ranking, errors, *known)

    @property
    def size(self) -> int:
        """Number of parameters of the law, the first of q."""
        return self.fit.u.size

    def draws(self, count: int, seed: int) -> Floats:
        """(draws, q) deviations from the estimates, of the posterior: its samples where there are some, else normal.

        Of what a ranking compares, q = (u, s). Values beyond a bound are put on it; s is drawn given u.
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
        residuals, nuisances = problem.residuals(self.fit.x), problem.nuisance_parameters
        own = [k for k in range(p, self.x.size) if k not in self.shared]
        of_own = residuals.jacobian[..., own]
        sd = np.minimum(nuisances.sd, (nuisances.high - nuisances.low) / np.sqrt(12.0))
        effects = compact_effects(of_own * sd[[k - p for k in own]]) if own else None
        with_own = replace(residuals, random_effect_sensitivities=effects).with_effects(self.errors.own)
        factor = CovarianceFactor.of_residuals(with_own, self.noise_model)
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


class UsualErrors(NamedTuple):
    """What errors that tests usually have change of residuals, one standard deviation each.

    own : (tests, observations) each, of those that each test has by itself. common : {kind: (tests, observations)} of
    those that all tests have alike.
    """

    own: list[Floats]
    common: dict[str, Floats]

    @classmethod
    def of(
        cls, problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel, among: int, *,
        of_ranking: bool,
    ) -> UsualErrors:  # fmt: skip
        """Those that intervals include, of some tests among others; of a ranking of laws lengths of each test alone."""
        errors = [e for e in errors_of_tests(problem, linear, noise_model, among) if e.included]
        own = [e.residual_change for e in errors if not e.common and not (of_ranking and e.kind == RATE)]
        return cls(own, {e.kind: e.residual_change for e in errors if e.common and not of_ranking})


def _with_columns(jacobian: Floats, columns: Iterable[Floats]) -> Floats:
    """Derivatives (tests, observations, unknowns) and further columns (tests, observations)."""
    return np.concatenate([jacobian, *(column[..., None] for column in columns)], axis=-1)


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


def nuisances_of_planned(law: KnownLaw, planned: Sequence[History]) -> NuisanceParameters:
    """The nuisance parameters of planned tests beside those of the tests that were made, for the planned ones alone.

    A planned test is of the length that it states, whatever was measured of others.
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
    index = {key: positions[len(made) :] for key, positions in nuisances.test_index.items()}
    return replace(nuisances, mean=mean, sd=sd, test_index=index)


def values_of_nuisances(nuisances: NuisanceParameters, law: KnownLaw) -> Floats:
    """(nuisances,) as estimated, of planned tests their prior means."""
    known = {(n.key, n.owner): n.value for n in law.fit.nuisances}
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


CHUNK = 8
"""Planned tests that are predicted at once: between two chunks progress is reported, and a stop takes effect."""


@dataclass(frozen=True, eq=False)
class PlannedOutcome:
    """What one law expects of one planned test, whitened.

    mean : (data,) m; jacobian : (data, q) K. ruptures : whether it would rupture before its end. growth : of the
    leading output over the test, in noises of a frame; largest : of that output, in its unit.
    """

    mean: Floats
    jacobian: Floats
    ruptures: bool
    growth: float
    largest: float


@dataclass(frozen=True, eq=False)
class _Chunk:
    """What one law predicts of some planned tests.

    residuals : with zero in the place of what is measured, and as random effects the nuisance parameters and errors
    that each test has for itself. leading : (tests,) arrays of the leading output, in its unit. ruptures : (tests,).
    jacobian : (tests, observations, q) derivatives to q.
    """

    residuals: Residuals
    leading: list[Floats]
    ruptures: Bools
    jacobian: Floats


@dataclass(eq=False)
class PlannedOutcomes:
    """What some laws expect of planned tests, under the covariance of each that may be true; each test is done once.

    candidates : how many of the laws, the first, may be true; the rest are what a verdict has to exclude. None for all.
    """

    laws: Sequence[KnownLaw]
    progress: Callable[[str, int, int], None] | None = None
    candidates: int | None = None
    _known: dict[object, list[list[PlannedOutcome]]] = field(default_factory=dict)
    _drawn: dict[object, tuple[list[Floats], list[Floats], Bools]] = field(default_factory=dict)
    _covariances: dict[object, list[CovarianceFactor]] = field(default_factory=dict)

    def add(self, histories: Sequence[History]) -> None:
        """Predict the planned tests that are not known yet."""
        fresh = list({test_key(h): h for h in histories if test_key(h) not in self._known}.values())
        for start in range(0, len(fresh), CHUNK):
            chunk = [replace(h, name=f"plan {k}") for k, h in enumerate(fresh[start : start + CHUNK])]
            by_law = self._outcomes(chunk)
            for k, history in enumerate(fresh[start : start + CHUNK]):
                self._known[test_key(history)] = [[under[k] for under in outcomes] for outcomes in by_law]
            if self.progress is not None:
                self.progress("planned tests", min(start + CHUNK, len(fresh)), len(fresh))

    def of(self, histories: Sequence[History], law: int, under: int | None = None) -> tuple[Floats, Floats]:
        """Whitened means (data,) and derivatives (data, q) of some tests that were added, end to end.

        under : the law whose covariance it is, by default its own.
        """
        outcomes = [self._known[test_key(h)][law][law if under is None else under] for h in histories]
        return np.concatenate([o.mean for o in outcomes]), np.concatenate([o.jacobian for o in outcomes])

    def outcome(self, history: History, law: int) -> PlannedOutcome:
        """That of one test that was added."""
        return self._known[test_key(history)][law][law]

    def drawn(
        self, history: History, law: int, deviations: Floats, under: int | None = None
    ) -> tuple[Floats, Floats, Bools]:
        """Whitened predictions at draws of a law's posterior, their derivatives, and which draws rupture.

        deviations : (draws, q) from the estimates; s is taken as linear. under : as in `of`. Returns (draws, data),
        (draws, data, q) and (draws,).
        """
        key = test_key(history), law, deviations.tobytes()
        if key not in self._drawn:
            self._drawn[key] = self._evaluated_at(replace(history, name="plan 0"), law, deviations)
        means, jacobians, ruptures = self._drawn[key]
        covariance = law if under is None else under
        return means[covariance], jacobians[covariance], ruptures

    # ---- predictions -------------------------------------------------------------------------------------------------

    def _outcomes(self, chunk: Sequence[History]) -> list[list[list[PlannedOutcome]]]:
        """For each law, under the covariance of each law, the outcomes of each test of a chunk."""
        observations = self._observations(chunk)
        known = self.laws[0].noise_model  # the same for all; the derivatives are those of each law
        outputs = {name: known[name] for name in observations.outputs}
        noise_model = replace(known, outputs=outputs)
        predicted = [_predicted(law, chunk, observations, noise_model) for law in self.laws]
        factors = [CovarianceFactor.of_residuals(one.residuals, noise_model) for one in predicted[: self.candidates]]
        if len(chunk) == 1:
            self._covariances[test_key(chunk[0])] = factors
        return [[self._whitened(one, factor, observations) for factor in factors] for one in predicted]

    def _whitened(
        self, predicted: _Chunk, factor: CovarianceFactor, observations: ObservationVector
    ) -> list[PlannedOutcome]:
        """The outcomes of one law for each test of a chunk."""
        values = predicted.residuals.values + observations.transformed_values
        mean = factor.whiten(np.where(observations.present, values, 0.0))
        jacobian = factor.whiten(predicted.jacobian)
        outcomes = []
        for k, leading in enumerate(predicted.leading):
            mask = observations.present[k]
            noise = float(observations.noise[observations.output_index[k, observations.leading_output[k]][0]])
            growth, largest = (float(np.ptp(leading)), float(leading.max())) if leading.size else (0.0, 0.0)
            outcomes.append(
                PlannedOutcome(
                    mean[k][mask], jacobian[k][mask], bool(predicted.ruptures[k]), growth / max(noise, 1e-300), largest
                )
            )
        return outcomes

    def _observations(self, chunk: Sequence[History]) -> ObservationVector:
        """The observations of planned tests, with the transforms and the noise of those that were made."""
        base, predictor = self.laws[0].measured.observations, self.laws[0].measured.predictor
        planned = []
        for history in chunk:
            names = predictor.for_history(history).outputs_of_test(history) or base.outputs
            noise = {n: float(base.noise[base.outputs.index(n)]) for n in names if n in base.outputs}
            sd = {n: np.full(history.times.size, max(v, 1e-300)) for n, v in noise.items()}
            zero = {n: np.zeros(history.times.size) for n in noise}
            planned.append(history.replace(outputs=zero, standard_deviation=sd, rupture_time=None, unruptured=False))
        observations = ObservationVector.from_histories(planned, predictor).with_noise_of(base)
        return replace(observations, relative_noise=np.ones_like(observations.relative_noise))

    def _evaluated_at(self, history: History, law: int, deviations: Floats) -> tuple[list[Floats], list[Floats], Bools]:
        """Predictions at draws whitened by the covariance of each law, their derivatives, and which draws rupture."""
        known, observations = self.laws[law], self._observations([history])
        if test_key(history) not in self._covariances:
            outcomes = self._outcomes([history])
            self._known.setdefault(test_key(history), [[under[0] for under in by_law] for by_law in outcomes])
        mask, nuisances = observations.present[0], nuisances_of_planned(known, [history])
        u = known.fit.u + deviations[:, : known.size]
        predictor, tests = known.measured.predictor, (known.fit.law, known.fit.coordinates.theta(u), [history])
        given = nuisances.predictor_values(values_of_nuisances(nuisances, known))
        prediction = predictor.predict(*tests, nuisances=given, sensitivities=True)
        prediction = with_minimum_rates(prediction, predictor, *tests, given, sensitivities=True)
        values, internal = candidate_residuals(observations, prediction)
        assert internal is not None
        of_u = np.einsum("cep,cpq->ecq", internal[:, 0], known.fit.coordinates.jacobian(u))
        derivatives = of_u.reshape(1, mask.size, -1)
        transformed = np.where(observations.present, values + observations.transformed_values, 0.0)
        columns = np.moveaxis(transformed, 0, -1)
        means, jacobians = [], []
        for under, factor in enumerate(self._covariances[test_key(history)]):
            at_estimates = self._known[test_key(history)][law][under].jacobian
            jacobian = np.tile(at_estimates, (len(u), 1, 1))
            whitened = factor.whiten(derivatives)[0][mask].reshape(-1, len(u), known.size)
            jacobian[:, :, : known.size] = np.moveaxis(whitened, 1, 0)
            of_shared = deviations[:, known.size :] @ at_estimates[:, known.size :].T
            means.append(np.asarray(factor.whiten(columns)[0][mask].T + of_shared))
            jacobians.append(jacobian)
        return means, jacobians, np.isin(prediction.status[:, 0], ENDED)


ENDED = (int(Status.RUPTURED), int(Status.NOT_CONVERGED))
"""Status of tests that a prediction does not follow to their end."""


def test_key(history: History) -> tuple[object, ...]:
    """What a planned test is, whatever it is called."""
    temperature = history.temperature
    return (
        history.specimen,
        history.loading,
        temperature if isinstance(temperature, float) else (temperature.times.tobytes(), temperature.values.tobytes()),
        (*sorted(history.geometry.items()), *sorted(history.labels.items())),
        history.times.tobytes(),
    )


def _predicted(
    law: KnownLaw, planned: Sequence[History], observations: ObservationVector, noise_model: NoiseModel
) -> _Chunk:
    """What a law predicts of planned tests at its estimates, with derivatives."""
    made, nuisances, size = law.measured, nuisances_of_planned(law, planned), law.size
    conditions = np.array([reference_condition(history, made.predictor) for history in planned]).T
    problem = replace(
        made.with_nuisances(nuisances),
        histories=tuple(planned),
        observations=observations,
        conditions=conditions,
        evaluations=EvaluationCache(),
    )
    problem, x = with_derivatives_to_lengths(problem), np.append(law.fit.u, values_of_nuisances(nuisances, law))
    residuals, prediction = problem.residuals(x), problem.prediction(x)
    linear, among = problem.linearised(x, residuals), len(law.fit.histories) + 1
    errors = UsualErrors.of(problem, linear, noise_model, among, of_ranking=law.of_ranking)
    owners = list(zip((n.key for n in nuisances.nuisances), nuisances.owners, strict=True))
    of_made = made.nuisance_parameters
    made_owners = list(zip((n.key for n in of_made.nuisances), of_made.owners, strict=True))
    kept = (*range(size), *(size + owners.index(made_owners[k - size]) for k in law.shared))
    of_common = [errors.common.get(kind, np.zeros_like(residuals.values)) for kind in law.errors.common]
    names = {h.name for h in planned}
    own = [k for k, n in enumerate(nuisances.nuisances) if n.scope == "test" and nuisances.owners[k] in names]
    sd = np.minimum(nuisances.sd, (nuisances.high - nuisances.low) / np.sqrt(12.0))
    effects = compact_effects(residuals.jacobian[..., [size + k for k in own]] * sd[own]) if own else None
    present = observations.present
    of_own = replace(
        residuals,
        present=present,
        discrepancy_unit=np.where(present, observations.discrepancy_unit, 0.0),
        random_effect_sensitivities=effects,
    ).with_effects(errors.own)
    leading = []
    for k, history in enumerate(planned):
        outputs = made.predictor.for_history(history).outputs_of_test(history) or prediction.outputs
        values = prediction.output_of(k, outputs[0])  # the first grows with creep
        leading.append(values[np.isfinite(values)])
    return _Chunk(
        residuals=of_own,
        leading=leading,
        ruptures=np.isin(prediction.status[0], ENDED),
        jacobian=_with_columns(residuals.jacobian[..., kept], of_common),
    )
