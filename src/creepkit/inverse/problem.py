"""The least-squares problem that a law and histories pose, checked: observations, coordinates, bounds, nuisance parameters and covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.bound_penalties import BoundPenalties
from creepkit.inverse.composite_predictor import (
    CompositePredictor,
    compared_outputs,
    prediction_errors_of,
    predictor_for,
)
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.iterative_estimation import WorkingNoise, with_rupture_weight
from creepkit.inverse.noise_model import NoiseModel, Residuals, cholesky_factors
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import (
    LOGARITHMIC_OUTPUTS,
    ObservationVector,
    frames_with_data,
    thinned_history,
)
from creepkit.inverse.reference_conditions import (
    ReferencePoint,
    detect_creep,
    median_log_inverse_duration,
    median_log_strain_rate,
)
from creepkit.inverse.residuals import ResidualFunction
from creepkit.inverse.search.cost_function import CostFunction
from creepkit.inverse.search.local_refinement import AdditionalResiduals, Bounds, Minimum, bounded_least_squares
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification


SIGNIFICANT_GROWTH = 5.0
"""Growth of an output, in units of its noise, that is creep."""


def check_creep(residual_function: ResidualFunction) -> None:
    """Some strain must rise above the floor of its scale, or some other output grow beyond its noise."""
    observations = residual_function.observations
    for position, (name, transform) in enumerate(zip(observations.outputs, observations.transforms, strict=True)):
        mask = observations.leading_output & (observations.output_index == position)
        if name in LOGARITHMIC_OUTPUTS:
            if (mask & (observations.values > 2 * transform.floor)).any():
                return
            continue
        for k, history in enumerate(residual_function.histories):
            values = observations.values[k, mask[k]]
            if (
                values.size
                and np.ptp(values) > SIGNIFICANT_GROWTH * observations.noise[position]
                and _creeps_under_load(history, name)
            ):
                return
    output_names = dict.fromkeys(
        observations.outputs[k] for k in observations.output_index[observations.leading_output]
    )
    raise FitError(
        f"no {' or '.join(output_names)} of these histories rises above its noise while the load is held; there is no creep "
        "to identify a law from"
    )


def _creeps_under_load(history: History, output: str) -> bool:
    """Whether a bulge test grows while its pressure is held: a jump of pressure alone moves it elastically."""
    return history.loading.quantity != "pressure" or detect_creep(history, output).shows_creep


def check_histories(law: CreepLaw, histories: Sequence[History], predictor: Predictor) -> None:
    """There must be parameters, and named histories with enough finite outputs to find them from."""
    if not histories:
        raise FitError(f"law '{law.name}': there are no histories to identify it from")
    if not law.params:
        raise FitError(f"law '{law.name}' has no parameter left to identify")
    names = [h.name for h in histories]
    for history in histories:
        if names.count(history.name) > 1:
            raise FitError(f"two histories are called '{history.name}'; give each its own name")
        _check_outputs(history, predictor)
    frames = sum(int(h.used.sum()) for h in histories)
    if frames <= len(law.params):
        raise FitError(f"law '{law.name}' has {len(law.params)} parameters and the histories only {frames} frames")


def _check_outputs(history: History, predictor: Predictor) -> None:
    """Frames without a number are left out, output by output; an infinite one is a mistake."""
    outputs = compared_outputs(predictor, history)
    if not outputs:
        known = ", ".join(getattr(predictor_for(predictor, history), "outputs", ())) or "nothing"
        raise FitError(
            f"history '{history.name}' has none of the outputs that are predicted ({known}); "
            f"it has {', '.join(history.outputs) or 'none'}"
        )
    used = history.used & (history.times > 0)
    if int((used & frames_with_data(history)).sum()) < 2:
        raise FitError(f"history '{history.name}' has fewer than two usable frames after time zero")
    for name in outputs:
        if np.isinf(history.outputs[name][used]).any():
            raise FitError(f"history '{history.name}' has an infinite {name}; mark the frame unused")


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
        observations, nuisance_parameters = (
            ObservationVector.from_histories(thinned_histories, predictor, histories),
            NuisanceParameters.from_histories(settings.nuisances, thinned_histories, predictor),
        )
        residual_function = ResidualFunction(
            law, thinned_histories, predictor, coordinates, observations, nuisance_parameters
        )
        check_creep(residual_function)
        check_explicit_nuisances(
            [n.kind for n in nuisance_parameters.nuisances], observations, thinned_histories, predictor
        )
        bounds = Bounds.from_law(
            law,
            coordinates,
            median_log_strain_rate(thinned_histories, predictor),
            median_log_inverse_duration(thinned_histories),
        )
        return cls(
            tuple(histories),
            tuple(thinned_histories),
            settings,
            residual_function,
            bounds,
            WorkingNoise(settings, observations, prediction_errors_of(predictor)),
        )

    @property
    def full_bounds(self) -> Bounds:
        """The box of x = (u, e)."""
        return self.bounds.with_nuisances(self.residual_function.nuisance_parameters)

    def with_predictor(self, predictor: Predictor) -> ResidualFunction:
        """The same comparison of another predictor, with the unknowns of tests."""
        residual_function = self.residual_function
        return ResidualFunction(
            residual_function.law,
            residual_function.histories,
            predictor,
            residual_function.coordinates,
            residual_function.observations,
            residual_function.nuisance_parameters,
        )

    def cost_function(self, predictor: Predictor) -> CostFunction:
        """What a global search sees: a covariance that is broad and fixed, and a loss that no single curve can capture.

        The likelihoods decide between minima, since the covariance is not yet known here.
        """
        residual_function, settings = self.residual_function, self.settings
        initial_noise = with_rupture_weight(self.working_noise.initial(), residual_function.observations)
        covariance_factor = cholesky_factors(residual_function.at_measured_values(), initial_noise)
        loss = "soft_l1" if settings.loss == "linear" else settings.loss
        return CostFunction(
            residual_function.with_predictor(predictor, residual_function.law, residual_function.coordinates),
            self.bounds,
            covariance_factor,
            settings,
            loss=loss,
        )


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
        self,
        start: Floats | None = None,
        fixed: Mapping[int, float] | None = None,
        additional: AdditionalResiduals | None = None,
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
    estimates = [
        estimates_by_owner[n.kind, m]
        for n, m in zip(nuisance_parameters.nuisances, nuisance_parameters.owners, strict=True)
    ]
    prior_sd = np.array([n.prior_sd for n in estimates], float)
    problem.residual_function.nuisance_parameters = (
        replace(nuisance_parameters, sd=prior_sd) if estimates else nuisance_parameters
    )
    x = np.concatenate([fit.u, [n.value for n in estimates]])
    residuals = problem.residual_function.evaluate(x).with_test_weights(np.array([m.weight for m in fit.tests]))
    covariance_factor = cholesky_factors(residuals, fit.noise_model)
    return LeastSquaresProblem(
        problem.residual_function, problem.full_bounds, x, fit.noise_model, covariance_factor, residuals
    )


def check_explicit_nuisances(
    kinds: Sequence[str], observations: ObservationVector, histories: Sequence[History], predictor: Predictor
) -> None:
    """Explicit nuisances have no place yet where tests are followed to rupture."""
    if not kinds or not observations.followed_to_rupture.any():
        return
    history = histories[int(np.argmax(observations.followed_to_rupture))]
    name = getattr(predictor_for(predictor, history), "name", "predictor")
    raise FitError(
        f"nuisance '{kinds[0]}' cannot be fitted beside tests that are followed to their end ('{history.name}', "
        f"{name}); leave it out, or forget how they ended: history.replace(rupture_time=None, unruptured=False)"
    )
