"""Goodness of fit: errors of every output, of every test and of all tests, and of predicted rupture times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError, quoted
from creepkit.inverse.composite_predictor import compared_outputs
from creepkit.inverse.noise_covariance import RandomEffects
from creepkit.inverse.noise_model import Residuals
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import noise_standard_deviation, usable_frames
from creepkit.inverse.single_values import SingleValue
from creepkit.records import History, Prediction


@checked
def relative_squared_error(
    measured: Sequence[ArrayLike], predicted: Sequence[ArrayLike], about: Literal["all", "test", "frame"] = "all"
) -> float:
    """Return sum (p - m)^2 / sum (m - mean)^2 over all frames of all tests.

    measured, predicted : (frames,) of each test, in one unit.
    """
    measured_arrays, predicted_arrays = ([np.asarray(v, float) for v in values] for values in (measured, predicted))
    shapes, predicted_shapes = ([v.shape for v in values] for values in (measured_arrays, predicted_arrays))
    if shapes != predicted_shapes or any(len(shape) != 1 for shape in shapes):
        raise FitError(
            "measured and predicted must have the values (frames,) of the same tests, found shapes "
            f"{quoted(shapes)} and {quoted(predicted_shapes)}"
        )
    squares = sum(float(((p - m) ** 2).sum()) for m, p in zip(measured_arrays, predicted_arrays, strict=True))
    total = total_sum_of_squares(measured_arrays, about)
    return squares / total if total > 0 else float("nan")


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
class TestFit:
    """One test in the fit.

    frames : how many values count (strains above twice the floor of their transform, all frames of other outputs).
    log_strain_rms, log_strain_bias : root mean square and mean of ln((predicted + offset) / measured) over its fitted
        strains, else NaN. For a test followed to rupture, of its orthogonal residual (see inverse.residuals).
    rate_factor, life_factor : estimated factors of this test's creep rate on the law's (heat-to-heat scatter), and of
        its rate of damage beside it, by which its life is shorter.
    rupture : its end, where that is known and predicted. minimum_rate : of a test without frames, where it is stated.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    name: str
    condition: str
    frames: int
    log_strain_rms: float
    log_strain_bias: float
    rate_factor: float = 1.0
    life_factor: float = 1.0
    outputs: tuple[OutputFit, ...] = ()
    rupture: SingleValue | None = None
    minimum_rate: SingleValue | None = None

    def __getitem__(self, output: str) -> OutputFit:
        for one in self.outputs:
            if one.output == output:
                return one
        known = ", ".join(o.output for o in self.outputs) or "no frames"
        raise FitError(f"test '{self.name}' has no output '{output}'; it has {known}")

    @property
    def misses_readings(self) -> bool:
        """Whether the misfit of an output is no number: not every reading of it was predicted."""
        return any(one.errors.frames > 0 and np.isnan(one.errors.mean_squared_error) for one in self.outputs)

    @property
    def offset(self) -> float:
        """Offset of its first output."""
        return self.outputs[0].offset if self.outputs else 0.0


def test_fits(
    problem: LeastSquaresProblem,
    residuals: Residuals,
    random_effects: RandomEffects,
    histories: Sequence[History],
    prediction: Prediction,
    single_values: Sequence[tuple[SingleValue | None, SingleValue | None]],
) -> tuple[TestFit, ...]:
    """One TestFit for each test.

    histories, prediction : with all frames; single_values : end and minimum rate of each of them.
    """
    offsets, log_factors = random_effects
    observations = problem.observations
    ratios = _log_ratios(problem, residuals, np.take_along_axis(offsets, observations.output_index, axis=1))
    logarithmic = observations.logarithmic_mask
    test_fits = []
    for k, history in enumerate(histories):
        test_ratios = ratios[k][np.isfinite(ratios[k])]
        rms = float(np.sqrt(np.mean(test_ratios**2))) if test_ratios.size else np.nan
        bias = float(np.mean(test_ratios)) if test_ratios.size else np.nan
        linear = int((observations.present[k] & ~logarithmic[k]).sum())
        offset_by_output = {name: float(v) for name, v in zip(observations.outputs, offsets[k], strict=True)}
        outputs = []
        for name in compared_outputs(problem.predictor, history):
            if name in offset_by_output and usable_frames(history, name).any():
                offset = offset_by_output[name]
                readings = compared_readings(history, name, prediction.output_of(k, name) + offset)
                outputs.append(OutputFit(name, output_errors(*readings), offset, float(np.median(readings[2]))))
        test_fits.append(
            TestFit(
                history.name,
                history.condition,
                test_ratios.size + linear,
                rms,
                bias,
                float(np.exp(log_factors[0, k])),
                float(np.exp(log_factors[1, k])),
                tuple(outputs),
                *single_values[k],
            )
        )
    return tuple(test_fits)


def compared_readings(history: History, name: str, predicted: Floats) -> tuple[Floats, Floats, Floats]:
    """Measured and predicted values of one output of one test and the noise of the former, (usable frames,) each.

    predicted : (frames,) in the output's unit.
    """
    used = usable_frames(history, name)
    return history.outputs[name][used], predicted[used], noise_standard_deviation(history, name)[used]


def _log_ratios(problem: LeastSquaresProblem, residuals: Residuals, offset: Floats) -> Floats:
    """ln((predicted + the test's offset) / measured) where the measured strain is above twice the floor, else NaN.

    For tests followed to rupture, the orthogonal residual instead.
    """
    observations = problem.observations
    floor = observations.strain_floor
    vertical = np.where(observations.followed_to_rupture[:, None], 0.0, residuals.values)
    predicted = observations.inverse(vertical + problem.observations.transformed_values) + offset
    size = observations.direction * observations.values
    above_floor = observations.present & (size > 2 * floor)
    measured = np.where(above_floor, size, 1.0)
    predicted_strain = np.where(above_floor, np.maximum(observations.direction * predicted, floor), 1.0)
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
    readings: dict[str, list[tuple[Floats, ...]]] = {}
    for k, (history, test) in enumerate(zip(histories, tests, strict=True)):
        for one in test.outputs:
            predicted = prediction.output_of(k, one.output) + one.offset
            readings.setdefault(one.output, []).append(compared_readings(history, one.output, predicted))
    return {
        name: output_errors(*(np.concatenate(parts) for parts in zip(*of_tests, strict=True)))
        for name, of_tests in readings.items()
    }
