"""The least-squares problem that a law and histories pose, under a covariance of the observations.

With r(x) the transformed predictions less the transformed observations, L the Cholesky factors of their covariance and
p(x) the penalties of bounds and priors,

    chi2(x) = |L^-1 r(x)|^2 + |p(x)|^2,    x = (u, e),

u the conditioned coordinates of the law and e the explicit nuisance parameters of the tests. Search, local refinement,
ranking, intervals, posterior samples, term selection and the design of experiments share this one record.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.bounds import BoundPenalties, Bounds, constraint_points
from creepkit.inverse.compared_tests import compares_rupture_times
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.history_checks import check_creep, check_explicit_nuisances, check_histories
from creepkit.inverse.minimum_rates import check_minimum_rates, with_minimum_rates
from creepkit.inverse.noise_covariance import CovarianceFactor, stopped_tests
from creepkit.inverse.noise_model import NoiseModel, Residuals, StoppedTests
from creepkit.inverse.nuisance_parameters import NuisanceParameters, check_nuisance_law
from creepkit.inverse.observation_vector import ObservationVector, thinned_history
from creepkit.inverse.prediction_failures import PredictionFailures
from creepkit.inverse.reference_conditions import (
    ReferencePoint,
    condition_at,
    median_log_inverse_duration,
    median_log_strain_rate,
    reference_condition,
    simulated_stresses,
)
from creepkit.inverse.residuals import candidate_residuals, residuals_at_measured_values, residuals_of_prediction
from creepkit.inverse.search.local_refinement import Minimum, System, Tolerances, bounded_least_squares
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.variance_components import BOUND_TOLERANCE, LinearisedProblem
from creepkit.inverse.working_noise import WorkingNoiseEstimator, with_single_value_weight
from creepkit.kernels import lower, tension_point
from creepkit.language import CreepLaw
from creepkit.records import History, NuisanceValues, Prediction, Predictor
from creepkit.records.conditions import stated_condition

CACHED_EVALUATIONS = 4
"""Points whose residuals are cached: a search ends at one that it has evaluated, and the next begins there."""


ROUNDING = 1e-12
"""Least eigenvalue of a correlation, of a combination of unknowns that the tests do not tell."""


PRIOR_STRENGTH = 1e-4
"""Weak prior of each unknown about the middle of its bounds, in standard deviations of data per width of the bounds.

