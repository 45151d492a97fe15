"""The forecast of one test: its curves with bands, what the bands are made of, and the times that are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.forecasts.bands import Band, band_of_draws
from creepkit.forecasts.draws import (
    SOURCES,
    Dimension,
    LawDraws,
    dimension_draws,
    dimensions_of,
    factor_variances,
    log_factor_draws,
    unseen_levels,
)
from creepkit.forecasts.measured_test import TestScore, mean_law_covariance, score_test
from creepkit.forecasts.simulation import (
    TestCurves,
    TestSensitivities,
    at_times,
    central_curves,
    corrected,
    crossing_times,
    curves,
    drawing_predictor,
    drawn_theta,
    followed_history,
    sensitivities_at_values,
)
from creepkit.inverse.composite_predictor import predictor_for
from creepkit.inverse.extrapolation import extrapolation_text
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import OutputNoise
from creepkit.inverse.observation_vector import (
    LINEAR_COORDINATE_LENGTH,
    LOGARITHMIC_OUTPUTS,
    RELATIVE_DISCREPANCY_UNIT,
    RUPTURE_OUTPUT,
    noise_standard_deviation,
    usable_frames,
)
from creepkit.inverse.output_transforms import LinearTransform, LogTransform, OutputTransform
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.inverse.uncertainty.rate_scatter import USUAL_SD
from creepkit.records import History, Predictor, output_unit

LAW, CHOICE_OF_LAW, OFFSET, NOISE, MISFIT, NUMERICAL = (
    "parameters of the law",
    "choice of the law",
    "offset",
    "noise",
    "misfit of the law",
    "numerical error",
)
"""Parts of a band, beside the scatter of rates and the dimensions."""


SMALLEST_STRAIN_RATIO = 1e-3
"""Floor of the logarithmic scale of a strain in a band, over its largest value."""


@dataclass(frozen=True, eq=False)
class OutputForecast:
    """One output of one test.

    times : (times,) s. value : (times,) at the identified values. band : of measured values.
    shares : {part of the band: (times,) its share of the variance}, to first order, in the logarithm of a strain.
    """

    output: str
    times: Floats
    value: Floats
    band: Band
    shares: Mapping[str, Floats]


@dataclass(frozen=True)
class TimeForecast:
    """When an output reaches a value, or the specimen breaks.

    event : in words. value : s, at the identified values; median, low, high : of a single test. All may be infinite.
    measured : s, NaN where it is not known; censored : whether the test was stopped then, unbroken.
    chance : probability that it comes before the last time of the test.
    """

    event: str
    value: float
    median: float
    low: float
    high: float
    chance: float
    measured: float = float("nan")
    censored: bool = False

    @property
    def inside(self) -> bool | None:
        """Whether the measured time lies within the interval; None where nothing was measured."""
        if not np.isfinite(self.measured):
            return None
        return self.measured <= self.high if self.censored else self.low <= self.measured <= self.high


@dataclass(frozen=True, eq=False)
class TestForecast:
    """The forecast of one test.

    outputs : {name: its curve and band}. times : to targets and to rupture. score : of a measured test, else None.
    includes : what the bands are made of, with sizes. extrapolation : beyond the fitted ranges, in one sentence, or "".
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    history: History
    outputs: Mapping[str, OutputForecast]
    times: tuple[TimeForecast, ...]
    includes: Mapping[str, str]
    extrapolation: str = ""
    score: TestScore | None = None
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the test."""
        return self.history.name


@dataclass(frozen=True, eq=False)
class DrawnLaw:
    """What one law says of one test.

    drawn : draws of its curves, at its times and up to rupture; central : at the identified values.
    factor_variances : {level: variance of ln of the test's own factor on the rate}.
    numerical : {output: standard deviation}, in its unit.
    """

    draws: LawDraws
    weight: float
    drawn: TestCurves
    central: TestCurves
    dimensions: Sequence[Dimension]
    factor_variances: Mapping[str, float]
    sensitivities: TestSensitivities
    numerical: Mapping[str, float]


def forecast_test(
    laws: Sequence[tuple[LawDraws, float]],
    history: History,
    predictor: Predictor,
    *,
    level: float,
    targets: Mapping[str, Sequence[float]],
    tolerances: Mapping[str, float],
    rng: np.random.Generator,
) -> TestForecast:
    """The forecast of one test by weighted laws."""
    drawn = [_drawn_law(draws, weight, history, predictor, tolerances, rng) for draws, weight in laws]
    best = max(drawn, key=lambda one: one.weight)
    fit = best.draws.fit
    outputs = {
        name: _output_forecast(drawn, best, history, name, level, rng)
        for name in best.central.outputs
        if np.isfinite(at_times(best.central, history.times).of(name)).any()
    }
    times = _times(drawn, best, history, targets, level, rng)
    notes = _notes(fit, history, outputs)
    score = None
    if any(usable_frames(history, name).any() for name in history.outputs if name in outputs):
        score, problem = _score(best, history, predictor, outputs)
        notes += [problem] if problem else []
    includes = _includes(drawn, best, outputs)
    return TestForecast(
        history, outputs, times, includes, _extrapolation(history, predictor, best), score, tuple(notes)
    )


def _drawn_law(
    draws: LawDraws,
    weight: float,
    history: History,
    predictor: Predictor,
    tolerances: Mapping[str, float],
    rng: np.random.Generator,
) -> DrawnLaw:
    fit = draws.fit
    dimensions = dimensions_of(fit, history, predictor, tolerances)
    centre = {d.kind: d.mean for d in dimensions}
    followed, own = followed_history(history, predictor), predictor_for(predictor, history)
    central, numerical = central_curves(fit, predictor, followed, centre)
    cheaper = drawing_predictor(fit, predictor, history, [*centre])
    factors = log_factor_draws(draws, history, rng)
    nuisances = dimension_draws(dimensions, draws, rng)
    drawn = curves(fit, cheaper, followed, drawn_theta(fit, draws.u), np.sum([*factors.values()], axis=0), nuisances)
    if cheaper is not own or numerical:
        values, fixed = fit.coordinates.theta(fit.u)[None], {kind: np.array([[v]]) for kind, v in centre.items()}
        drawn = corrected(drawn, curves(fit, cheaper, followed, values, np.zeros(1), fixed), central)
    return DrawnLaw(
        draws,
        weight,
        drawn,
        central,
        dimensions,
        factor_variances(draws, history),
        sensitivities_at_values(fit, own, history, centre),
        numerical,
    )


# ---- curves --------------------------------------------------------------------------------------------------


def _output_forecast(
    drawn: Sequence[DrawnLaw], best: DrawnLaw, history: History, name: str, level: float, rng: np.random.Generator
) -> OutputForecast:
    fit, central = best.draws.fit, at_times(best.central, history.times).of(name)[0]
    transform = _transform_of(fit, name, central)
    leading = best.central.outputs[0] == name
    smooth, white = _noise_in_output(fit, history, name, central, transform)
    parts = []
    for one in drawn:
        values = at_times(one.drawn, history.times).of(name)
        if name in fit.noise_model.outputs:
            values = values + fit.noise_model[name].offset * rng.standard_normal((len(values), 1))
        parts.append(values + one.numerical.get(name, 0.0) * rng.standard_normal((len(values), 1)))
    values = np.concatenate(parts)
    alive = np.isfinite(values)
    g = transform.forward(np.where(alive, values, 0.0)) + rng.standard_normal((len(values), smooth.shape[1])) @ smooth.T
    values = np.where(alive, transform.inverse(g), np.nan)
    grows = leading and _increases(central)
    band = band_of_draws(values, white, transform, level, rng, grows=grows)
    shares = _shares(drawn, best, history, name, transform, smooth, white)
    return OutputForecast(name, history.times, central, band, shares)


def _increases(values: Floats) -> bool:
    finite = values[np.isfinite(values)]
    return bool(finite.size < 2 or finite[-1] >= finite[0])


def _transform_of(fit: Identification, name: str, central: Floats) -> OutputTransform:
    largest = float(np.nanmax(np.abs(central), initial=0.0))
    if name in LOGARITHMIC_OUTPUTS:
        known = fit.noise_model.outputs.get(name)
        noise = 0.0 if known is None else max(known.noise, known.offset)
        return LogTransform(max(SMALLEST_STRAIN_RATIO * largest, noise, 1e-14))
    scale = fit.scatter_of_rates.output_scales.get(name, 0.0) or max(float(np.nanstd(central)), 1e-12 + 1e-3 * largest)
    return LinearTransform(scale, largest)


def _noise_in_output(
    fit: Identification, history: History, name: str, central: Floats, transform: OutputTransform
) -> tuple[Floats, Floats]:
    """Root of the covariance of correlated noise (times, times), and white noise (times,), in the transformed output.

    Of an output that was not fitted only what the history states is known.
    """
    times = history.times
    slope = transform.derivative(np.where(np.isfinite(central), central, 0.0))
    known: OutputNoise | None = fit.noise_model.outputs.get(name)
    if name in history.outputs and usable_frames(history, name).any():
        frame = noise_standard_deviation(history, name)
    else:
        stated = history.standard_deviation.get(name)
        frame = stated if stated is not None else np.full(times.size, 0.0 if known is None else known.noise)
    frame = np.where(np.isfinite(frame), frame, 0.0)
    if known is None:
        return np.zeros((times.size, 0)), np.abs(slope * frame)
    logarithmic = name in LOGARITHMIC_OUTPUTS
    coordinate = (
        np.log(np.maximum(times, 1e-9 * times[-1]))
        if logarithmic
        else LINEAR_COORDINATE_LENGTH * times / max(float(times[-1]), 1e-300)
    )
    unit = RELATIVE_DISCREPANCY_UNIT if logarithmic else known.noise / float(getattr(transform, "scale", 1.0))
    lags = np.abs(coordinate[:, None] - coordinate[None, :])
    total = known.drift**2 * np.exp(-lags / known.correlation_length)
    total = total + (fit.noise_model.discrepancy * unit) ** 2 * np.exp(-lags / fit.noise_model.discrepancy_length)
    size = float(total[0, 0])
    # Where a strain is small beside its floor, so is what is relative to it.
    visible = np.abs(slope * central) if logarithmic else np.ones(times.size)
    visible = np.where(np.isfinite(visible), np.minimum(visible, 1.0), 0.0)
    root = (
        np.linalg.cholesky(total + 1e-9 * size * np.eye(times.size)) * visible[:, None]
        if size > 0
        else np.zeros((times.size, 0))
    )
    return root, np.hypot(slope * frame, known.misfit * visible)


def _shares(
    drawn: Sequence[DrawnLaw],
    best: DrawnLaw,
    history: History,
    name: str,
    transform: OutputTransform,
    smooth: Floats,
    white: Floats,
) -> dict[str, Floats]:
    """{part: (times,) share of the variance}, to first order, in the transformed output."""
    total_weight = sum(one.weight for one in drawn)
    variances: dict[str, Floats] = {}
    for one in drawn:
        for part, value in _law_variances(one, history, name, transform).items():
            variances[part] = variances.get(part, 0.0) + one.weight / total_weight * value
    fit = best.draws.fit
    known = fit.noise_model.outputs.get(name)
    central = at_times(best.central, history.times).of(name)[0]
    slope = transform.derivative(np.where(np.isfinite(central), central, 0.0))
    if len(drawn) > 1:
        g = np.stack(
            [transform.forward(np.nan_to_num(at_times(one.central, history.times).of(name)[0])) for one in drawn]
        )
        weight = np.array([one.weight for one in drawn]) / total_weight
        variances[CHOICE_OF_LAW] = weight @ (g - weight @ g) ** 2
    variances[OFFSET] = (slope * (0.0 if known is None else known.offset)) ** 2
    variances[NUMERICAL] = (slope * best.numerical.get(name, 0.0)) ** 2
    misfit = 0.0 if known is None else known.misfit
    discrepancy = (smooth**2).sum(axis=1) if smooth.size else np.zeros(history.times.size)
    drift = known.drift**2 if known is not None else 0.0
    both = drift + _discrepancy_variance(fit, name, transform)
    share_of_drift = drift / both if both > 0 else 0.0
    variances[NOISE] = np.maximum(white**2 - misfit**2, 0.0) + discrepancy * share_of_drift
    variances[MISFIT] = np.minimum(misfit**2, white**2) + discrepancy * (1.0 - share_of_drift)
    total = np.sum([*variances.values()], axis=0)
    return {
        part: np.where(total > 0, value / np.maximum(total, 1e-300), 0.0)
        for part, value in variances.items()
        if np.nanmax(value, initial=0.0) > 0
    }


def _discrepancy_variance(fit: Identification, name: str, transform: OutputTransform) -> float:
    known = fit.noise_model.outputs.get(name)
    if known is None:
        return 0.0
    logarithmic = name in LOGARITHMIC_OUTPUTS
    unit = RELATIVE_DISCREPANCY_UNIT if logarithmic else known.noise / float(getattr(transform, "scale", 1.0))
    return float((fit.noise_model.discrepancy * unit) ** 2)


def _law_variances(one: DrawnLaw, history: History, name: str, transform: OutputTransform) -> dict[str, Floats]:
    """{part: (times,) variance of the transformed output} by parameters, scatter of rates and dimensions of one law."""
    central, column = at_times(one.central, history.times).of(name)[0], one.sensitivities.outputs.index(name)
    slope = transform.derivative(np.where(np.isfinite(central), central, 0.0))[:, None]
    by_law = slope * one.sensitivities.coordinates[:, column]
    variances = {LAW: np.einsum("ti,ij,tj->t", by_law, mean_law_covariance(one.draws.fit), by_law)}
    rate = slope[:, 0] * one.sensitivities.rate[:, column]
    for level, variance in one.factor_variances.items():
        variances[SOURCES[level]] = rate**2 * variance
    for dimension in one.dimensions:
        change = slope[:, 0] * one.sensitivities.dimensions[dimension.kind][:, column] * dimension.sd
        variances[dimension.kind] = change**2
    return variances


# ---- times ---------------------------------------------------------------------------------------------------


def _times(
    drawn: Sequence[DrawnLaw],
    best: DrawnLaw,
    history: History,
    targets: Mapping[str, Sequence[float]],
    level: float,
    rng: np.random.Generator,
) -> tuple[TimeForecast, ...]:
    """Times to targets of outputs that are predicted, and to rupture."""
    forecasts = []
    for output, values in targets.items():
        for target in values if output in best.central.outputs else ():
            crossings = np.concatenate([crossing_times(one.drawn, output, target) for one in drawn])
            value = float(crossing_times(best.central, output, target)[0])
            event = f"{output.replace('_', ' ')} {target:g} {output_unit(output)}".strip()
            measured = _measured_crossing(history, output, target)
            forecasts.append(_time_forecast(event, value, crossings, history, level, measured, censored=False))
    ends = np.concatenate([one.drawn.end_times for one in drawn])
    fit = best.draws.fit
    if RUPTURE_OUTPUT in fit.noise_model.outputs:
        ends = ends * np.exp(fit.noise_model[RUPTURE_OUTPUT].misfit * rng.standard_normal(ends.size))
    asked = history.end_known or RUPTURE_OUTPUT in fit.noise_model.outputs or RUPTURE_OUTPUT in targets
    if np.isfinite(ends).any() and (asked or (ends <= history.times[-1]).any()):
        measured = history.rupture_time or (float(history.times[-1]) if history.unruptured else float("nan"))
        value = float(best.central.end_times[0])
        forecasts.append(_time_forecast("rupture", value, ends, history, level, measured, censored=history.unruptured))
    return tuple(forecasts)


def _time_forecast(
    event: str, value: float, times: Floats, history: History, level: float, measured: float, *, censored: bool
) -> TimeForecast:
    known = np.sort(times[~np.isnan(times)])
    if not known.size:
        known = np.array([np.inf])
    low, median, high = (
        float(known[min(int(p * known.size), known.size - 1)]) for p in (0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level)
    )
    chance = float((known <= history.times[-1]).mean())
    return TimeForecast(event, value, median, low, high, chance, measured, censored)


def _measured_crossing(history: History, output: str, target: float) -> float:
    """s, when the measured output first reaches a target; NaN where it does not, or is not measured."""
    if output not in history.outputs:
        return float("nan")
    used = usable_frames(history, output)
    times, values = history.times[used], history.outputs[output][used]
    reached = np.flatnonzero(values >= target)
    if not reached.size or reached[0] == 0:
        return float("nan")
    k = int(reached[0])
    return float(np.interp(target, values[k - 1 : k + 1], times[k - 1 : k + 1]))


# ---- what is said beside it ----------------------------------------------------------------------------------


def _score(
    best: DrawnLaw, history: History, predictor: Predictor, outputs: Mapping[str, OutputForecast]
) -> tuple[TestScore | None, str]:
    """The score of a measured test, or why it has none."""
    inside, whole = {}, {}
    for name, forecast in outputs.items():
        if name not in history.outputs or not usable_frames(history, name).any():
            continue
        used = usable_frames(history, name) & (history.times > 0)
        values, band = history.outputs[name][used], forecast.band
        within = (values >= band.low[used]) & (values <= band.high[used])
        inside[name] = float(within.mean())
        whole[name] = bool(((values >= band.lowest[used]) & (values <= band.highest[used])).all())
    try:
        score = score_test(
            best.draws.fit, predictor, history, best.dimensions, sum(best.factor_variances.values()), (inside, whole)
        )
    except CreepkitError as error:
        return None, f"no score: {error}"
    return score, ""


def _includes(drawn: Sequence[DrawnLaw], best: DrawnLaw, outputs: Mapping[str, OutputForecast]) -> dict[str, str]:
    """{part of the band: its size in words}."""
    fit = best.draws.fit
    parts = {LAW: "posterior covariance of its parameters" if fit.samples is None else "samples of their posterior"}
    if len(drawn) > 1:
        parts[CHOICE_OF_LAW] = ", ".join(f"{one.draws.fit.law.name} ({one.weight:.2g})" for one in drawn)
    for level, variance in best.factor_variances.items():
        if variance > 0:
            parts[SOURCES[level]] = f"{100 * np.sqrt(variance):.2g} % of the rate"
    for dimension in best.dimensions:
        parts[dimension.kind] = f"{dimension.mean:.4g} ± {dimension.sd:.2g} {UNITS.get(dimension.kind, '')}".strip()
    for name in outputs:
        known, unit = fit.noise_model.outputs.get(name), output_unit(name)
        if known is None:
            continue
        for part, size in ((OFFSET, known.offset), (NOISE, known.noise)):
            if size > 0:
                text = f"{name} {size:.2g} {unit}".strip()
                parts[part] = f"{parts[part]}, {text}" if part in parts else text
        if best.numerical.get(name, 0.0) > 0:
            text = f"{name} {best.numerical[name]:.2g} {unit}".strip()
            parts[NUMERICAL] = f"{parts[NUMERICAL]}, {text}" if NUMERICAL in parts else text
        if known.misfit > 0 or fit.noise_model.discrepancy > 0:
            parts[MISFIT] = "what the fitted tests showed beside the law"
    return parts


NEARBY = {"stress": 0.01, "temperature": 0.002, "time": 0.1, "strain": 0.1}
"""Relative distances beyond the fitted ranges within which nothing is said of them."""


UNITS = {"thickness": "mm", "window": "mm", "temperature": "K", "temperature drift": "K"}
"""Of dimensions; others are relative."""


def _extrapolation(history: History, predictor: Predictor, best: DrawnLaw) -> str:
    fit, temperatures = best.draws.fit, history.temperature_program().at(history.times)
    stresses = reference_stresses(history, predictor)
    point = {"stress": stresses[stresses > 0], "temperature": temperatures, "time": history.times[-1:]}
    if "strain" in best.central.outputs:
        strain = at_times(best.central, history.times).of("strain")[0]
        point["strain"] = np.array([np.nanmax(strain, initial=0.0)])
    return extrapolation_text(fit.ranges, point, NEARBY)


def _notes(fit: Identification, history: History, outputs: Mapping[str, OutputForecast]) -> list[str]:
    notes = []
    if any(m.name == history.name for m in fit.tests):
        notes.append("this test was fitted: the forecast is that of another one like it")
    unknown = [name for name in outputs if name not in fit.noise_model.outputs]
    if unknown:
        notes.append(f"no fitted test shows the noise of {' and '.join(unknown)}; it is not in the band")
    if fit.scatter_of_rates.known is None and len(fit.tests) < FEW_TESTS:
        notes.append(
            f"{len(fit.tests)} test{'s say' if len(fit.tests) > 1 else ' says'} little of the scatter between tests: "
            f"what is usual, some {100 * USUAL_SD['test']:.0f} % of the rate at most, stands for it"
        )
    for level in unseen_levels(fit, history):
        notes.append(
            f"all fitted tests are of one {level}, and this is of another: the scatter between them is what is usual, "
            f"up to {100 * USUAL_SD[level]:.0f} % of the rate"
        )
    return notes


FEW_TESTS = 5
"""Below so many tests their number is mentioned."""
