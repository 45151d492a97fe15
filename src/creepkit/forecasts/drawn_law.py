"""What one law says of one test: its curves at draws and at the identified values, derivatives, times along curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.forecasts.draws import (
    LawDraws,
    UncertainQuantity,
    dimension_draws,
    has_sampled_draws,
    log_factor_draws,
    own_variances,
    uncertain_quantities,
)
from creepkit.inverse.identification import Identification
from creepkit.inverse.reference_conditions import reference_condition
from creepkit.inverse.single_values import EXTRAPOLATION_FACTOR
from creepkit.inverse.uncertainty.law_misfit import LawMisfit
from creepkit.inverse.uncertainty.quantities import log_rate
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor, Status
from creepkit.records.rate_nuisances import law_with_rate_factors

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

    outputs : names. coordinates : (times, outputs, parameters) to u. rate : (times, outputs) to ln of a factor on its
    rate. dimensions : {kind: (times, outputs)}.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    outputs: tuple[str, ...]
    coordinates: Floats
    rate: Floats
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

    def drawn(self, u: Floats, log_factor: Floats, nuisances: Mapping[str, Floats]) -> TestCurves:
        """The curves of draws, through a cheaper predictor moved by its difference from the exact one at the values.

        u : (draws, parameters) coordinates. log_factor : (draws,) ln of a factor on every rate. nuisances : {kind:
        (draws, 1)}.
        """
        theta = np.clip(self.fit.coordinates.theta(u), *self.fit.law.internal_bounds)
        drawn, (exact, numerical) = self._curves(self._cheaper, theta, log_factor, nuisances), self.central
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
        return TestSensitivities(prediction.outputs, to_u, jacobian[..., moved].sum(axis=-1), slopes)

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
    fit, condition = draws.fit, reference_condition(history, predictor)
    dimensions, misfit = uncertain_quantities(fit, history, predictor, tolerances), fit.misfit_at(*condition)
    of_rate = 0.0 if misfit is None else misfit.sd
    if has_sampled_draws(fit):  # samples are those of the tests alone
        of_rate = float(np.hypot(of_rate, fit.error_sd(log_rate(fit.coordinates, *condition))))
    test = fit.scatter_of_rates.new_test(history, of_rate)
    known = float(fit.scatter_of_rates.mean_joint[0][[*test.known.values()]].sum())
    simulated = SimulatedTest(fit, predictor, history, {d.kind: d.mean for d in dimensions}, known)
    central, numerical = simulated.central
    factors = log_factor_draws(draws, test, rng)
    drawn = simulated.drawn(draws.u, factors, dimension_draws(dimensions, draws, rng))
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
