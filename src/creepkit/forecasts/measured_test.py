"""A measured test beside its forecast: how likely it was, and how much of what is left its own nuisances explain.

With r the residuals of the test at the identified values and prior means, the covariance of the forecast is

    V = J C J' + E S E' + s^2 d d' + N:

J, E and d derivatives to the law's coordinates, to the test's own nuisance parameters and to ln of a factor on its
rate, C, S and s^2 their covariances, N noise, offsets and misfit. r'V^-1 r is a chi-square if the forecast holds. With
the law frozen, the nuisances are estimated from r under their priors: what whitened residuals are then smaller by, they
explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from creepkit.arrays import Floats
from creepkit.forecasts.draws import Dimension, covariance_root
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals, covariance
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.records import History, Nuisance, Predictor


@dataclass(frozen=True)
class ExplainedNuisance:
    """One nuisance parameter of a measured test, estimated with the law frozen.

    kind : "rate" (value is ln of a factor), "offset of amplitude", or the kind of a Nuisance, in its unit.
    value, sd : estimate and its standard deviation. prior_mean, prior_sd : before the test.
    """

    kind: str
    value: float
    sd: float
    prior_mean: float
    prior_sd: float

    @property
    def deviation(self) -> float:
        """Distance from the prior mean in its standard deviations."""
        return (self.value - self.prior_mean) / self.prior_sd if self.prior_sd > 0 else 0.0


@dataclass(frozen=True)
class TestScore:
    """How a measured test compares with its forecast.

    inside : {output: share of frames inside the pointwise band}. whole_inside : {output: whether all of its frames are
    inside the simultaneous band}. chi_square, freedom, p_value : of the residuals under the covariance of the forecast.
    log_score : ln of the predictive density of the transformed outputs, per frame; larger is better.
    rms, rms_explained : {output: root mean square residual over its noise} at prior means, and with the test's own
        nuisances estimated. explained : share of the squared whitened residuals that these explain.
    nuisances : their estimates.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    inside: dict[str, float]
    whole_inside: dict[str, bool]
    chi_square: float
    freedom: int
    p_value: float
    departure_p_value: float
    log_score: float
    rms: dict[str, float]
    rms_explained: dict[str, float]
    explained: float
    nuisances: tuple[ExplainedNuisance, ...]


def score_test(
    fit: Identification,
    predictor: Predictor,
    history: History,
    dimensions: Sequence[Dimension],
    scatter_variance: float,
    bands: tuple[dict[str, float], dict[str, bool]],
) -> TestScore:
    """The score of a measured test.

    scatter_variance : of ln of the test's own factor on the rate. bands : `inside` and `whole_inside`.
    """
    own = [d for d in dimensions if d.sd > 0 and d.shared is None]
    nuisances = tuple(Nuisance(d.kind, mean=d.mean, sd=d.sd) for d in own)  # type: ignore[arg-type]
    settings = replace(fit.settings, nuisances=nuisances)
    problem = LeastSquaresProblem.from_histories(fit.law, [history], predictor, settings, fit.reference)
    x = np.concatenate([fit.u, [d.mean for d in own]])
    residuals = problem.residuals(x)
    noise_model = noise_model_of(fit, problem.observations)
    present = residuals.present[0]
    values = residuals.values[0][present]
    assert residuals.jacobian is not None
    jacobian = residuals.jacobian[0][present]
    count = fit.u.size
    noise = covariance(residuals, noise_model)[0][np.ix_(present, present)]
    rate = residuals.log_rate_sensitivity[0][present][:, None] * np.sqrt(scatter_variance)
    tolerance = jacobian[:, count:] * np.array([d.sd for d in own])
    uncertain = np.concatenate(
        [jacobian[:, :count] @ covariance_root(mean_law_covariance(fit)), rate, tolerance], axis=1
    )
    total = noise + uncertain @ uncertain.T
    factor = np.linalg.cholesky(total)
    whitened = np.linalg.solve(factor, values)
    chi_square, freedom = float(whitened @ whitened), values.size
    log_determinant = 2.0 * float(np.log(np.diag(factor)).sum())
    estimates, remaining = _explained(residuals, noise_model, own, tolerance, rate, scatter_variance)
    white = _white_noise(residuals, noise_model)[present]
    names, outputs = problem.observations.outputs, residuals.output_index[0][present]

    def rms_of(r: Floats) -> dict[str, float]:
        return {
            name: float(np.sqrt(np.mean((r / white)[outputs == k] ** 2)))
            for k, name in enumerate(names)
            if name != RUPTURE_OUTPUT and (outputs == k).any()
        }

    squares = float(((values / white) ** 2).sum())
    return TestScore(
        *bands,
        chi_square,
        freedom,
        float(chi2.sf(chi_square, freedom)),
        _departure_p_value(values, noise, uncertain),
        float(-0.5 * (chi_square + log_determinant + freedom * np.log(2 * np.pi)) / max(freedom, 1)),
        rms_of(values),
        rms_of(remaining),
        1.0 - float(((remaining / white) ** 2).sum()) / squares if squares > 0 else 0.0,
        estimates,
    )


