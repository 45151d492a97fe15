"""Goodness of fit: errors of every output, of every test and of all tests, and of predicted rupture times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import compared_outputs, predict_to_rupture, predictor_for, predicts_rupture
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.noise_model import NoiseModel, Residuals
from creepkit.inverse.observation_vector import (
    LOGARITHMIC_OUTPUTS,
    RUPTURE_OUTPUT,
    noise_standard_deviation,
    usable_frames,
)
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.uncertainty.mixture_distribution import NORMAL_FREEDOM, MixtureDistribution
from creepkit.inverse.uncertainty.rate_scatter import RateScatter
from creepkit.records import History, Prediction, Predictor, constant_stress


def relative_squared_error(
    measured: Sequence[ArrayLike], predicted: Sequence[ArrayLike], about: Literal["all", "test", "frame"] = "all"
) -> float:
    """Return sum (p - m)^2 / sum (m - mean)^2 over all frames of all tests.

    measured, predicted : (frames,) of each test, in one unit.
    """
    measured_arrays = [np.asarray(m, float) for m in measured]
    squares = sum(
        float(((np.asarray(p, float) - m) ** 2).sum()) for m, p in zip(measured_arrays, predicted, strict=True)
    )
    return (
        squares / total_sum_of_squares(measured_arrays, about)
        if total_sum_of_squares(measured_arrays, about) > 0
        else float("nan")
    )


def total_sum_of_squares(tests: Sequence[Floats], about: Literal["all", "test", "frame"] = "all") -> float:
    """Sum of (m - mean)^2 over all frames of all tests; tests : (frames,) of each."""
    if about == "test":
        return sum(float(((m - m.mean()) ** 2).sum()) for m in tests if m.size)
    if about == "all":
        joined = np.concatenate(tests) if tests else np.zeros(0)
        return float(((joined - joined.mean()) ** 2).sum()) if joined.size else 0.0
    if len({m.size for m in tests}) > 1:
        raise FitError('about="frame" needs tests of as many frames each; use "all" or "test"')
    table = np.stack(tests)
    return float(((table - table.mean(axis=0)) ** 2).sum())


@dataclass(frozen=True)
class OutputErrors:
    """Errors of one output, of one test or of all.

    frames : how many were compared. relative_squared_error : about the mean of just these frames.
    mean_squared_error, mean_absolute_error : in the output's unit (squared).
    relative_rms_error : rms error over the rms of what was measured.
    chi_square : mean of (error / noise)^2, the reduced chi-square; noise alone gives one.
    NaN where a frame was not predicted.
    """

    frames: int
    relative_squared_error: float
    mean_squared_error: float
    mean_absolute_error: float
    relative_rms_error: float
    chi_square: float


def output_errors(measured: Floats, predicted: Floats, noise: Floats) -> OutputErrors:
    """Errors of predicted values; measured, predicted : (frames,); noise : (frames,) standard deviations."""
    nan = float("nan")
    if measured.size == 0:
        return OutputErrors(0, nan, nan, nan, nan, nan)
    deviation = predicted - measured
    mse = float(np.mean(deviation**2))
    mean_square = float(np.mean(measured**2))
    known = noise > 0
    chi_square = float(np.mean((deviation[known] / noise[known]) ** 2)) if known.any() else nan
    return OutputErrors(
        measured.size,
        relative_squared_error([measured], [predicted]),
        mse,
        float(np.mean(np.abs(deviation))),
        float(np.sqrt(mse / mean_square)) if mean_square > 0 else nan,
        chi_square,
    )


@dataclass(frozen=True)
class OutputFit:
    """One output of one test.

    errors : over all used frames of the history, with the test's own offset and nuisances.
    offset : estimated offset that the law does not explain (loading strain), in the output's unit.
    noise : typical standard deviation of a frame, in the output's unit.
    """

    output: str
    errors: OutputErrors
    offset: float = 0.0
    noise: float = 0.0


@dataclass(frozen=True)
class RuptureComparison:
    """The end of one test.

    measured : s, when it ruptured, or how long it lasted where it was stopped before (`censored`).
    predicted : s, by the law alone; infinite where the law predicts no rupture.
    low, high : 95 % interval for a single test, from the parameters and the scatter between tests.
    """

    measured: float
    censored: bool
    predicted: float
    low: float
    high: float

    @property
    def ratio(self) -> float:
        """Predicted over measured."""
        return self.predicted / self.measured


@dataclass(frozen=True)
class TestFit:
    """One test in the fit.

    frames : how many values count (strains above twice the floor of their transform, all frames of other outputs).
    log_strain_rms, log_strain_bias : root mean square and mean of ln((predicted + offset) / measured) over its fitted
        strains, else NaN. For a test followed to rupture, of its orthogonal residual (see inverse.orthogonal_residual).
    rate_factor : estimated factor of this test's creep rate on the law's (heat-to-heat scatter).
    weight : of the test in the fit; below one where test_loss="student" found it far from the others.
    rupture : its end, where that is known and predicted.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    name: str
    condition: str
    frames: int
    log_strain_rms: float
    log_strain_bias: float
    rate_factor: float = 1.0
    weight: float = 1.0
    outputs: tuple[OutputFit, ...] = ()
    rupture: RuptureComparison | None = None

    def __getitem__(self, output: str) -> OutputFit:
        for one in self.outputs:
            if one.output == output:
                return one
        raise FitError(
            f"test '{self.name}' has no output '{output}'; it has {', '.join(o.output for o in self.outputs)}"
        )

    @property
    def offset(self) -> float:
        """Offset of its first output."""
        return self.outputs[0].offset if self.outputs else 0.0


