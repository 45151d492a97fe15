"""A measured test beside its forecast: how likely it was.

With r the residuals of the test at the identified values, A and m derivatives to, and posterior mean of, what the
fitted tests say (the law, and the effects of a heat or laboratory that was fitted), C its covariance, s^2 the variance
of what is new in the factor of the test on the rate and d the derivative to it, E the effects of its dimensions within
their tolerances, and N noise, offsets and misfit, the forecast is

    r + A m is normal with covariance V = A C A' + s^2 d d' + E E' + N,

a mixture over the posterior distribution of the scatter, and over the laws of a ranking. p-values are prior predictive
ones (Box (1980), J. R. Stat. Soc. A 143, 383).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from creepkit.arrays import Floats
from creepkit.forecasts.draws import DrawnLaw, UncertainQuantity, systematic
from creepkit.inverse.identification import Identification
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME, chance_of_larger
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.output_transforms import LogTransform
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.uncertainty.laplace_approximation import covariance_root
from creepkit.inverse.uncertainty.rate_scatter import NewTest
from creepkit.records import History, Nuisance, Predictor

SCORED_NODES = 16
"""Standard deviations of the scatter, drawn from their posterior distribution, over which a test is scored."""


EXACTLY_KNOWN = 1e-9
"""Prior standard deviation that stands for none."""


@dataclass(frozen=True)
class TestScore:
    """How a measured test compares with its forecast.

    inside : {output: share of frames inside the pointwise band}. whole_inside : {output: whether all of its frames are
    inside the simultaneous band}. p_value : of the residuals under the forecast, noise and all; freedom : their number.
    departure_p_value : of the residuals in those directions alone in which the forecast is more uncertain than its
        noise: of a whole curve that lies so far off.
    log_score : ln of the predictive density of the outputs in their units, per frame; larger is better.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    inside: Mapping[str, float]
    whole_inside: Mapping[str, bool]
    freedom: int
    p_value: float
    departure_p_value: float
    log_score: float


@dataclass(frozen=True, eq=False)
class LinearForecast:
    """What one law forecasts of a test's residuals, linear in what is uncertain.

    fit : the identification. problem, residuals : of the test. values : (data,) r at the prior means. by_joint : (data,
    unknowns + effects) A. rate : (data,) d. tolerance : (data, dimensions) E. noise : (data, data) N. names : of
    outputs. misfit : standard deviation of ln rate by what the law misses there.
    """

    fit: Identification
    problem: LeastSquaresProblem
    residuals: Residuals
    values: Floats
    by_joint: Floats
    rate: Floats
    tolerance: Floats
    noise: Floats
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
        scatter, count, present = fit.scatter_of_rates, fit.u.size, residuals.present[0]
        assert residuals.jacobian is not None
        jacobian, rate = residuals.jacobian[0][present], residuals.log_rate_sensitivity[0][present]
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
            residuals.values[0][present],
            by_joint,
            rate,
            jacobian[:, [count + k for k in own]] * np.array([dimensions[k].sd for k in own]),
            CovarianceFactor.of_residuals(residuals, noise_model).blocks[0][np.ix_(present, present)],
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
    count = forecasts[int(weight.argmax())].values.size
    return TestScore(
        inside,
        whole_inside,
        count,
        float(weight @ p_values),
        float(weight @ departures),
        float(log_density) / max(count, 1),
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
