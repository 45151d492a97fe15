"""A measured test beside its forecast: how likely it was, and how much of what is left its own nuisances explain.

With r the residuals of the test at the identified values, A and m derivatives to, and posterior mean of, what the
fitted tests say (the law, and the effects of a heat or laboratory that was fitted), C its covariance, s^2 the variance
of what is new in the factor of the test on the rate and d the derivative to it, E the effects of its dimensions within
their tolerances, and N noise, offsets and misfit, the forecast is

    r + A m is normal with covariance V = A C A' + s^2 d d' + E E' + N,

a mixture over the posterior distribution of the scatter, and over the laws of a ranking. p-values are prior predictive
ones (Box (1980), J. R. Stat. Soc. A 143, 383). With the law frozen, the nuisances of the test are estimated from r
under their priors: what whitened residuals are then smaller by, they explain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from creepkit.arrays import Floats, Ints
from creepkit.forecasts.drawn_law import DrawnLaw
from creepkit.forecasts.draws import UncertainQuantity, systematic
from creepkit.inverse.identification import Identification
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME, chance_of_larger
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.output_transforms import LogTransform
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.uncertainty.importance_sampling import covariance_root
from creepkit.inverse.uncertainty.rate_scatter import NewTest
from creepkit.records import History, Nuisance, Predictor

SCORED_NODES = 16
"""Standard deviations of the scatter, drawn from their posterior distribution, over which a test is scored."""


EXACTLY_KNOWN = 1e-9
"""Prior standard deviation that stands for none."""


@dataclass(frozen=True)
class ExplainedNuisance:
    """One nuisance parameter of a measured test, estimated with the law frozen.

    kind : "rate" (value is ln of a factor), "offset of amplitude", or the kind of a Nuisance, in its unit.
    value, sd : estimate and its standard deviation. prior_mean, prior_sd : before the test.
    spread : standard deviation that the forecast gives to such an estimate, that of the law included.
    """

    kind: str
    value: float
    sd: float
    prior_mean: float
    prior_sd: float
    spread: float

    @property
    def deviation(self) -> float:
        """Distance from the prior mean, in what the forecast allows it."""
        return (self.value - self.prior_mean) / self.spread if self.spread > 0 else 0.0


@dataclass(frozen=True)
class TestScore:
    """How a measured test compares with its forecast.

    inside : {output: share of frames inside the pointwise band}. whole_inside : {output: whether all of its frames are
    inside the simultaneous band}. p_value : of the residuals under the forecast, noise and all; freedom : their number.
    departure_p_value : of the residuals in those directions alone in which the forecast is more uncertain than its
        noise: of a whole curve that lies so far off.
    log_score : ln of the predictive density of the outputs in their units, per frame; larger is better.
    rms, rms_explained : {output: root mean square residual over its noise} at prior means, and with the test's own
        nuisances estimated. explained : share of the squared whitened residuals that these explain.
    nuisances : their estimates.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    inside: Mapping[str, float]
    whole_inside: Mapping[str, bool]
    freedom: int
    p_value: float
    departure_p_value: float
    log_score: float
    rms: Mapping[str, float]
    rms_explained: Mapping[str, float]
    explained: float
    nuisances: tuple[ExplainedNuisance, ...]