def test_fits(
    problem: LeastSquaresProblem,
    residuals: Residuals,
    random_effects: tuple[Floats, Floats],
    histories: Sequence[History],
    prediction: Prediction,
    ruptures: Sequence[RuptureComparison | None],
) -> tuple[TestFit, ...]:
    """One TestFit for each test.

    random_effects : offsets (tests, outputs) in the output's unit, and ln rate factors (tests,).
    histories, prediction : with all frames; ruptures : how each of them ended.
    """
    offsets, log_factors = random_effects
    observations = problem.observations
    ratios = _log_ratios(problem, residuals, np.take_along_axis(offsets, observations.output_index, axis=1))
    logarithmic = (
        observations.per_observation([float(name in LOGARITHMIC_OUTPUTS) for name in observations.outputs]) > 0
    )
    test_fits = []
    for k, history in enumerate(histories):
        test_ratios = ratios[k][np.isfinite(ratios[k])]
        rms, bias = (
            (float(np.sqrt(np.mean(test_ratios**2))), float(np.mean(test_ratios)))
            if test_ratios.size
            else (np.nan, np.nan)
        )
        linear = int((observations.present[k] & ~logarithmic[k]).sum())
        offset_by_output = {name: float(v) for name, v in zip(observations.outputs, offsets[k], strict=True)}
        outputs = tuple(
            _output_fit(history, name, prediction.of(k)[:, prediction.outputs.index(name)], offset_by_output[name])
            for name in compared_outputs(problem.predictor, history)
            if name in offset_by_output and usable_frames(history, name).any()
        )
        rate_factor, weight = float(np.exp(log_factors[k])), float(residuals.test_weights[k])
        test_fits.append(
            TestFit(
                history.name,
                history.condition,
                test_ratios.size + linear,
                rms,
                bias,
                rate_factor,
                weight,
                outputs,
                ruptures[k],
            )
        )
    return tuple(test_fits)


def errors_of_output(history: History, name: str, predicted: Floats) -> OutputErrors:
    """Errors of one output of one test over its usable frames; predicted : (frames,) in the output's unit."""
    used = usable_frames(history, name)
    return output_errors(history.outputs[name][used], predicted[used], noise_standard_deviation(history, name)[used])


