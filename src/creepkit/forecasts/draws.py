"""What one law says of one test, at draws of all that an identification leaves uncertain and at the identified values.

Drawn are the law, the rate of the test and its dimensions. The law's unknowns and the effects of heats and laboratories
are drawn together, from their posterior distribution over that of the scatter between tests (see
inverse.uncertainty.rate_scatter).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError, refuse_unknown
from creepkit.inverse.identification import Identification
from creepkit.inverse.nuisance_parameters import owner_of, prior_mean
from creepkit.inverse.reference_conditions import condition_at, simulated_stresses
from creepkit.inverse.single_values import EXTRAPOLATION_FACTOR
from creepkit.inverse.uncertainty.laplace_approximation import covariance_root
from creepkit.inverse.uncertainty.law_misfit import LawMisfit
from creepkit.inverse.uncertainty.quantities import log_rate
from creepkit.inverse.uncertainty.rate_scatter import USUAL_SD, NewTest
from creepkit.language import CreepLaw
from creepkit.records import (
    COVARIANCE_NUISANCES,
    GENERAL_NUISANCES,
    STEP_NUISANCES,
    History,
    Nuisance,
    Predictor,
    Status,
    all_dimensions,
    dimensions_of,
    is_length_nuisance,
)
from creepkit.records.rate_nuisances import law_with_rate_factors

TOLERANCE_KINDS = tuple(kind for kind in GENERAL_NUISANCES if kind not in (*COVARIANCE_NUISANCES, *STEP_NUISANCES))
"""Kinds of nuisance parameters that a tolerance can be given of, beside the lengths of test pieces."""


LARGEST_TOLERANCES = {"modulus": 0.3, "temperature": 100.0, "temperature drift": 100.0, "rate drift": 5.0}
"""Standard deviations, in the unit of the kind: relative, K, K, ln of a factor."""


SOURCES = {
    "test": "scatter between tests",
    "heat": "scatter between heats",
    "laboratory": "scatter between laboratories",
}
"""What the scatter of each level is called among the parts of a band."""


LIFE_SCATTER = "scatter of lives beside rates"
"""Among the parts of a band."""


MISFIT_THERE = "what the law misses at this stress and temperature"
"""Among the parts of a band."""


MOST_BATCHES = 50
"""Of draws, until enough of them lie within the bounds of the law; then some are taken more than once."""


BOUND_TOLERANCE = 1e-6
"""Of the width of the bounds: draws as near as this outside one count as inside."""


@dataclass(frozen=True, eq=False)
class LawDraws:
    """Draws of the unknowns of one identification and of the effects of its heats and laboratories.

    joint : (draws, unknowns + effects) x = (u, e), then ln factors (see RateScatter.groups). scatter_sd : (draws,
    levels) of ln rate, the scatter that each draw belongs to. outside : share of the draws of a Gaussian that lay
    outside the bounds of the law, for which others were drawn; 0 of samples.
    """

    fit: Identification
    joint: Floats
    scatter_sd: Floats
    outside: float = 0.0

    @property
    def count(self) -> int:
        """Number of draws."""
        return len(self.joint)

    @property
    def u(self) -> Floats:
        """(draws, parameters) conditioned coordinates of the law."""
        return self.joint[:, : self.fit.u.size]


def law_draws(fit: Identification, count: int, rng: np.random.Generator) -> LawDraws:
    """`count` draws of the unknowns of an identification and of the effects of its heats and laboratories.

    Where values lie at their bounds or are not determined, the unknowns of the law are its samples of the posterior,
    which the tests do not contradict. Of a Gaussian, draws outside the bounds of the law are drawn again: moved to a
    bound one by one, parameters that compensate each other would no longer do so.
    """
    if has_sampled_draws(fit):
        return _sampled_draws(fit, count, rng)
    drawn = [_joint_draws(fit, count, rng)]
    while sum(one.count for one in drawn) < count and len(drawn) < MOST_BATCHES:
        drawn.append(_joint_draws(fit, count, rng))
    none_within = not any(one.count for one in drawn)
    if none_within:
        drawn = [_joint_draws(fit, count, rng, within_bounds=False)]
    made = sum(one.count for one in drawn)
    outside = 1.0 if none_within else 1.0 - made / (count * len(drawn))
    chosen = np.arange(count) % made
    joint = np.concatenate([one.joint for one in drawn])[chosen]
    return LawDraws(fit, joint, np.concatenate([one.scatter_sd for one in drawn])[chosen], outside)


def has_sampled_draws(fit: Identification) -> bool:
    """Whether the unknowns of the law are drawn from samples of its posterior.

    Those do not know effects of heats, of laboratories and of what tests share, which are drawn together with the law.
    """
    shared = bool(fit.scatter_of_rates.groups) or any(n.scope != "test" for n in fit.nuisances)
    return fit.samples is not None and not shared


def _sampled_draws(fit: Identification, count: int, rng: np.random.Generator) -> LawDraws:
    """Draws with unknowns of the law from its samples; nuisances of single tests stay at their estimates."""
    assert fit.samples is not None
    posterior = fit.scatter_of_rates.posterior
    nodes = rng.permutation(systematic(posterior.weight, count, rng))
    samples = len(fit.samples)
    joint = np.tile(fit.x, (count, 1))
    joint[:, : fit.u.size] = fit.samples[rng.permutation(systematic(np.full(samples, 1.0 / samples), count, rng))]
    return LawDraws(fit, joint, posterior.sd[nodes])


def _joint_draws(fit: Identification, count: int, rng: np.random.Generator, *, within_bounds: bool = True) -> LawDraws:
    """Draws of all that is uncertain together, at most `count`: those within the bounds of the law."""
    scatter = fit.scatter_of_rates
    nodes = rng.permutation(systematic(scatter.posterior.weight, count, rng))
    sd = scatter.posterior.sd[nodes]
    normal = rng.standard_normal((count, scatter.joint_design.shape[1]))
    joint = np.empty_like(normal)
    for node in np.unique(nodes):
        mean, covariance = scatter.joint(scatter.posterior.sd[node])
        joint[nodes == node] = mean + normal[nodes == node] @ covariance_root(covariance).T
    joint[:, : fit.x.size] += fit.x
    kept = np.ones(count, bool)
    if within_bounds:
        theta = fit.coordinates.theta(joint[:, : fit.u.size])
        low, high = fit.law.internal_bounds
        margin = BOUND_TOLERANCE * (high - low)
        kept = ((theta >= low - margin) & (theta <= high + margin)).all(axis=1)
    return LawDraws(fit, joint[kept], sd[kept])


def systematic(weight: Floats, count: int, rng: np.random.Generator) -> Ints:
    """(count,) positions drawn with probabilities weight (positions,), as evenly as these allow."""
    points = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weight), points), weight.size - 1)


def log_factor_draws(draws: LawDraws, test: NewTest, rng: np.random.Generator) -> Floats:
    """(draws,) ln of the factor of one new test on the rate: effects that were fitted, and those drawn anew."""
    scatter = draws.fit.scatter_of_rates
    factor = draws.joint[:, [*test.known.values()]].sum(axis=1)
    for level in test.unknown:
        factor += draws.scatter_sd[:, scatter.levels.index(level)] * rng.standard_normal(draws.count)
    for level in test.unseen:
        factor += np.abs(USUAL_SD[level] * rng.standard_normal(draws.count)) * rng.standard_normal(draws.count)
    return np.asarray(factor + test.misfit * rng.standard_normal(draws.count))


def own_variances(fit: Identification, test: NewTest) -> dict[str, float]:
    """{source: variance of ln of what is new in the factor of a test on the rate}."""
    drawn = {SOURCES[level]: fit.scatter_of_rates.posterior.mean_square(level) for level in test.unknown}
    drawn.update({SOURCES[level]: USUAL_SD[level] ** 2 for level in test.unseen})
    return {**drawn, MISFIT_THERE: test.misfit**2} if test.misfit > 0 else drawn


@dataclass(frozen=True)
class UncertainQuantity:
    """A quantity of a test that is known to a tolerance: kind and unit are those of a Nuisance.

    shared : position among the unknowns of what all tests, or those of the alloy, share; None for its own.
    """

    kind: str
    mean: float
    sd: float
    low: float
    high: float
    shared: int | None = None


def uncertain_quantities(
    fit: Identification, history: History, predictor: Predictor, tolerances: Mapping[str, float]
) -> list[UncertainQuantity]:
    """What of a test is known to a tolerance: as given, as the fit estimated it, or as the specimen states it."""
    estimated = {(n.key, n.owner): k for k, n in enumerate(fit.nuisances)}
    own_predictor = predictor.for_history(history)
    dimensions: dict[str, UncertainQuantity] = {}
    for nuisance in fit.settings.nuisances:
        kind = nuisance.kind
        has_tolerance = kind in TOLERANCE_KINDS or is_length_nuisance(kind)
        if not (has_tolerance and own_predictor.follows(kind) and nuisance.applies_to(history.name)):
            continue
        mean = prior_mean(nuisance, history, predictor)
        position = estimated.get((nuisance.key, owner_of(nuisance, history)))
        low, high = nuisance.bounds
        if nuisance.scope != "test" and position is not None:
            estimate = fit.nuisances[position]
            dimensions[kind] = UncertainQuantity(kind, estimate.value, estimate.sd, low, high, fit.u.size + position)
        else:
            dimensions[kind] = UncertainQuantity(kind, mean, _spread_between_tests(fit, nuisance), low, high)
    stated = ((d.names[-1], d.tolerance) for d in dimensions_of(own_predictor) if d.tolerance > 0.0)  # relative ones
    for given, relative in (*stated, *((kind, None) for kind in tolerances)):
        if not own_predictor.follows(given) or (relative is not None and given in dimensions):
            continue
        known = dimensions.get(given)
        mean = known.mean if known else prior_mean(Nuisance(given), history, predictor)
        sd = tolerances[given] if relative is None else relative * mean
        dimensions[given] = UncertainQuantity(given, mean, sd, 0.0 if mean > 0 else -np.inf, np.inf)
    return list(dimensions.values())


def _spread_between_tests(fit: Identification, nuisance: Nuisance) -> float:
    """Standard deviation of a nuisance between tests: of its prior, or of its estimates where that is flat."""
    estimates = [n for n in fit.nuisances if n.key == nuisance.key]
    prior_sd = estimates[0].prior_sd if estimates else nuisance.sd or 0.0
    if np.isfinite(prior_sd):
        return float(prior_sd)
    return float(np.sqrt(np.mean([(n.value - n.prior_mean) ** 2 for n in estimates]))) if estimates else 0.0


def check_tolerances(tolerances: Mapping[str, float], histories: Sequence[History], predictor: Predictor) -> None:
    """FitError for a tolerance of what no test has, or that is no standard deviation."""
    for kind, sd in tolerances.items():
        lengths = {name for h in histories for d in dimensions_of(predictor.for_history(h)) for name in d.names}
        known = sorted({*TOLERANCE_KINDS, *lengths, *all_dimensions()})
        refuse_unknown(kind, known, FitError, f"a tolerance of '{kind}' is not known")
        if not (np.isfinite(sd) and sd >= 0):
            raise FitError(f"the tolerance of '{kind}' is {sd}; give a standard deviation of zero or more, in its unit")
        if sd > LARGEST_TOLERANCES.get(kind, np.inf):
            raise FitError(
                f"the tolerance of '{kind}' is {sd:g}; allowed are 0 to {LARGEST_TOLERANCES[kind]:g} "
                f"({'K' if 'temperature' in kind else 'relative, 0.05 for 5 %'})"
            )
        if not any(predictor.for_history(h).follows(kind) for h in histories):
            raise FitError(f"the tolerance of '{kind}' means nothing to the specimens of these tests; leave it out")


def dimension_draws(
    dimensions: Sequence[UncertainQuantity], draws: LawDraws, rng: np.random.Generator
) -> dict[str, Floats]:
    """{kind: (draws, 1)} as predictors take them."""
    values = {}
    for one in dimensions:
        drawn = one.mean + one.sd * rng.standard_normal(draws.count)
        if one.shared is not None:
            drawn = draws.joint[:, one.shared]
        margin = 1e-3 * abs(one.mean)
        values[one.kind] = np.clip(drawn, one.low + margin, one.high - margin)[:, None]
    return values


FOLLOWED_TIMES, ADDED_TIMES = 300, 20
"""Geometrically spaced times at which a test is followed to its rupture, or to its last time, beside its own."""


FIRST_OF_FOLLOWED, FIRST_OF_ADDED = 1e-8, 1e-4
"""The first of them, over the last time of the test."""


REMAINING_DEFECT = 0.1
"""Standard deviation of what is left of a corrected error, over its size (see inverse.defect_correction)."""


LEAST_SOLVED = 0.8
"""Share of the draws that the solver must finish."""


@dataclass(frozen=True, eq=False)
class TestCurves:
    """Outputs of one test for draws.

    outputs : names. times : (times,) s. values : (draws, times, outputs) in the output's unit; NaN after a rupture.
    end_times : (draws,) s; infinite where the test lasts to its last time, NaN where the prediction failed.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    outputs: tuple[str, ...]
    times: Floats
    values: Floats
    end_times: Floats

    def of(self, output: str, times: Floats | None = None) -> Floats:
        """(draws, times) of one output; times : (times,) s, some of its own."""
        values = np.asarray(self.values[..., self.outputs.index(output)])
        return values if times is None else values[:, np.searchsorted(self.times, times)]