@dataclass(frozen=True, eq=False)
class LinearForecast:
    """What one law forecasts of a test's residuals, linear in what is uncertain.

    fit : the identification. problem, residuals : of the test. values : (data,) r at the prior means. by_joint : (data,
    unknowns + effects) A. rate : (data,) d. tolerance : (data, dimensions) E. noise : (data, data) N. white : (data,)
    standard deviation of what is independent from frame to frame. outputs : (data,) positions; names : of outputs.
    misfit : standard deviation of ln rate by what the law misses there.
    """

    fit: Identification
    problem: LeastSquaresProblem
    residuals: Residuals
    noise_model: NoiseModel
    values: Floats
    by_joint: Floats
    rate: Floats
    tolerance: Floats
    noise: Floats
    white: Floats
    outputs: Ints
    names: tuple[str, ...]
    own: tuple[UncertainQuantity, ...]
    dimensions: tuple[UncertainQuantity, ...]
    log_scale: float
    misfit: float

    @classmethod
    def of_test(cls, law: DrawnLaw, predictor: Predictor, history: History) -> LinearForecast:
        """The linear forecast of a measured test by one law."""
        fit, dimensions = law.draws.fit, law.dimensions
        kinds = tuple(Nuisance(d.kind, mean=d.mean, sd=d.sd if d.sd > 0 else EXACTLY_KNOWN) for d in dimensions)
        if RUPTURE_OUTPUT not in fit.noise_model.outputs:  # nothing is known of how lives scatter beside rates
            history = replace(history, rupture_time=None, unruptured=False)
        settings = replace(fit.settings, nuisances=kinds)
        problem = LeastSquaresProblem.from_histories(fit.law, [history], predictor, settings, fit.reference)
        problem = replace(problem, observations=_on_fitted_scale(fit, problem.observations))
        residuals = problem.residuals(np.concatenate([fit.u, [d.mean for d in dimensions]]))
        noise_model = noise_model_of(fit, problem.observations)
        present = residuals.present[0]
        assert residuals.jacobian is not None
        jacobian, rate = residuals.jacobian[0][present], residuals.log_rate_sensitivity[0][present]
        scatter, count = fit.scatter_of_rates, fit.u.size
        by_joint = np.zeros((present.sum(), scatter.joint_design.shape[1]))
        by_joint[:, :count] = jacobian[:, :count]
        by_joint[:, [*scatter.new_test(history).known.values()]] = rate[:, None]
        own = [k for k, d in enumerate(dimensions) if d.shared is None and d.sd > 0]
        for k, dimension in enumerate(dimensions):
            if dimension.shared is not None:
                by_joint[:, dimension.shared] = jacobian[:, count + k]
        slopes = problem.observations.derivative(problem.observations.values)[0][present]
        return cls(
            fit,
            problem,
            residuals,
            noise_model,
            residuals.values[0][present],
            by_joint,
            rate,
            jacobian[:, [count + k for k in own]] * np.array([dimensions[k].sd for k in own]),
            CovarianceFactor.of_residuals(residuals, noise_model).blocks[0][np.ix_(present, present)],
            _white_noise(residuals, noise_model)[present],
            residuals.output_index[0][present],
            problem.observations.outputs,
            tuple(dimensions[k] for k in own),
            tuple(dimensions),
            float(np.log(np.maximum(np.abs(slopes), 1e-300)).sum()),
            0.0 if law.misfit is None else law.misfit.sd,
        )

    def evaluated(self, history: History) -> tuple[float, float, Floats]:
        """p-value, departure p-value, and ln of the predictive density at each node of the scatter, (nodes,)."""
        scatter = self.fit.scatter_of_rates
        posterior = scatter.posterior
        nodes = systematic(posterior.weight, SCORED_NODES, np.random.default_rng(0))
        test = scatter.new_test(history, self.misfit)
        variances = scatter.own_variance(test, posterior.sd[nodes])
        noise_root, noise_freedom = np.linalg.cholesky(self.noise), self.noise_freedom
        p_values, departures, densities = [], [], []
        for node, variance in zip(nodes, variances, strict=True):
            mean, joint = scatter.joint(posterior.sd[node])
            uncertain = np.concatenate(
                [self.by_joint @ covariance_root(joint), np.sqrt(variance) * self.rate[:, None], self.tolerance], axis=1
            )
            residuals = np.linalg.solve(noise_root, self.values + self.by_joint @ mean)
            directions, sizes, sources = np.linalg.svd(np.linalg.solve(noise_root, uncertain), full_matrices=False)
            components = directions.T @ residuals
            relative = components**2 / (1.0 + sizes**2)
            most_likely = -sources.T @ (sizes * components / (1.0 + sizes**2))
            remaining = np.linalg.solve(noise_root, self.residuals_at(test, mean, (joint, variance), most_likely))
            total = float(remaining @ remaining + most_likely @ most_likely)
            counted = sizes > 1.0
            p_values.append(chance_of_larger(total / residuals.size, float(residuals.size), noise_freedom))
            departures.append(chi2.sf(relative[counted].sum(), counted.sum()) if counted.any() else 1.0)
            log_determinant = 2.0 * np.log(np.diag(noise_root)).sum() + np.log1p(sizes**2).sum()
            densities.append(-0.5 * (total + log_determinant + residuals.size * np.log(2 * np.pi)) + self.log_scale)
        return float(np.mean(p_values)), float(np.mean(departures)), np.array(densities)

    @property
    def noise_freedom(self) -> float:
        """Degrees of freedom of the noise: of an estimate from the fitted tests, infinite of stated noise."""
        frames = [o.errors.frames for m in self.fit.tests for o in m.outputs if o.output in self.names]
        stated = all(self.fit.noise_model[n].stated > 0 for n in self.names if n in self.fit.noise_model.outputs)
        return float("inf") if stated else FREEDOM_PER_FRAME * max(sum(frames), 1)

    def residuals_at(self, test: NewTest, mean: Floats, scatter: tuple[Floats, float], sources: Floats) -> Floats:
        """(data,) residuals where what is uncertain is moved, in standard deviations of its sources.

        test : which effects are known. mean : (unknowns + effects,) at sources of zero. scatter : (unknowns + effects,
        unknowns + effects) covariance of these, and variance of what is new in the factor of the test.
        sources : (unknowns + effects + 1 + dimensions,). Simulated, so that a large factor on the rate is no error
        of linearisation; linear for laws whose rates have no coefficient.
        """
        covariance_of_joint, variance = scatter
        size, count = mean.size, self.fit.u.size
        joint = mean + covariance_root(covariance_of_joint) @ sources[:size]
        own_factor, dimensions = float(np.sqrt(variance) * sources[size]), sources[size + 1 :]
        coefficients = list(self.fit.coordinates.coefficients)
        if not self.fit.coordinates.every_rate_has_coefficient:
            return self.values + self.by_joint @ joint + own_factor * self.rate + self.tolerance @ dimensions
        x = np.concatenate([self.fit.u + joint[:count], [d.mean for d in self.dimensions]])
        x[coefficients] += own_factor + joint[[*test.known.values()]].sum()
        for k, dimension in enumerate(self.dimensions):
            if dimension.shared is not None:
                x[count + k] += joint[dimension.shared]
        for dimension, moved in zip(self.own, dimensions, strict=True):
            x[count + self.dimensions.index(dimension)] += dimension.sd * moved
        return np.asarray(self.problem.residuals(self.problem.bounds.clip(x)).values[0][self.residuals.present[0]])

    def rms(self, values: Floats) -> dict[str, float]:
        """{output: root mean square of residuals (data,) over their noise}."""
        return {
            name: float(np.sqrt(np.mean((values / self.white)[self.outputs == k] ** 2)))
            for k, name in enumerate(self.names)
            if name != RUPTURE_OUTPUT and (self.outputs == k).any()
        }

    def explained(self, history: History) -> tuple[tuple[ExplainedNuisance, ...], Floats, Floats]:
        """Estimates of the test's own nuisances with the law frozen; residuals (data,) before and after."""
        scatter = self.fit.scatter_of_rates
        mean, joint = scatter.mean_joint
        test = scatter.new_test(history, self.misfit)
        variance = float(scatter.posterior.weight @ scatter.own_variance(test, scatter.posterior.sd))
        known = np.zeros(mean.size)
        known[[*test.known.values()]] = mean[[*test.known.values()]]
        values = self.values + self.by_joint @ known
        sd = float(np.sqrt(variance))
        columns = [sd * self.rate[:, None], self.tolerance]
        kinds = [("rate", 0.0, sd), *((d.kind, d.mean, d.sd) for d in self.own)]
        present = self.residuals.present[0]
        for k, (name, components) in enumerate(self.noise_model.outputs.items()):
            if components.offset > 0 and (self.outputs == k).any():
                effect = np.where(self.outputs == k, self.residuals.offset_sensitivity[0][present], 0.0)
                columns.append(components.offset * effect[:, None])
                kinds.append((f"offset of {name}", 0.0, components.offset))
        design = np.concatenate(columns, axis=1)
        noise = CovarianceFactor.of_residuals(self.residuals, self.noise_model.without_offsets).blocks[0]
        weighted = np.linalg.solve(noise[np.ix_(present, present)], design)
        posterior = np.linalg.inv(design.T @ weighted + np.eye(design.shape[1]))
        to_estimate = -posterior @ weighted.T
        estimate = to_estimate @ values
        forecast = design @ design.T + noise[np.ix_(present, present)] + self.by_joint @ joint @ self.by_joint.T
        spread = np.sqrt(np.einsum("kd,de,ke->k", to_estimate, forecast, to_estimate))
        estimates = tuple(
            ExplainedNuisance(kind, centre + one * float(e), one * float(np.sqrt(v)), centre, one, one * float(w))
            for (kind, centre, one), e, v, w in zip(kinds, estimate, np.diag(posterior), spread, strict=True)
            if one > 0
        )
        return estimates, values, values + design @ estimate