def _output_fit(history: History, name: str, predicted: Floats, offset: float) -> OutputFit:
    noise = noise_standard_deviation(history, name)[usable_frames(history, name)]
    return OutputFit(name, errors_of_output(history, name, predicted + offset), offset, float(np.median(noise)))


def _log_ratios(problem: LeastSquaresProblem, residuals: Residuals, offset: Floats) -> Floats:
    """ln((predicted + the test's offset) / measured) where the measured strain is above twice the floor, else NaN.

    For tests followed to rupture, the orthogonal residual instead.
    """
    observations = problem.observations
    floor = observations.per_observation(
        [
            s.floor if n in LOGARITHMIC_OUTPUTS else np.inf
            for n, s in zip(observations.outputs, observations.transforms, strict=True)
        ]
    )
    vertical = np.where(observations.followed_to_rupture[:, None], 0.0, residuals.values)
    predicted = observations.inverse(vertical + problem.observations.transformed_values) + offset
    above_floor = observations.present & (observations.values > 2 * floor)
    measured = np.where(above_floor, observations.values, 1.0)
    predicted_strain = np.where(above_floor, np.maximum(predicted, floor), 1.0)
    log_ratio = np.where(
        observations.followed_to_rupture[:, None],
        residuals.values + residuals.offset_sensitivity * offset,
        np.log(predicted_strain / measured),
    )
    return np.where(above_floor, log_ratio, np.nan)


def pooled_log_strain_rms(tests: Sequence[TestFit]) -> float:
    """Root mean square of ln strain over the fitted strains of all tests; NaN without any."""
    with_strain = [m for m in tests if np.isfinite(m.log_strain_rms)]
    frames = np.array([m.frames for m in with_strain], float)
    if not frames.sum() > 0:
        return float("nan")
    return float(np.sqrt((frames * np.array([m.log_strain_rms**2 for m in with_strain])).sum() / frames.sum()))


def pooled_errors(
    histories: Sequence[History], prediction: Prediction, tests: Sequence[TestFit]
) -> Mapping[str, OutputErrors]:
    """{output: errors over all used frames of all tests}, offsets included."""
    names = dict.fromkeys(output_fit.output for m in tests for output_fit in m.outputs)
    errors_by_output = {}
    for name in names:
        measured, predicted, noise = [], [], []
        for k, (history, test) in enumerate(zip(histories, tests, strict=True)):
            for one in (o for o in test.outputs if o.output == name):
                used = usable_frames(history, name)
                measured.append(history.outputs[name][used])
                predicted.append(prediction.of(k)[used, prediction.outputs.index(name)] + one.offset)
                noise.append(noise_standard_deviation(history, name)[used])
        errors_by_output[name] = output_errors(*(np.concatenate(v) for v in (measured, predicted, noise)))
    return errors_by_output


EXTRAPOLATION_FACTOR = 1000.0
"""How far beyond the longest measured test, or its own last time, a test is followed to its rupture; the predictor's
own horizon comes on top."""


