"""forecast: what tests will show by an identified law, or by the laws of a ranking, with bands and times."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from creepkit import limits
from creepkit.arrays import single_threaded_blas
from creepkit.checked_arguments import checked
from creepkit.errors import FitError, nearest
from creepkit.forecasts.draws import check_tolerances, law_draws
from creepkit.forecasts.forecast_of_test import TestForecast, forecast_test
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.extrapolation import check_isothermal
from creepkit.inverse.identification import Identification
from creepkit.inverse.predictor_documents import registered_specimens
from creepkit.inverse.selection.ranking import ModelAverage, Ranking
from creepkit.language import temperature
from creepkit.records import History, Predictor, outputs_of
from creepkit.records.presentable import Plotted, Presentable, Tabulated
from creepkit.registry.arguments import resolve_predictors

DRAWS, COSTLY_DRAWS = 4000, 800
"""Of the law, of each test's own rate, and of its dimensions; and where each is a simulation by finite elements."""


LEAST_WEIGHT, LEAST_DRAWS = 1e-2, 5
"""Of the laws that are left out of a ranking, together; and draws of each of the others at least."""


DEFAULT_TARGETS: Mapping[str, Sequence[float] | float] = {"strain": (0.01,)}
"""Outputs, and values of them, the times to which are forecast where none are asked for."""


@checked
@dataclass(frozen=True, eq=False)
class Forecast(Presentable, Plotted, Tabulated):
    """What tests will show: the result of forecast().

    laws : {law: weight}; left_out : how many laws of a ranking have too little weight to count.
    level : probability that a pointwise band holds a measured value, a simultaneous band a whole curve, and an interval
    a time, of a single test, if the law is right. tests : one forecast each.
    rejected : whether the tests contradict the law of most weight, so that bands and intervals do not have this
    probability. draws : of the law, of each test's own rate and of its dimensions, in each test; the largest number.
    asked : whether times to values were asked for, and not what is shown at the end of each test.
    """

    laws: Mapping[str, float]
    level: float
    tests: tuple[TestForecast, ...]
    left_out: int = 0
    rejected: bool = False
    draws: int = 0
    asked: bool = False

    def __repr__(self) -> str:
        return f"<Forecast of {', '.join(test.name for test in self.tests)} by {', '.join(self.laws)}>"

    def __getitem__(self, test: str) -> TestForecast:
        """The forecast of one test, by name."""
        known = {one.name: one for one in self.tests}
        if test not in known:
            raise FitError(f"there is no forecast of a test '{test}'; there are those of {', '.join(known)}")
        return known[test]

    drawn_by = "forecast.forecast_figure", "forecast.draw_forecast"

    shown_by, detailed_by = "forecast.forecast_answer", "forecast.forecast_blocks"


