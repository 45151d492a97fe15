"""forecast: what tests will show by an identified law, or by the laws of a ranking, with bands and times."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import single_threaded_blas
from creepkit.errors import FitError
from creepkit.forecasts.draws import check_tolerances, law_draws
from creepkit.forecasts.forecast_of_test import forecast_test
from creepkit.forecasts.results import TestForecast
from creepkit.inverse.composite_predictor import CompositePredictor, underlying_specimen
from creepkit.inverse.identification import Identification
from creepkit.inverse.predictor_documents import registered_specimens
from creepkit.inverse.uncertainty.model_averaging import ModelAverage, WeightedLaws
from creepkit.presentation import Presentable, present
from creepkit.records import History, Predictor
from creepkit.registry.arguments import check_histories, resolve_predictors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWS = 500
"""Of the law, of each test's own rate, and of its dimensions."""


LEAST_WEIGHT = 1e-2
"""Of a law of a ranking, below which it is left out."""


DEFAULT_TARGETS: Mapping[str, Sequence[float]] = {"strain": (0.01,)}
"""Outputs, and values of them, the times to which are forecast where none are asked for."""


@dataclass(frozen=True, eq=False)
class Forecast(Presentable):
    """What tests will show: the result of forecast().

    laws : {law: weight}. level : probability that a pointwise band holds a measured value, a simultaneous band a whole
    curve, and an interval a time, of a single test. tests : one forecast each.
    """

    laws: Mapping[str, float]
    level: float
    tests: tuple[TestForecast, ...]

    def __getitem__(self, test: str) -> TestForecast:
        """The forecast of one test, by name."""
        for one in self.tests:
            if one.name == test:
                return one
        raise FitError(
            f"there is no forecast of a test '{test}'; there are those of {', '.join(t.name for t in self.tests)}"
        )

    def plot(self, path: str | Path | None = None) -> Figure:
        """Curves with bands, measured points over them, times on the axis, and what the bands are made of."""
        return present(self, "plot", path)


def forecast(
    source: Identification | WeightedLaws | ModelAverage,
    tests: History | Sequence[History],
    *,
    level: float = 0.95,
    targets: Mapping[str, Sequence[float]] | None = None,
    tolerances: Mapping[str, float] | None = None,
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    draws: int = DRAWS,
    progress: Callable[[str, int, int], None] | None = None,
) -> Forecast:
    """What tests will show, by an identified law or over all laws of a ranking, with bands and intervals.

    source : an identification, a ranking or a model average. tests : histories, measured or planned (without outputs);
        of any specimen, not only that of the fitted tests.
    level : of bands and intervals. targets : {output: values} the times to which are asked for, such as
        {"amplitude": [0.5]}, in the output's unit; a strain of 0.01 by default.
    tolerances : {kind: standard deviation} of what is not exactly known of a test, in the unit of the nuisance
        parameter of that kind, {"thickness": 0.01}; by default as the fit estimated it, else as the specimen states it.
    using : what predicts them, by default their specimens with the settings of the identification.
    draws : of the law and of all else that a band is made of. The seed of random numbers is that of
        the identification's settings.
    """
    if not 0.5 <= level < 1.0:
        raise FitError(f"level is {level:g}; give a probability from 0.5 to below 1, such as 0.95")
    if not 50 <= draws <= 100_000:
        raise FitError(f"draws is {draws}; allowed are 50 to 100000")
    histories = check_histories([tests] if isinstance(tests, History) else list(tests))
    for history in histories:
        if not history.times[-1] > 0:
            raise FitError(f"history '{history.name}' has no time above zero; give those at which it is to be forecast")
    average = source if isinstance(source, ModelAverage) else ModelAverage.from_ranking(source)
    weighted = [(f, w) for f, w in zip(average.fits, average.weights, strict=True) if w >= LEAST_WEIGHT]
    asked = dict(DEFAULT_TARGETS if targets is None else targets)
    predictors = [_predictor(weighted[0][0], history, using) for history in histories]
    if tolerances:
        check_tolerances(
            tolerances,
            histories,
            CompositePredictor({h.specimen: p for h, p in zip(histories, predictors, strict=True)}),
        )
    _check_targets(asked, targets is not None, predictors)
    made, total = [], sum(w for _, w in weighted)
    with single_threaded_blas():
        for k, (history, predictor) in enumerate(zip(histories, predictors, strict=True)):
            if progress is not None:
                progress("tests", k, len(histories))
            rng = np.random.default_rng([average.fits[0].settings.seed, k])
            laws = [(law_draws(f, max(round(draws * w / total), 2), rng), w) for f, w in weighted]
            made.append(
                forecast_test(
                    laws, history, predictor, level=level, targets=asked, tolerances=tolerances or {}, rng=rng
                )
            )
    if progress is not None:
        progress("tests", len(histories), len(histories))
    return Forecast({f.law.name: float(w) for f, w in weighted}, level, tuple(made))


def _predictor(
    fit: Identification, history: History, using: Predictor | str | Mapping[str, Predictor | str] | None
) -> Predictor:
    """What predicts one test: as asked, else its specimen as it was fitted, else as it is registered."""
    if using is None and fit.predictor is not None:
        known = registered_specimens(underlying_specimen(fit.predictor))
        if history.specimen in known:
            return known[history.specimen]
        if not known:
            return fit.predictor
    resolved = resolve_predictors(using, [history])
    return resolved[history.specimen] if isinstance(resolved, Mapping) else resolved


def _check_targets(targets: Mapping[str, Sequence[float]], asked: bool, predictors: Sequence[Predictor]) -> None:
    known = dict.fromkeys(name for p in predictors for name in getattr(p, "outputs", ()))
    for output, values in targets.items():
        if asked and known and output not in known:
            raise FitError(f"no test has an output '{output}' to reach; there are {', '.join(known)}")
        if not all(np.isfinite(v) and v > 0 for v in values):
            raise FitError(f"targets of {output} are {list(values)}; give numbers above zero, in its unit")