@dataclass(frozen=True, eq=False)
class TestSensitivities:
    """Derivatives of the outputs of a test at the identified values, in the output's unit.

    outputs : names. coordinates : (times, outputs, parameters) to u. rate, life : (times, outputs) to ln of a factor on
    its rate, and on its rate of damage alone. dimensions : {kind: (times, outputs)}.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    outputs: tuple[str, ...]
    coordinates: Floats
    rate: Floats
    life: Floats
    dimensions: Mapping[str, Floats]


@dataclass(frozen=True, eq=False)
class SimulatedTest:
    """One test by one identified law.

    centre : {kind: value} of nuisance parameters that are known to a tolerance. log_factor : ln of the factor on its
    rate that fitted tests know, such as of its heat.
    """

    fit: Identification
    predictor: Predictor
    history: History
    centre: Mapping[str, float]
    log_factor: float = 0.0

    @cached_property
    def own(self) -> Predictor:
        """The predictor of this test."""
        return self.predictor.for_history(self.history)

    @cached_property
    def followed(self) -> History:
        """The history at its own times and up to its rupture, far beyond where the specimen is followed to it.

        A drift is one over the test: with it nothing is followed beyond.
        """
        last = max(float(self.history.times[-1]), self.history.rupture_time or 0.0)
        far = self.predictor.for_history(self.history).follows_to_rupture and not any(
            "drift" in kind for kind in self.centre
        )
        horizon, count = (EXTRAPOLATION_FACTOR * last, FOLLOWED_TIMES) if far else (last, ADDED_TIMES)
        times = np.geomspace((FIRST_OF_FOLLOWED if far else FIRST_OF_ADDED) * last, horizon, count)
        return self.history.replace(times=np.union1d(times, self.history.times), outputs={}, standard_deviation={})

    @cached_property
    def central(self) -> tuple[TestCurves, dict[str, float]]:
        """The curve at the identified values, by the most exact predictor there is, and what is left of its error.

        That is {output: standard deviation} of the numerical error, in the output's unit: a tenth of what the refined
        predictor changes, or what predictors state of themselves.
        """
        coarse, refined = self._at_values(self.predictor), self.own.refined()
        if refined is None:
            return coarse, dict(self.own.error)
        exact = self._at_values(refined)
        change = exact.values[0] - coarse.values[0]
        remaining = {
            name: REMAINING_DEFECT * float(np.sqrt(np.nanmean(change[:, k] ** 2)))
            for k, name in enumerate(exact.outputs)
            if np.isfinite(change[:, k]).any()
        }
        return exact, remaining

    @cached_property
    def _cheaper(self) -> Predictor:
        """What predicts draws, which are then corrected at the identified values; its own where nothing is cheaper."""
        cheaper = self.own.reduced_order_model()
        if cheaper is None or cheaper.outside_class(self.fit.law):
            return self.own.for_search()
        return (cheaper if {*self.centre} <= {*cheaper.nuisances} else self.own).for_search()

    def drawn(self, u: Floats, log_factors: Floats, nuisances: Mapping[str, Floats]) -> TestCurves:
        """The curves of draws, through a cheaper predictor moved by its difference from the exact one at the values.

        u : (draws, parameters) coordinates. log_factors : (2, draws) ln of a factor on every rate, and on that of
        damage beside it. nuisances : {kind: (draws, 1)}.
        """
        theta = np.clip(self.fit.coordinates.theta(u), *self.fit.law.internal_bounds)
        theta[:, [*self.fit.coordinates.damage_rates]] += log_factors[1][:, None]
        drawn, (exact, numerical) = self._curves(self._cheaper, theta, log_factors[0], nuisances), self.central
        if self._cheaper is self.own and not numerical:
            return drawn
        at_values = self._at_values(self._cheaper)
        difference = exact.values[0] - at_values.values[0]
        ratio = exact.end_times[0] / at_values.end_times[0] if np.isfinite(exact.end_times[0]) else 1.0
        values = drawn.values + np.where(np.isfinite(difference), difference, 0.0)
        return replace(drawn, values=values, end_times=drawn.end_times * (ratio if np.isfinite(ratio) else 1.0))

    @cached_property
    def sensitivities(self) -> TestSensitivities:
        """The derivatives, at its own times."""
        law, theta, moved = self._with_factor(self.fit.coordinates.theta(self.fit.u)[None], np.zeros(1))
        prediction = self.own.predict(law, theta, [self.history], nuisances=self._fixed, sensitivities=True)
        assert prediction.jacobian is not None
        count, size = self.history.times.size, self.fit.u.size
        jacobian = np.nan_to_num(prediction.jacobian[0, 0, :count])
        slopes = {
            kind: np.nan_to_num(values.reshape(-1, *values.shape[-2:])[0, :count])
            for kind, values in prediction.nuisance_jacobian.items()
        }
        to_u = jacobian[..., :size] @ self.fit.coordinates.jacobian(self.fit.u)
        rate, life = (jacobian[..., [*k]].sum(axis=-1) for k in (moved, self.fit.coordinates.damage_rates))
        return TestSensitivities(prediction.outputs, to_u, rate, life, slopes)

    @property
    def _fixed(self) -> dict[str, Floats]:
        return {kind: np.array([[value]]) for kind, value in self.centre.items()}

    def _at_values(self, predictor: Predictor) -> TestCurves:
        theta = self.fit.coordinates.theta(self.fit.u)[None]
        return self._curves(predictor, theta, np.array([self.log_factor]), self._fixed)

    def _with_factor(self, theta: Floats, log_factor: Floats) -> tuple[CreepLaw, Floats, list[int]]:
        """The law and its internal values with a factor on every rate, and the parameters that the factor moves."""
        moved = list(self.fit.coordinates.coefficients)
        if not self.fit.coordinates.every_rate_has_coefficient or not moved:
            law = law_with_rate_factors(self.fit.law, ("rate",))
            return law, np.concatenate([theta, log_factor[:, None]], axis=1), [theta.shape[1]]
        theta = theta.copy()
        theta[:, moved] += log_factor[:, None]
        return self.fit.law, theta, moved

    def _curves(
        self, predictor: Predictor, theta: Floats, log_factor: Floats, nuisances: Mapping[str, Floats]
    ) -> TestCurves:
        law, theta, _ = self._with_factor(theta, log_factor)
        prediction = predictor.predict(law, theta, [self.followed], nuisances=nuisances)
        status, values = prediction.status[:, 0], np.array(prediction.values[:, 0, : self.followed.times.size])
        end_times = np.where(status == Status.RUPTURED, prediction.end_times[:, 0], np.inf)
        finished, failed = status == Status.COMPLETE, status == Status.NOT_CONVERGED
        if finished.any() and not np.isfinite(values[finished]).any():
            name = self.history.name
            raise FitError(f"test '{name}': the predictor says that the test is complete, but gives no numbers")
        values[failed] = end_times[failed] = np.nan
        return TestCurves(prediction.outputs, self.followed.times, values, end_times)


@dataclass(frozen=True, eq=False)
class DrawnLaw:
    """What one law says of one test.

    drawn : draws of its curves, at its times and up to rupture; central : at the identified values.
    own_variances : {source: variance of ln of what is new in the factor of the test on the rate}. misfit : what the law
    misses at its stress and temperature, where bands hold that.
    numerical : {output: standard deviation}, in its unit. failed : draws that the solver did not finish, left out.
    """

    draws: LawDraws
    weight: float
    drawn: TestCurves
    central: TestCurves
    dimensions: Sequence[UncertainQuantity]
    own_variances: Mapping[str, float]
    sensitivities: TestSensitivities
    numerical: Mapping[str, float]
    failed: int
    misfit: LawMisfit | None = None


def drawn_law(
    draws: LawDraws,
    weight: float,
    history: History,
    predictor: Predictor,
    tolerances: Mapping[str, float],
    rng: np.random.Generator,
) -> DrawnLaw:
    """What one law says of one test; weight : of the law. tolerances : {kind: standard deviation}."""
    fit = draws.fit
    condition = condition_at(simulated_stresses(fit.law, fit.values, history, predictor), history)
    dimensions, misfit = uncertain_quantities(fit, history, predictor, tolerances), fit.misfit_at(*condition)
    of_rate = 0.0 if misfit is None else misfit.sd
    if has_sampled_draws(fit):  # samples are those of the tests alone
        of_rate = float(np.hypot(of_rate, fit.error_sd(log_rate(fit.coordinates, *condition))))
    test = fit.scatter_of_rates.new_test(history, of_rate)
    known = float(fit.scatter_of_rates.mean_joint[0][[*test.known.values()]].sum())
    simulated = SimulatedTest(fit, predictor, history, {d.kind: d.mean for d in dimensions}, known)
    central, numerical = simulated.central
    factors = log_factor_draws(draws, test, rng)
    lives = fit.noise_model.life * rng.standard_normal(draws.count)
    drawn = simulated.drawn(draws.u, np.stack([factors, lives]), dimension_draws(dimensions, draws, rng))
    solved = ~np.isnan(drawn.end_times)
    if solved.mean() < LEAST_SOLVED:
        raise FitError(
            f"test '{history.name}': the solver finishes {100 * solved.mean():.0f} % of the draws of law "
            f"'{fit.law.name}' alone, too few for a band; shorten the test, or narrow the bounds of the law"
        )
    return DrawnLaw(
        draws,
        weight,
        replace(drawn, values=drawn.values[solved], end_times=drawn.end_times[solved]),
        central,
        dimensions,
        own_variances(fit, test),
        simulated.sensitivities,
        numerical,
        int((~solved).sum()),
        misfit,
    )


def crossing_times(drawn: TestCurves, output: str, targets: Floats, *, rising: bool | None = None) -> Floats:
    """(draws,) s, when an output first reaches targets (draws,): from below where it is `rising`, else from above.

    rising : by default whether the first value of a draw lies below its target. The rupture where that comes first;
    infinite where neither comes, NaN where the prediction failed.
    """
    values, times = drawn.of(output), drawn.times
    result = np.where(np.isnan(drawn.end_times), np.nan, drawn.end_times)
    for k in range(len(values)):
        result[k] = min(first_crossing(times, values[k], float(targets[k]), rising), result[k])
    return np.asarray(result)


def first_crossing(times: Floats, values: Floats, target: float, rising: bool | None = None) -> float:
    """s, when values first reach a target from the side on which they begin; infinite where they do not.

    rising : whether that is from below; a rising output that begins beyond its target has reached it at once.
    times : (times,) s. values : (times,) in the unit of the target.
    """
    counted = np.isfinite(values) & (times > 0)
    times, values = times[counted], values[counted]
    if not values.size:
        return float("inf")
    sign = 1.0 if (values[0] <= target if rising is None else rising) else -1.0
    reached = np.flatnonzero(sign * (values - target) >= 0.0)
    if not reached.size:
        return float("inf")
    j = int(reached[0])
    if j == 0:  # before the first time an output is taken to be in proportion to time
        return float(times[0] * max(target, 0.0) / values[0]) if sign > 0 and values[0] > 0 else float(times[0])
    below, above = values[j - 1], values[j]
    positive = min(below, above, target) > 0
    share = np.log(target / below) / np.log(above / below) if positive else (target - below) / (above - below)
    return float(times[j - 1] * (times[j] / times[j - 1]) ** share)