def score_test(
    laws: Sequence[DrawnLaw],
    predictor: Predictor,
    history: History,
    inside: Mapping[str, float],
    whole_inside: Mapping[str, bool],
) -> TestScore:
    """The score of a measured test by weighted laws; inside, whole_inside : as TestScore has them."""
    forecasts = [LinearForecast.of_test(one, predictor, history) for one in laws]
    weight = np.array([one.weight for one in laws]) / sum(one.weight for one in laws)
    p_values, departures, densities = zip(*(one.evaluated(history) for one in forecasts), strict=True)
    log_density = logsumexp([logsumexp(one) - np.log(SCORED_NODES) for one in densities], b=weight)
    best = forecasts[int(weight.argmax())]
    estimates, before, after = best.explained(history)
    squares, left = (float(((residuals / best.white) ** 2).sum()) for residuals in (before, after))
    return TestScore(
        inside,
        whole_inside,
        before.size,
        float(weight @ p_values),
        float(weight @ departures),
        float(log_density) / max(before.size, 1),
        best.rms(before),
        best.rms(after),
        1.0 - left / squares if squares > 0 else 0.0,
        estimates,
    )


def _on_fitted_scale(fit: Identification, observations: ObservationVector) -> ObservationVector:
    """The observations by the transforms of the fit, in which its misfit and drift are stated."""
    floors = fit.scatter_of_rates.output_floors
    transforms = tuple(
        LogTransform(floors[name]) if isinstance(transform, LogTransform) and name in floors else transform
        for name, transform in zip(observations.outputs, observations.transforms, strict=True)
    )
    return replace(observations, transforms=transforms)


def noise_model_of(fit: Identification, observations: ObservationVector) -> NoiseModel:
    """The noise model of a test: that of the fit, its misfit and drift in the units of these observations.

    The noise of a frame is that which the test states, else that of the fitted tests: a few frames say little of it.
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
        stated = bool(observations.stated[position]) and float(observations.noise[position]) > 0
        noise = float(observations.noise[position]) if stated else known.noise
        outputs[name] = replace(known, noise=max(noise, 1e-12), misfit=known.misfit * ratio, drift=known.drift * ratio)
    return replace(fit.noise_model, outputs=outputs, rate=0.0)


def _white_noise(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """(observations,) standard deviation of what is independent from frame to frame, in the transformed output."""
    index = residuals.output_index
    noise = noise_model.per_observation(index, "noise") * residuals.relative_noise * residuals.offset_sensitivity
    misfit = noise_model.per_observation(index, "misfit")
    return np.asarray(np.maximum(np.hypot(noise, misfit)[0], 1e-12))
