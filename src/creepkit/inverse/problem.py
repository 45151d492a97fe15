"""The problem that a law and histories pose: what is compared, in which coordinates and bounds, with which scatter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.checks import check_creep, check_histories
from creepkit.inverse.coordinates import Coordinates, ReferencePoint
from creepkit.inverse.covariance import cholesky_factors
from creepkit.inverse.effects import NuisanceParameters
from creepkit.inverse.entries import ObservationVector
from creepkit.inverse.fences import BoundPenalties
from creepkit.inverse.frames import thinned_history
from creepkit.inverse.life import check_explicit_nuisances
from creepkit.inverse.nominal import median_log_inverse_duration, median_log_strain_rate
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scatter import NoiseModel
from creepkit.inverse.search.box import Bounds
from creepkit.inverse.search.landscape import CostFunction
from creepkit.inverse.search.refining import AdditionalResiduals, Minimum, bounded_least_squares
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.together import CompositePredictor, prediction_errors_of
from creepkit.inverse.weighting import WorkingNoise, with_rupture_weight
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification


@dataclass(frozen=True, eq=False)
class IdentificationProblem:
    """A law against histories.

    thin : the histories at the frames that are looked at; box : bounds of u; wide : of x = (u, e).
    """

    histories: tuple[History, ...]
    thinned: tuple[History, ...]
    settings: IdentificationSettings
    residual_function: ResidualFunction
    bounds: Bounds
    working_noise: WorkingNoise

    @classmethod
    def from_histories(
        cls, law: CreepLaw, histories: Sequence[History], predictor: Predictor | Mapping[str, Predictor],
        settings: IdentificationSettings, reference: ReferencePoint | None = None,
    ) -> IdentificationProblem:  # fmt: skip
        """The checked problem; `reference` where the coordinates of another identification are to be kept."""
        predictor = CompositePredictor(dict(predictor)) if isinstance(predictor, Mapping) else predictor
        check_histories(law, histories, predictor)
        thinned_histories = [thinned_history(h, settings.frames) for h in histories]
        coordinates = Coordinates(law, reference or ReferencePoint.from_histories(thinned_histories, predictor))
        observations, nuisance_parameters = ObservationVector.from_histories(thinned_histories, predictor, histories), NuisanceParameters.from_histories(settings.nuisances, thinned_histories, predictor)
        residual_function = ResidualFunction(law, thinned_histories, predictor, coordinates, observations, nuisance_parameters)
        check_creep(residual_function)
        check_explicit_nuisances([n.kind for n in nuisance_parameters.nuisances], observations, thinned_histories, predictor)
        bounds = Bounds.from_law(law, coordinates, median_log_strain_rate(thinned_histories, predictor), median_log_inverse_duration(thinned_histories))
        return cls(
            tuple(histories), tuple(thinned_histories), settings, residual_function, bounds, WorkingNoise(settings, observations, prediction_errors_of(predictor))
        )

    @property
    def full_bounds(self) -> Bounds:
        """The box of x = (u, e)."""
        return self.bounds.with_nuisances(self.residual_function.nuisance_parameters)

    def with_predictor(self, predictor: Predictor) -> ResidualFunction:
        """The same comparison of another predictor, with the unknowns of tests."""
        residual_function = self.residual_function
        return ResidualFunction(residual_function.law, residual_function.histories, predictor, residual_function.coordinates, residual_function.observations, residual_function.nuisance_parameters)

    def cost_function(self, predictor: Predictor) -> CostFunction:
        """What a global search sees: a covariance that is broad and fixed, and a loss that no single curve can capture.

        The likelihoods decide between minima, since the covariance is not yet known here.
        """
        residual_function, settings = self.residual_function, self.settings
        initial_noise = with_rupture_weight(self.working_noise.initial(), residual_function.observations)
        covariance_factor = cholesky_factors(residual_function.at_measured_values(), initial_noise)
        loss = "soft_l1" if settings.loss == "linear" else settings.loss
        return CostFunction(residual_function.with_predictor(predictor, residual_function.law, residual_function.coordinates), self.bounds, covariance_factor, settings, loss=loss)


@dataclass(frozen=True, eq=False)
class LeastSquaresProblem:
    """An identification as a problem about its optimum.

    x : (u, e) at the optimum; box : its bounds; scatter, factor : of the covariance by which chi-squares are taken.
    residuals : at the optimum, with their Jacobian to x.
    """

    residual_function: ResidualFunction
    bounds: Bounds
    x: Floats
    noise_model: NoiseModel
    covariance_factor: Floats
    residuals: Residuals

    @property
    def bound_penalties(self) -> BoundPenalties:
        """Walls and priors."""
        return BoundPenalties(self.residual_function)

    def whitened(self, x: Floats) -> Floats:
        """Residuals of the data over their scatter, then those of walls and priors, at x."""
        values = np.linalg.solve(self.covariance_factor, self.residual_function.evaluate(x).values[..., None])[..., 0]
        return np.concatenate([values[self.residual_function.observations.present], self.bound_penalties.residuals(x)])

    def chi_square(self, x: Floats) -> float:
        """Chi-square of data and priors at x."""
        return float((self.whitened(x) ** 2).sum())

    def minimise(
        self, start: Floats | None = None, fixed: Mapping[int, float] | None = None, additional: AdditionalResiduals | None = None
    ) -> Minimum:
        """Least squares from `start` (the optimum) with {position: value} of x held, and further residuals."""
        return bounded_least_squares(
            self.residual_function, self.bounds, self.covariance_factor, self.x if start is None else start, max_steps=25, tolerance=1e-7,
            fixed=fixed, additional=additional,
        )  # fmt: skip


def least_squares_problem(fit: Identification) -> LeastSquaresProblem:
    """The problem of an identification, about its optimum, under the covariance that it found."""
    if fit.predictor is None or not fit.histories:
        raise FitError("this identification was loaded from a file: attach its histories and specimen with fit.on()")
    problem = IdentificationProblem.from_histories(fit.law, fit.histories, fit.predictor, fit.settings, fit.reference)
    estimates_by_owner = {(n.kind, n.owner): n for n in fit.nuisances}
    nuisance_parameters = problem.residual_function.nuisance_parameters
    estimates = [estimates_by_owner[n.kind, m] for n, m in zip(nuisance_parameters.nuisances, nuisance_parameters.owners, strict=True)]
    prior_sd = np.array([n.prior_sd for n in estimates], float)
    problem.residual_function.nuisance_parameters = replace(nuisance_parameters, sd=prior_sd) if estimates else nuisance_parameters
    x = np.concatenate([fit.u, [n.value for n in estimates]])
    residuals = problem.residual_function.evaluate(x).with_test_weights(np.array([m.weight for m in fit.tests]))
    covariance_factor = cholesky_factors(residuals, fit.noise_model)
    return LeastSquaresProblem(problem.residual_function, problem.full_bounds, x, fit.noise_model, covariance_factor, residuals)