def _departure_p_value(values: Floats, noise: Floats, uncertain: Floats) -> float:
    """Probability of a departure as large in the directions that are more uncertain than noise; 1 without any.

    values : (data,). noise : (data, data) covariance. uncertain : (data, sources) effect of one standard deviation.
    """
    factor = np.linalg.cholesky(noise)
    directions, sizes, _ = np.linalg.svd(np.linalg.solve(factor, uncertain), full_matrices=False)
    counted = sizes > 1.0
    if not counted.any():
        return 1.0
    components = directions[:, counted].T @ np.linalg.solve(factor, values)
    return float(chi2.sf((components**2 / (1.0 + sizes[counted] ** 2)).sum(), int(counted.sum())))


def mean_law_covariance(fit: Identification) -> Floats:
    """(parameters, parameters) covariance of u over the posterior distribution of the scatter."""
    scatter, size = fit.scatter_of_rates, fit.u.size
    posterior = scatter.posterior
    mean_effect = sum(w * scatter.effect_covariance(sd) for w, sd in zip(posterior.weight, posterior.sd, strict=True))
    return np.asarray((scatter.within + scatter.gain @ mean_effect @ scatter.gain.T)[:size, :size])


def noise_model_of(fit: Identification, observations: ObservationVector) -> NoiseModel:
    """The noise model of a test: that of the fit, its misfit and drift in the units of these observations.

    An output that was not fitted has the noise of its frames alone.
    """
    outputs = {}
    scales = fit.scatter_of_rates.output_scales
    for position, name in enumerate(observations.outputs):
        known = fit.noise_model.outputs.get(name)
        if known is None:
            outputs[name] = OutputNoise(noise=max(float(observations.noise[position]), 1e-12))
            continue
        ratio = scales.get(name, 1.0) / float(getattr(observations.transforms[position], "scale", 1.0))
        noise = float(observations.noise[position]) or known.noise
        outputs[name] = replace(known, noise=max(noise, 1e-12), misfit=known.misfit * ratio, drift=known.drift * ratio)
    return replace(fit.noise_model, outputs=outputs, rate=0.0)


def _white_noise(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """(observations,) standard deviation of what is independent from frame to frame, in the transformed output."""
    index = residuals.output_index
    noise = noise_model.per_observation(index, "noise") * residuals.relative_noise * residuals.offset_sensitivity
    misfit = noise_model.per_observation(index, "misfit")
    return np.asarray(np.maximum(np.hypot(noise, misfit)[0], 1e-12))


def _explained(
    residuals: Residuals,
    noise_model: NoiseModel,
    own: Sequence[Dimension],
    tolerance: Floats,
    rate: Floats,
    scatter_variance: float,
) -> tuple[tuple[ExplainedNuisance, ...], Floats]:
    """Estimates of the test's own nuisances with the law frozen, and the residuals that remain, (data,).

    tolerance : (data, dimensions) effect of one standard deviation of each; rate : (data, 1) the same of the rate.
    """
    present = residuals.present[0]
    values, outputs = residuals.values[0][present], residuals.output_index[0][present]
    columns, kinds = (
        [rate, tolerance],
        [("rate", 0.0, float(np.sqrt(scatter_variance))), *[(d.kind, d.mean, d.sd) for d in own]],
    )
    for k, (name, components) in enumerate(noise_model.outputs.items()):
        if components.offset > 0 and (outputs == k).any():
            effect = np.where(outputs == k, residuals.offset_sensitivity[0][present], 0.0) * components.offset
            columns.append(effect[:, None])
            kinds.append((f"offset of {name}", 0.0, components.offset))
    design = np.concatenate(columns, axis=1)
    without_offset = replace(noise_model, outputs={n: replace(o, offset=0.0) for n, o in noise_model.outputs.items()})
    noise = covariance(residuals, without_offset)[0][np.ix_(present, present)]
    weighted = np.linalg.solve(noise, design)
    posterior = np.linalg.inv(design.T @ weighted + np.eye(design.shape[1]))
    estimate = -posterior @ (weighted.T @ values)
    estimates = tuple(
        ExplainedNuisance(kind, mean + sd * float(e), sd * float(np.sqrt(v)), mean, sd)
        for (kind, mean, sd), e, v in zip(kinds, estimate, np.diag(posterior), strict=True)
        if sd > 0
    )
    return estimates, values + design @ estimate