@checked
def forecast(
    source: Identification | Ranking | ModelAverage,
    tests: History | Sequence[History],
    *,
    level: float = 0.95,
    targets: Mapping[str, Sequence[float] | float] | None = None,
    tolerances: Mapping[str, float] | None = None,
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    draws: Annotated[int, limits.BAND_DRAWS] | None = None,
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
    draws : of the law and of all else that a band is made of; by default 4000 of a bar, and 800 where each is a
        simulation by finite elements. The seed of random numbers is that of the identification's settings.
    """
    if not 0.5 <= level < 1.0:
        raise FitError(f"level is {level!r}; give a probability from 0.5 to below 1, such as 0.95")
    histories = [tests] if isinstance(tests, History) else list(tests)
    if not histories:
        raise FitError("there is no test to forecast; give histories, measured or planned")
    for history in histories:
        if not history.times[-1] > 0:
            raise FitError(f"history '{history.name}' has no time above zero; give those at which it is to be forecast")
    weighted = _weighted_laws(source)
    tolerances = {kind: float(sd) for kind, sd in (tolerances or {}).items()}
    for kind in tolerances:
        if kind.startswith("temperature") and not any(f.law.uses(temperature) for f, _ in weighted):
            raise FitError(f"the tolerance of '{kind}' changes nothing: no law has a temperature; leave it out")
    given = DEFAULT_TARGETS if targets is None else targets
    asked = {output: [float(v) for v in np.atleast_1d(values)] for output, values in given.items()}
    for history in histories:
        check_isothermal([f.law for f, _ in weighted], weighted[0][0].ranges, history.temperature_program().values)
    predictors = [_predictor(weighted[0][0], history, using) for history in histories]
    if tolerances:
        check_tolerances(
            tolerances,
            histories,
            CompositePredictor({h.specimen: p for h, p in zip(histories, predictors, strict=True)}),
        )
    _check_targets(asked, targets is not None, predictors)
    made, most_draws = [], 0
    with single_threaded_blas():
        for k, (history, predictor) in enumerate(zip(histories, predictors, strict=True)):
            if progress is not None:
                progress("tests", k, len(histories))
            rng = np.random.default_rng([weighted[0][0].settings.seed, zlib.crc32(history.name.encode())])
            count = draws or (DRAWS if predictor.reduced_order_model() is None else COSTLY_DRAWS)
            most_draws = max(most_draws, count)
            laws = [(law_draws(f, max(round(count * w), LEAST_DRAWS), rng), w) for f, w in weighted]
            made.append(
                forecast_test(laws, history, predictor, level=level, targets=asked, tolerances=tolerances, rng=rng)
            )
    if progress is not None:
        progress("tests", len(histories), len(histories))
    tried = len(source.fits) if isinstance(source, ModelAverage) else len(getattr(source, "laws", weighted))
    adequacy = weighted[0][0].adequacy
    rejected = adequacy is not None and adequacy.verdict == "leaves a discrepancy"
    weights: dict[str, float] = {}  # identifications of one law add theirs
    for fit, weight in weighted:
        weights[fit.law.name] = weights.get(fit.law.name, 0.0) + float(weight)
    return Forecast(weights, level, tuple(made), tried - len(weighted), rejected, most_draws, targets is not None)


def _predictor(
    fit: Identification, history: History, using: Predictor | str | Mapping[str, Predictor | str] | None
) -> Predictor:
    """What predicts one test: as asked, else its specimen as it was fitted, else as it is registered."""
    if using is None and fit.predictor is not None:
        known = registered_specimens(fit.predictor.specimen)
        if history.specimen in known:
            return known[history.specimen]
        if not known:
            return fit.predictor
    if isinstance(using, Mapping) and history.specimen not in using:
        raise FitError(f"using= says nothing of specimen '{history.specimen}' of test '{history.name}'; name it there")
    resolved = resolve_predictors(using, [history])
    return resolved[history.specimen] if isinstance(resolved, Mapping) else resolved


def _weighted_laws(source: Identification | Ranking | ModelAverage) -> list[tuple[Identification, float]]:
    """The laws that count, with weights that add up to one: those of least weight are left out."""
    average = source if isinstance(source, ModelAverage) else ModelAverage.from_ranking(source)
    ordered = sorted(zip(average.fits, average.weights, strict=True), key=lambda pair: -pair[1])
    before = np.cumsum([0.0, *(weight for _, weight in ordered)])
    kept = [pair for pair, total in zip(ordered, before, strict=False) if total < 1.0 - LEAST_WEIGHT]
    return [(fit, weight / before[len(kept)]) for fit, weight in kept]


MOST_TARGETS = 50


def _check_targets(targets: Mapping[str, Sequence[float]], asked: bool, predictors: Sequence[Predictor]) -> None:
    """FitError for a target of what no test has, or that is not above zero."""
    if sum(len(values) for values in targets.values()) > MOST_TARGETS:
        raise FitError(f"there are more than {MOST_TARGETS} targets; ask for those that matter")
    known = list(dict.fromkeys(name for p in predictors for name in outputs_of(p)))
    for output, values in targets.items():
        if asked and known and output not in known:
            raise FitError(f"no test has an output '{output}' to reach; {nearest(output, known)}")
        if not all(np.isfinite(v) and v > 0 for v in values):
            raise FitError(f"targets of {output} are {list(values)}; give numbers above zero, in its unit")