def predict_rupture_times(
    coordinates: Coordinates,
    u: Floats,
    scatter: RateScatter,
    noise_model: NoiseModel | None,
    histories: Sequence[History],
    predictor: Predictor,
) -> tuple[Floats, Floats, Floats]:
    """Rupture times of histories, s, with 95 % intervals: (time, low, high), (tests,) each; infinite where none comes.

    By the delta method on ln t, over the posterior distribution of the scatter between tests; with `noise_model` the
    scatter of single tests is added.

    u : (parameters,) conditioned coordinates.
    """
    for history in histories:
        if not predicts_rupture(predictor, history):
            name = getattr(predictor_for(predictor, history), "name", "predictor")
            raise FitError(
                f"history '{history.name}': {name} follows no test to rupture; give using=, such as uniaxial"
            )
    extended = [_extended_to_rupture(history) for history in histories]
    theta = coordinates.theta(u)[None]
    prediction = predict_to_rupture(predictor, coordinates.law, theta, extended, sensitivities=True)
    assert prediction.times_to_strain is not None
    assert prediction.times_to_strain.rupture_jacobian is not None
    at_values = prediction.times_to_strain.rupture_times[0]
    by_parameter = np.nan_to_num(prediction.times_to_strain.rupture_jacobian[0])
    locations, variances = [], []
    for k, history in enumerate(histories):
        test = scatter.new_test(history)
        row = np.zeros(scatter.joint_design.shape[1])
        row[: u.size] = by_parameter[k] @ coordinates.jacobian(u)
        rate_effect = _log_time_by_log_rate(coordinates, by_parameter[k])
        row[[*test.known.values()]] = rate_effect if noise_model is not None else 0.0
        parts = [scatter.joint(sd) for sd in scatter.posterior.sd]
        own = scatter.own_variance(test, scatter.posterior.sd) * rate_effect**2 + _rupture_variance(noise_model)
        locations.append([row @ mean for mean, _ in parts])
        by_law = np.array([row @ covariance @ row for _, covariance in parts])
        variances.append(by_law + own if noise_model is not None else by_law)
    posterior, variance = scatter.posterior, np.array(variances).T
    ruptured = np.isfinite(at_values)
    log_times = np.log(np.where(ruptured, at_values, 1.0))
    mixture = MixtureDistribution(
        posterior.weight,
        np.full(posterior.weight.size, NORMAL_FREEDOM),
        log_times + np.array(locations).T,
        np.sqrt(np.maximum(variance, 1e-20)),
    )
    low, high = (np.exp(mixture.quantile(probability)) for probability in (0.025, 0.975))
    return tuple(np.where(ruptured, each, np.inf) for each in (at_values, low, high))  # type: ignore[return-value]


def _log_time_by_log_rate(coordinates: Coordinates, by_parameter: Floats) -> float:
    """Derivative of ln of a rupture time to ln of a factor on all rates: -1 where the law has no explicit time.

    by_parameter : (parameters,) derivatives of ln of the time.
    """
    coefficients = list(coordinates.coefficients)
    if len(coefficients) < len(coordinates.law.terms) + len(coordinates.law.states):
        return -1.0
    return float(by_parameter[coefficients].sum())


def _rupture_variance(noise_model: NoiseModel | None) -> float:
    """Variance of ln of the rupture time of a single test beside its rate."""
    known = noise_model is not None and RUPTURE_OUTPUT in noise_model.outputs
    return float(noise_model[RUPTURE_OUTPUT].misfit ** 2) if known else 0.0  # type: ignore[index]


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
    if control not in ("load", "stress"):
        raise FitError(f"control is '{control}'; allowed are load and stress")
    if not (stresses > 0).all():
        raise FitError("a rupture time was asked for at a stress that is not above zero; give tensile stresses, in MPa")
    tests = [
        History(f"{s:g} MPa, {T:g} K", np.array([duration]), {}, constant_stress(float(s), control), float(T))  # type: ignore[arg-type]
        for s, T in zip(stresses.ravel(), temperatures.ravel(), strict=True)
    ]
    return tests, stresses.shape


def compare_rupture_times(
    coordinates: Coordinates,
    u: Floats,
    scatter: RateScatter,
    noise_model: NoiseModel,
    histories: Sequence[History],
    predictor: Predictor,
) -> list[RuptureComparison | None]:
    """Measured against predicted, for every history; None where its end is not known or not predicted.

    u : (parameters,) conditioned coordinates.
    """
    followed = [k for k, h in enumerate(histories) if h.end_known and predicts_rupture(predictor, h)]
    comparisons: list[RuptureComparison | None] = [None] * len(histories)
    if not followed:
        return comparisons
    tests = [histories[k] for k in followed]
    times = predict_rupture_times(coordinates, u, scatter, noise_model, tests, predictor)
    for k, history, time, low, high in zip(followed, tests, *times, strict=True):
        measured = history.rupture_time or float(history.times[-1])
        comparisons[k] = RuptureComparison(measured, history.unruptured, float(time), float(low), float(high))
    return comparisons