Far too weak to bias a value. Without it one unknown that changes nothing, as the share of the largest principal stress
in tension, leaves the Jacobian short of its rank, and scipy's steps are then always as long as the trust region.
"""


NOTEWORTHY_FACTOR = 0.002
"""Of ln rate of a test, from which on its curve is simulated with that factor: what is linear in it no longer holds."""


LARGEST_FACTOR = 1.0
"""Of ln rate of a test, up to which its curve is simulated with that factor: one that is further off may break at its
own rate before it was measured."""


class EvaluationCache:
    """Predictions and residuals of the last few points, and how many candidates were evaluated, all tests of each.

    failures : the candidates among them of which nothing was predicted.
    """

    def __init__(self) -> None:
        self.count, self.failures = 0, PredictionFailures()
        self._predictions: dict[bytes, Prediction] = {}
        self._residuals: dict[bytes, Residuals] = {}

    def prediction(self, key: bytes, nuisances: Iterable[str], evaluate: Callable[[], Prediction]) -> Prediction:
        """The prediction of a point with derivatives to nuisances, evaluated unless it is cached."""
        known = self._predictions.get(key)
        if known is None or not known.nuisance_jacobian.keys() >= {*nuisances}:
            self._predictions = dict([*self._predictions.items()][1 - CACHED_EVALUATIONS :])
            self._predictions[key] = evaluate()
            self.count += 1
        return self._predictions[key]

    def residuals(self, key: bytes, evaluate: Callable[[], Residuals]) -> Residuals:
        """The residuals of a point, made of its prediction unless they are cached."""
        if key not in self._residuals:
            self._residuals = dict([*self._residuals.items()][1 - CACHED_EVALUATIONS :])
            self._residuals[key] = evaluate()
        return self._residuals[key]


STATED_STEP = 0.1
"""Standard deviations, of central differences in conditions of the material."""


@dataclass(frozen=True, eq=False)
class LeastSquaresProblem:
    """A law against histories under a covariance; the unknowns are x = (u, e).

    histories : the tests at the frames that are compared. coordinates : of the law, u to its internal parameters.
    bounds : (unknowns,) of x. covariance_factor : of the residuals, in transformed outputs. robust : whether a single
        residual far off counts less, as in a search.
    conditions : (2, tests) MPa and K, the stress and the temperature of each test: of reference, before there are
        values by which it can be simulated.
    correction : (tests, observations) in the output's unit, what is added to predictions: the defect of the predictor
        against a more exact one (see inverse.defect_correction), or None.
    log_factors : (2, tests) ln of the factors on the rates of tests, and on those of their damage beside them, about
        which residuals are taken, None for the law's own. With b such a factor, r(x, b) the residuals and d their
        derivative to it, r(x, b) - d b is linear in a rate that scatters where r(x, 0) is not (Lindstrom & Bates
        (1990), Biometrics 46, 673).
    rate_shift : (tests, observations) -, d b of them, or None.
    stopped : what tests that were stopped before rupture say; None before any noise is known, as in a search: they
        then count where they lasted longer than is predicted.
    lengths : {length: (1, tests) mm} of the tests, to which predictions have derivatives as well.
    evaluations : the last predictions and residuals, shared by problems that differ in covariance, priors or correction
        alone.
    """

    histories: tuple[History, ...]
    predictor: Predictor
    coordinates: Coordinates
    observations: ObservationVector
    nuisance_parameters: NuisanceParameters
    bounds: Bounds
    settings: IdentificationSettings
    covariance_factor: CovarianceFactor
    conditions: Floats
    robust: bool = False
    correction: Floats | None = None
    log_factors: Floats | None = None
    rate_shift: Floats | None = None
    stopped: StoppedTests | None = None
    lengths: NuisanceValues = field(default_factory=dict)
    evaluations: EvaluationCache = field(default_factory=EvaluationCache, repr=False)

    @classmethod
    def from_histories(
        cls,
        law: CreepLaw,
        histories: Sequence[History],
        predictor: Predictor | Mapping[str, Predictor],
        settings: IdentificationSettings,
        reference: ReferencePoint | None = None,
    ) -> LeastSquaresProblem:
        """The checked problem of a law and histories, under a broad covariance that needs no prediction.

        reference : the reference point of the coordinates, where those of another identification are to be kept.
        """
        predictor = CompositePredictor.of(predictor)
        check_histories(law, histories, predictor)
        check_minimum_rates(law, histories, predictor)
        tests = [thinned_history(h, settings.frames) for h in histories]
        coordinates = Coordinates(law, reference or ReferencePoint.from_histories(tests, predictor, law))
        check_nuisance_law(settings.nuisances, law)
        nuisances = NuisanceParameters.from_histories(settings.nuisances, tests, predictor)
        rupture_times, accelerating = compares_rupture_times(law, settings), not nuisances.nuisances
        observations = ObservationVector.from_histories(
            tests, predictor, histories, rupture_times=rupture_times, accelerating=accelerating
        )
        check_creep(observations, tests)
        check_explicit_nuisances([n.kind for n in nuisances.nuisances], observations, tests, predictor)
        log_rate, log_internal_rate = median_log_strain_rate(tests, predictor), median_log_inverse_duration(tests)
        bounds = Bounds.from_law(law, coordinates, log_rate, log_internal_rate).with_nuisances(nuisances)
        noise = with_single_value_weight(WorkingNoiseEstimator(settings, observations).initial(), observations)
        covariance_factor = CovarianceFactor.of_residuals(residuals_at_measured_values(observations), noise)
        conditions = np.array([reference_condition(test, predictor) for test in tests]).T
        posed = (coordinates, observations, nuisances, bounds, settings, covariance_factor, conditions)
        return cls(tuple(tests), predictor, *posed)

    # ---- variants ------------------------------------------------------------------------------------------------

    def simulated_stresses(self, x: Floats) -> list[Floats]:
        """Of each test (stresses,) MPa, those that it goes through at unknowns x (unknowns,)."""
        values = self.coordinates.values(x[: self.parameter_count])
        return [simulated_stresses(self.law, values, h, self.predictor) for h in self.histories]

    def with_stresses(self, stresses: Sequence[Floats]) -> LeastSquaresProblem:
        """The same with other stresses; stresses : (stresses,) MPa that each test goes through."""
        return replace(self, conditions=np.array([*map(condition_at, stresses, self.histories)]).T)

    def with_law(self, law: CreepLaw) -> LeastSquaresProblem:
        """A law of some of this one's parameters, by name, on the same data and covariance."""
        positions = [self.law.names.index(name) for name in law.names]
        return replace(
            self,
            coordinates=Coordinates(law, self.coordinates.reference),
            bounds=self.bounds.of([*positions, *range(self.parameter_count, self.bounds.width.size)]),
            evaluations=EvaluationCache(),
        )

    def with_predictor(self, predictor: Predictor) -> LeastSquaresProblem:
        """The same with another predictor of the same outputs, and without correction."""
        return replace(self, predictor=predictor, correction=None, evaluations=EvaluationCache())

    def with_correction(self, correction: Floats | None) -> LeastSquaresProblem:
        """The same with a correction (tests, observations), in the output's unit, added to predictions."""
        return replace(self, correction=correction)

    def about_rates(self, x: Floats, log_factors: Floats | None) -> LeastSquaresProblem:
        """The same about other rates of tests near x (unknowns,); log_factors : (2, tests) as in the class, or None.

        None is larger than LARGEST_FACTOR; what has no coefficient of its own has no such factor.
        """
        coordinates = self.coordinates
        movable = np.array([coordinates.every_rate_has_coefficient, bool(coordinates.damage_rates)])
        if log_factors is None or not movable.any():
            return replace(self, log_factors=None, rate_shift=None)
        log_factors = np.clip(log_factors, -LARGEST_FACTOR, LARGEST_FACTOR) * movable[:, None]
        there = replace(self, log_factors=log_factors, rate_shift=None)
        residuals = there.residuals(x)
        shift = log_factors[0][:, None] * residuals.log_rate_sensitivity
        if residuals.log_life_sensitivity is not None:
            shift = shift + log_factors[1][:, None] * residuals.log_life_sensitivity
        return replace(there, rate_shift=shift)

    def about_stopped_tests(self, x: Floats, noise_model: NoiseModel) -> LeastSquaresProblem:
        """The same with what tests say that were stopped, about x (unknowns,), under a noise model."""
        stopped = self.observations.stopped_ends
        if not stopped.any():
            return self
        return replace(self, stopped=stopped_tests(self._residuals(x), noise_model, stopped))

    def with_covariance(self, covariance_factor: CovarianceFactor) -> LeastSquaresProblem:
        """The same under another covariance."""
        return replace(self, covariance_factor=covariance_factor)

    def with_nuisances(self, nuisance_parameters: NuisanceParameters) -> LeastSquaresProblem:
        """The same with other priors of the nuisance parameters, or with nuisance parameters that are fixed."""
        bounds = self.bounds.of(range(self.parameter_count)).with_nuisances(nuisance_parameters)
        return replace(self, nuisance_parameters=nuisance_parameters, bounds=bounds)

    def with_fixed_nuisances(self, e: Floats | None = None) -> LeastSquaresProblem:
        """The same with x = u alone; e : (nuisances,) their values, by default the prior means."""
        nuisances = self.nuisance_parameters
        return self.with_nuisances(replace(nuisances, mean=nuisances.mean if e is None else np.array(e), fixed=True))

    # ---- sizes -----------------------------------------------------------------------------------------------------

    @property
    def law(self) -> CreepLaw:
        """The law."""
        return self.coordinates.law

    @property
    def parameter_count(self) -> int:
        """Number of parameters of the law; x continues with the nuisance parameters."""
        return len(self.law.params)

    @cached_property
    def bound_penalties(self) -> BoundPenalties:
        """Penalties of bounds and constraints."""
        points = (
            constraint_points(self.histories, self.predictor, self.observations, self.coordinates.reference.strain)
            if self.law.constraints
            else []
        )
        return BoundPenalties(self.coordinates, points)

    # ---- residuals ---------------------------------------------------------------------------------------------------

    def residuals(self, x: Floats) -> Residuals:
        """Residuals of one x (unknowns,), with exact derivatives to x; the last few are cached."""
        residuals = self._residuals(x)
        if self.stopped is not None:
            return replace(residuals, values=residuals.values + self.stopped.shift, stopped=self.stopped)
        return residuals.where(residuals.present & ~(self.observations.stopped_ends & (residuals.values <= 0.0)))

    def _residuals(self, x: Floats) -> Residuals:
        """The same with ends of stopped tests as if these had broken then."""
        correction = b"" if self.correction is None else self.correction.tobytes()
        residuals = self.evaluations.residuals(self._key(x) + correction, lambda: self._evaluated(x))
        return replace(residuals, values=self._about_rates(residuals.values))

    def candidate_residuals(self, u: Floats) -> Floats:
        """(candidates, tests, observations) - of u (candidates, parameters), nuisance parameters at their means."""
        prediction = self._counted(u, jacobian=False)
        values = self._about_rates(candidate_residuals(self.observations, prediction, self.correction)[0])
        outlasted = np.where(self.observations.stopped_ends, np.maximum(values, 0.0), values)
        return outlasted if self.stopped is None else values + self.stopped.shift

    def candidate_jacobian(self, u: Floats) -> tuple[Floats, Floats]:
        """Residuals (candidates, tests, observations) of u (candidates, parameters), and their derivatives to u.

        The nuisance parameters stay at their means; it is one prediction but where tests are followed to rupture.
        """
        if self.observations.followed_to_rupture.any():
            single = self.with_fixed_nuisances()
            evaluated = [single.residuals(one) for one in u]
            return np.stack([r.values for r in evaluated]), np.stack([r.jacobian for r in evaluated])
        prediction = self._counted(u, jacobian=True)
        values, internal_jacobian = candidate_residuals(self.observations, prediction, self.correction)
        assert internal_jacobian is not None
        jacobian = np.einsum("ctep,cpq->cteq", internal_jacobian, self.coordinates.jacobian(u))
        present = self.observations.present
        return self._about_rates(values), np.where(present[..., None], jacobian, 0.0)

    def linearised(self, x: Floats, residuals: Residuals | None = None) -> LinearisedProblem:
        """The problem made linear at x (unknowns,), (u, e): weak priors of bounds on u, their own on e."""
        nuisances, bounds, count = self.nuisance_parameters, self.bounds, self.parameter_count
        precision = np.concatenate([12.0 / bounds.width[:count] ** 2, nuisances.precision])
        prior_residual = np.concatenate([np.zeros(count), x[count:] - nuisances.mean[: x.size - count]])
        tolerance, steps = BOUND_TOLERANCE * bounds.width, np.stack([bounds.lower - x, bounds.upper - x])
        free = (steps[0] < -tolerance) & (steps[1] > tolerance)
        return LinearisedProblem(residuals or self.residuals(x), precision, prior_residual, free, steps, x)

    def check_predicted(self, u: Floats) -> None:
        """FitError, with counts over all that were tried, where nothing is predicted at u (candidates, parameters)."""
        self.evaluations.failures.check(self._prediction(u, jacobian=False), self.histories, self.law.name)

    def _about_rates(self, values: Floats) -> Floats:
        """Residuals (..., tests, observations), less what the rates do about which they are taken."""
        present = self.observations.present
        return values if self.rate_shift is None else values - np.where(present, self.rate_shift, 0.0)

    def _counted(self, u: Floats, *, jacobian: bool) -> Prediction:
        self.evaluations.count += len(u)
        prediction = self._prediction(u, jacobian=jacobian)
        self.evaluations.failures.record(prediction, self.histories)
        return prediction

    def _prediction(self, u: Floats, *, jacobian: bool) -> Prediction:
        """Of u (candidates, parameters), the nuisance parameters at their means."""
        nuisances = replace(self.nuisance_parameters, fixed=True).predictor_values(np.zeros(0))
        return self._predicted(u, nuisances, jacobian)

    def _predicted(self, u: Floats, nuisances: NuisanceValues, sensitivities: bool) -> Prediction:
        if self.log_factors is not None:  # each test at its own rate
            u = np.repeat(u[:, None], len(self.histories), axis=1)
            rates, damage = self.log_factors[..., None]
            u[..., list(self.coordinates.coefficients)] += rates
            theta = self.coordinates.theta(u)
            theta[..., list(self.coordinates.damage_rates)] += damage
        else:
            theta = self.coordinates.theta(u)
        tests = (self.law, theta, self.histories)
        if self.observations.followed_to_rupture.any():
            prediction = self.predictor.predict_to_rupture(*tests, sensitivities=sensitivities)
        else:
            prediction = self.predictor.predict(*tests, nuisances=nuisances, sensitivities=sensitivities)
        return with_minimum_rates(prediction, self.predictor, *tests, nuisances, sensitivities=sensitivities)

    def prediction(self, x: Floats) -> Prediction:
        """What is predicted at one x (unknowns,), without correction, with derivatives; the last few are cached."""
        u, e = x[: self.parameter_count], x[self.parameter_count :]

        def evaluated() -> Prediction:
            nuisances = {**self.lengths, **self.nuisance_parameters.predictor_values(e)}
            prediction = self._predicted(u[None], nuisances, True)
            self.evaluations.failures.record(prediction, self.histories)
            return prediction

        return self.evaluations.prediction(self._key(x), self.lengths, evaluated)

    def predicted_by(
        self,
        predictor: Predictor,
        x: Floats,
        histories: Sequence[History] | None = None,
        given: NuisanceValues | None = None,
    ) -> Prediction:
        """What a predictor says of histories, by default those of the problem, at one x (unknowns,).

        given : {key: (1, tests)} nuisances beside or in place of those of the problem; with derivatives to all.
        """
        u, e = np.split(x, [self.parameter_count])
        nuisances = {**self.nuisance_parameters.predictor_values(e), **(given or {})}
        tests = (self.law, self.coordinates.theta(u)[None], histories or self.histories)
        return predictor.predict(*tests, nuisances=nuisances, sensitivities=given is not None)

    def _key(self, x: Floats) -> bytes:
        """What a prediction at x (unknowns,) depends on."""
        held = [self.nuisance_parameters.mean if self.nuisance_parameters.fixed else None, self.log_factors]
        return b"".join(b"" if values is None else values.tobytes() for values in (x, *held))

    def _evaluated(self, x: Floats) -> Residuals:
        u, prediction = x[: self.parameter_count], self.prediction(x)
        coordinates = self.coordinates
        residuals = residuals_of_prediction(
            self.observations,
            prediction,
            self.nuisance_parameters,
            (coordinates.coefficients if coordinates.every_rate_has_coefficient else None, coordinates.damage_rates),
            self.correction,
        )
        internal, nuisance_jacobian = np.split(residuals.jacobian, [u.size], axis=-1)
        jacobian = np.concatenate([internal @ coordinates.jacobian(u), nuisance_jacobian], axis=-1)
        return replace(residuals, jacobian=jacobian, rate_errors=self._stated_errors(u))

    def _stated_errors(self, u: Floats) -> Floats | None:
        """(tests,) standard deviation of ln rate by those of conditions of the material that tests state; None if none.

        u : (parameters,).
        """
        law, (stress, kelvin), reference = self.law, self.conditions, self.coordinates.reference
        stated = np.array([[stated_condition(h, one) for h in self.histories] for one in law.conditions], float)
        if not stated.size or not stated[..., 1].any():
            return None
        point = tension_point(law, stress, reference.strain, reference.time, kelvin)
        given = (*point, *self.coordinates.theta(u))
        steps = STATED_STEP * np.eye(len(stated))[..., None] * stated[..., 1]
        ends = [stated[:, None, :, 0] + side * np.moveaxis(steps, 0, 1) for side in (1, -1)]
        up, down = (lower(law, "numpy").internal_log_rate(*given, *end) for end in ends)
        return np.asarray(np.linalg.norm(up - down, axis=0) / (2 * STATED_STEP))

    # ---- chi-square ------------------------------------------------------------------------------------------------

    def whiten(self, values: Floats) -> Floats:
        """(data[, columns]) whitened rows of the data, of values (tests, observations[, columns])."""
        return self.covariance_factor.whiten(values)[self.observations.present]

    def system(self, x: Floats) -> tuple[Floats, Floats]:
        """(data + priors,) - whitened residuals at x (unknowns,) of data and nuisance parameters, with derivatives."""
        residuals, nuisances, count = self.residuals(x), self.nuisance_parameters, self.parameter_count
        data = self.whiten(np.concatenate([residuals.values[..., None], residuals.jacobian], axis=-1))
        root, e = np.sqrt(nuisances.precision), x[count:]
        priors = np.column_stack([root * (e - nuisances.mean[: e.size]), np.zeros((e.size, count)), np.diag(root)])
        rows = np.concatenate([data, priors])
        return rows[:, 0], rows[:, 1:]

    def jacobian(self, x: Floats) -> Floats:
        """(data + priors, unknowns) derivatives of the whitened residuals at x (unknowns,)."""
        return self.system(x)[1]

    def chi_square(self, x: Floats) -> float:
        """Sum of squares of the whitened residuals of data and priors at x (unknowns,), without penalties of bounds."""
        return float((self.system(x)[0] ** 2).sum())

    def limits(self, x: Floats) -> tuple[Floats, Floats]:
        """(limits,) how far x (unknowns,) is beyond the limits of the law (see BoundPenalties), with derivatives."""
        u = x[: self.parameter_count]
        rows = self.bound_penalties.jacobian(u)
        return self.bound_penalties.limits(u), np.pad(rows, ((0, 0), (0, x.size - u.size)))

    # ---- minima ------------------------------------------------------------------------------------------------------

    def minimise(
        self,
        start: Floats,
        *,
        fixed: Mapping[int, float] | None = None,
        additional: System | None = None,
        tolerances: Tolerances | None = None,
    ) -> Minimum:
        """Bounded least squares.

        start : (unknowns,) where it begins. fixed : {position: value} of unknowns that keep their values.
        additional : further residuals.
        """
        inside, bounds, held = np.array(start, float), self.bounds, dict(fixed or {})
        inside[list(held)] = list(held.values())
        inside = bounds.clip(inside)
        if held:
            ends = np.stack([bounds.lower, bounds.upper])
            ends[:, list(held)] = list(held.values())
            bounds = Bounds(*ends)

        weak = PRIOR_STRENGTH / self.bounds.width

        def system(x: Floats) -> tuple[Floats, Floats]:
            values, jacobian = self.system(x)
            further = [] if additional is None else [additional(x)]
            parts = zip((values, jacobian), (weak * (x - self.bounds.centre), np.diag(weak)), *further, strict=True)
            values, jacobian = (np.concatenate(part) for part in parts)
            return values, jacobian

        if not all(np.isfinite(part).all() for part in system(inside)):
            raise FitError(
                f"law '{self.law.name}': its prediction is no number where a refinement begins; narrow the bounds of "
                "its parameters, or give more starts"
            )
        scale, nuisances = 0.1 * self.bounds.width, self.nuisance_parameters
        if nuisances.size:
            scale[-nuisances.size :] = np.minimum(nuisances.sd, self.bounds.width[-nuisances.size :])
        where = bounds, scale, tolerances or Tolerances(), self.limits
        minimum = bounded_least_squares(system, inside, *where, robust=self.robust)
        return replace(minimum, whitened_residuals=minimum.whitened_residuals[: self.observations.count])

    def within_bounds(self, x: Floats) -> Floats:
        """x (unknowns,) or the nearest point whose values lie within the bounds of the law (see Coordinates)."""
        u = self.coordinates.within_bounds(x[: self.parameter_count])
        return self.bounds.clip(np.concatenate([u, x[self.parameter_count :]]))

    def constrained(self, start: Floats, target: Floats, free: Bools, covariance: Floats) -> Floats:
        """(unknowns,) the point within the bounds and constraints of the law that is least far from another.

        start, target : (unknowns,) from within, and what distances are taken from. free : (unknowns,) what may move;
        covariance : (free, free) of its estimate, by which distances are measured. It costs no prediction.
        """
        sd = np.sqrt(np.diag(covariance))
        # by rounding no covariance where the tests do not tell a combination of unknowns
        variances, axes = np.linalg.eigh(covariance / np.outer(sd, sd))
        whitening = (axes / np.sqrt(np.maximum(variances, ROUNDING))).T / sd
        rows = np.zeros((len(whitening), target.size))
        rows[:, free] = whitening

        def distance(x: Floats) -> tuple[Floats, Floats]:
            return rows @ (x - target), rows

        if np.array_equal(self.within_bounds(target), target) and not (self.limits(target)[0] > 0.0).any():
            return target
        held = np.where(free, np.stack([self.bounds.lower, self.bounds.upper]), target)
        scale = np.where(free, 1.0, self.bounds.width)
        scale[free] = sd
        start = np.where(free, self.bounds.clip(start), target)
        where = Bounds(*held), scale, Tolerances(100, 1e-10), self.limits
        return self.within_bounds(bounded_least_squares(distance, start, *where).x)
