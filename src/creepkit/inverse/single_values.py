"""Values of which a test has one, its rupture time and its minimum creep rate, predicted and beside the measured ones.

Intervals are of logarithms, by the delta method over the posterior distribution of the scatter between tests.

Whether minimum rates and rupture times contradict one another by a law is judged by their own scatter: no noise of a
rupture time is known, and often none of a minimum rate. With y the logarithms of predicted over measured values, of a
test the difference of the two so that a factor on its rate drops out, a law that is right leaves y without a mean and
without a trend over stress and temperature. The sums of squares with and without a constant, ln stress and 1/T are
compared by an F test. An identification takes some of that regression away already, so that a right law is rejected
less often than the level says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import f

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.compared_tests import compares_minimum_rate
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.minimum_rates import minimum_rates
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT, RUPTURE_OUTPUT
from creepkit.inverse.reference_conditions import reference_condition
from creepkit.inverse.uncertainty.mixture_distribution import NORMAL_FREEDOM, MixtureDistribution
from creepkit.inverse.uncertainty.rate_scatter import RateScatter
from creepkit.limits import SIGNIFICANCE
from creepkit.records import History, Predictor, constant_stress
from creepkit.records.presentable import Presentable

if TYPE_CHECKING:
    from creepkit.inverse.uncertainty.law_misfit import LawMisfit

EXTRAPOLATION_FACTOR = 1000.0
"""How far beyond the longest measured test, or its own last time, a test is followed to its rupture; the predictor's
own horizon comes on top."""

FEWEST_VALUES = 5
"""Tests that are judged; and as many as the regression has columns, and three more."""


@dataclass(frozen=True)
class SingleValue:
    """The end, s, or the minimum creep rate, 1/s, of one test.

    measured : when it ruptured, or how long it lasted where it was stopped before (`censored`); or its rate.
    predicted : by the law alone; infinite where the law predicts no rupture, NaN where it gives no rate.
    low, high : 95 % interval for a single test, from the parameters and the scatter between tests.
    used : whether the law was compared with it; else it stands beside a law that was identified without it.
    """

    measured: float
    predicted: float
    low: float
    high: float
    censored: bool = False
    used: bool = True

    @property
    def ratio(self) -> float:
        """Predicted over measured."""
        return self.predicted / self.measured


@dataclass(frozen=True, eq=False)
class LawAtTests:
    """An identified law and what tests are predicted with.

    u : (parameters,) conditioned coordinates. noise_model : whose scatter of single tests is in the intervals; None
    for those of the law alone. misfit_at : what the law misses at MPa and K, by default nothing.
    """

    coordinates: Coordinates
    u: Floats
    scatter: RateScatter
    noise_model: NoiseModel | None
    predictor: Predictor
    misfit_at: Callable[[float, float], LawMisfit | None] | None = None

    def compared(
        self, histories: Sequence[History], *, without_curves: bool = True
    ) -> list[tuple[SingleValue | None, SingleValue | None]]:
        """End and minimum rate of every history; None where it is not known, or not predicted.

        without_curves : whether ends of tests without frames were compared.
        """
        ends: dict[int, SingleValue] = {}
        followed = [
            k for k, h in enumerate(histories) if h.end_known and self.predictor.for_history(h).follows_to_rupture
        ]
        tests = [histories[k] for k in followed]
        for k, h, life, low, high in zip(followed, tests, *self.rupture_times(tests), strict=True):
            used, end = without_curves or bool(h.outputs), h.rupture_time or float(h.times[-1])
            ends[k] = SingleValue(end, float(life), float(low), float(high), h.unruptured, used)
        rates = self.minimum_rates(histories)
        return [(ends.get(k), rates.get(k)) for k in range(len(histories))]

    def rupture_times(self, histories: Sequence[History]) -> tuple[Floats, Floats, Floats]:
        """Rupture times, s, with intervals: (time, low, high), (tests,) each; infinite where none comes."""
        for history in histories:
            if not self.predictor.for_history(history).follows_to_rupture:
                name = getattr(self.predictor.for_history(history), "name", "predictor")
                raise FitError(
                    f"history '{history.name}': {name} follows no test to rupture; give using=, such as uniaxial"
                )
        if not histories:
            return np.zeros(0), np.zeros(0), np.zeros(0)
        law, theta = self.coordinates.law, self.coordinates.theta(self.u)[None]
        extended = [_extended_to_rupture(history) for history in histories]
        times = self.predictor.predict_to_rupture(law, theta, extended, sensitivities=True).times_to_strain
        assert times is not None
        assert times.rupture_jacobian is not None
        # ln of a time changes by -1 with ln of a factor on all rates, where the law has no explicit time
        by_parameter = np.nan_to_num(times.rupture_jacobian[0])
        return self._with_intervals(RUPTURE_OUTPUT, histories, times.rupture_times[0], by_parameter, -1.0, np.inf)

    def minimum_rates(self, histories: Sequence[History]) -> dict[int, SingleValue]:
        """{position: minimum rate} of the histories that are compared by it."""
        compared = [k for k, history in enumerate(histories) if compares_minimum_rate(history)]
        if not compared:
            return {}
        tests, law, theta = [histories[k] for k in compared], self.coordinates.law, self.coordinates.theta(self.u)
        (rates,), jacobian, _ = minimum_rates(self.predictor, law, theta[None], tests, {}, sensitivities=True)
        assert jacobian is not None
        rates = np.where(np.isfinite(rates) & (rates > 0), rates, np.nan)
        by_parameter = np.nan_to_num(jacobian[0] / rates[:, None])
        predicted = self._with_intervals(MINIMUM_RATE_OUTPUT, tests, rates, by_parameter, 1.0, np.nan)
        return {
            k: SingleValue(history.minimum_rate or 0.0, float(rate), float(low), float(high))
            for k, history, rate, low, high in zip(compared, tests, *predicted, strict=True)
        }

    def _misfit(self, history: History) -> float:
        """Standard deviation of ln of the rate of a test by what the law misses there."""
        stress, T = reference_condition(history, self.predictor)
        misfit = None if self.misfit_at is None else self.misfit_at(stress, T)
        return 0.0 if misfit is None else misfit.sd

    def _with_intervals(
        self,
        output: str,
        histories: Sequence[History],
        values: Floats,
        by_parameter: Floats,
        rate_effect: float,
        missing: float,
    ) -> tuple[Floats, Floats, Floats]:
        """Values (tests,) with lower and upper ends of 95 % intervals; `missing` where they are not finite.

        by_parameter : (tests, parameters) derivatives of their logarithms to internal parameters. rate_effect : that to
        ln of a factor on all rates, where one of the rates has no coefficient.
        """
        known, coordinates = np.isfinite(values), self.coordinates
        effects = np.full(len(values), rate_effect)
        if coordinates.every_rate_has_coefficient:
            effects = by_parameter[:, list(coordinates.coefficients)].sum(axis=1)
        misfit = None
        if self.noise_model is not None:
            misfit = self.noise_model.scatter_of_value(output) ** 2
        posterior, locations, variances = self.scatter.posterior, [], []
        means, covariances = self.scatter.joint_at_nodes
        of_u = by_parameter @ coordinates.jacobian(self.u)
        for k, history in enumerate(histories):
            test = self.scatter.new_test(history, self._misfit(history))
            row = np.zeros(self.scatter.joint_design.shape[1])
            row[: self.u.size] = of_u[k]
            row[[*test.known.values()]] = effects[k] if misfit is not None else 0.0
            own = self.scatter.own_variance(test, posterior.sd) * effects[k] ** 2 + (misfit or 0.0)
            locations.append(means @ row)
            by_law = covariances @ row @ row
            variances.append(by_law + (own if misfit is not None else (test.misfit * effects[k]) ** 2))
        mixture = MixtureDistribution(
            posterior.weight,
            np.full(posterior.weight.size, NORMAL_FREEDOM),
            np.log(np.where(known, values, 1.0)) + np.array(locations).T,
            np.sqrt(np.maximum(np.array(variances).T, 1e-20)),
        )
        low, high = (np.where(known, np.exp(mixture.quantile(share)), missing) for share in (0.025, 0.975))
        return np.where(known, values, missing), low, high


def _extended_to_rupture(history: History) -> History:
    """The history with one frame, far beyond its last one, so that it is followed to rupture."""
    last_time = max(float(history.times[-1]), history.rupture_time or 0.0)
    return history.replace(times=np.array([EXTRAPOLATION_FACTOR * last_time]), outputs={}, standard_deviation={})


def constant_stress_tests(
    stress: ArrayLike, temperature: ArrayLike, duration: float, control: str
) -> tuple[list[History], tuple[int, ...]]:
    """Uniaxial tests at constant load or stress, and their shape.

    stress, temperature : numbers or arrays that broadcast, MPa and K.
    """
    stresses, temperatures = np.broadcast_arrays(np.asarray(stress, float), np.asarray(temperature, float))
    if not (stresses > 0).all():
        raise FitError("a rupture time was asked for at a stress that is not above zero; give tensile stresses, in MPa")
    tests = [
        History(f"{s:g} MPa, {T:g} K", np.array([duration]), {}, constant_stress(float(s), control), float(T))  # type: ignore[arg-type]
        for s, T in zip(stresses.ravel(), temperatures.ravel(), strict=True)
    ]
    return tests, stresses.shape


@dataclass(frozen=True)
class ContradictingValues(Presentable):
    """What a law cannot explain together.

    tests : how many are judged. rate_ratio, time_ratio : geometric means of predicted over measured minimum rates and
    rupture times of the tests that state them. scatter : of one test, as a factor (one standard deviation of ln).
    p_value : of as much by chance.
    """

    tests: int
    rate_ratio: float
    time_ratio: float
    scatter: float
    p_value: float

    shown_by = "verdicts.contradiction_text"


def contradicting_values(
    histories: Sequence[History], values: Sequence[tuple[SingleValue | None, SingleValue | None]]
) -> ContradictingValues | None:
    """The contradiction between the minimum rates and the rupture times of tests without frames; None where none is.

    values : end and minimum rate of each history; run-outs and ends that were not compared are not judged. Where fewer
    than FEWEST_VALUES tests state both, rates are judged by themselves, and so are times.
    """
    rates = np.array([_log_ratio(rate) for _, rate in values])
    times = np.array([np.nan if h.outputs else _log_ratio(end) for h, (end, _) in zip(histories, values, strict=True)])
    if not (np.isfinite(rates).any() and np.isfinite(times).any()):
        return None
    both = rates + times
    judged = [both] if np.isfinite(both).sum() >= FEWEST_VALUES else [rates, times]
    results = [result for y in judged if (result := _regression(histories, y)) is not None]
    if not results:
        return None
    count, scatter, p_value = min(results, key=lambda result: result[2])
    p_value = min(1.0, p_value * len(results))
    if p_value >= SIGNIFICANCE:
        return None
    rate_ratio, time_ratio = (float(np.exp(y[np.isfinite(y)].mean())) for y in (rates, times))
    return ContradictingValues(count, rate_ratio, time_ratio, float(np.exp(scatter)), p_value)


def _log_ratio(one: SingleValue | None) -> float:
    """ln of predicted over measured; NaN where it is not judged or infinite, as of a rupture that never comes."""
    if one is None or one.censored or not one.used or not (np.isfinite(one.ratio) and one.ratio > 0):
        return float("nan")
    return float(np.log(one.ratio))


def _regression(histories: Sequence[History], y: Floats) -> tuple[int, float, float] | None:
    """How many values, their scatter about a constant and trends, and the p-value of these; None of too few values."""
    known = np.flatnonzero(np.isfinite(y))
    tests = [histories[int(k)] for k in known]
    columns = [np.ones(known.size)]
    for x in (
        np.log([float(np.abs(h.loading.program().values).max()) for h in tests]),
        1.0 / np.array([h.mean_temperature for h in tests]),
    ):
        if known.size and np.ptp(x) > 1e-3 * np.abs(x).max():
            columns.append((x - x.mean()) / x.std())
    design = np.stack(columns, axis=1)
    freedom = known.size - design.shape[1]
    if known.size < FEWEST_VALUES or freedom < 3:
        return None
    left = y[known] - design @ np.linalg.lstsq(design, y[known], rcond=None)[0]
    variance = max(float((left**2).sum()) / freedom, 1e-12)
    explained = float((y[known] ** 2).sum() - (left**2).sum()) / design.shape[1]
    return known.size, float(np.sqrt(variance)), float(f.sf(explained / variance, design.shape[1], freedom))
