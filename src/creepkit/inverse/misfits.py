"""How well each test is met at the optimum: ln strain of fitted frames, errors of every output over all frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.findings import OutputFit, RuptureComparison, TestFit
from creepkit.inverse.measures import OutputErrors, output_errors
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scales import LOGARITHMIC_OUTPUTS, noise_standard_deviation, usable_frames
from creepkit.inverse.together import compared_outputs
from creepkit.records import History, Prediction


def goodness_of_tests(
    residual_function: ResidualFunction, residuals: Residuals, random_effects: tuple[Floats, Floats], histories: Sequence[History],
    prediction: Prediction, ruptures: Sequence[RuptureComparison | None],
) -> tuple[TestFit, ...]:  # fmt: skip
    """One TestMisfit for each test.

    nuisances : offsets (tests, outputs) and ln rate factors (tests,); found : the prediction of the `full` histories;
    ruptures : how each of them ended.
    """
    offsets, log_factors = random_effects
    observations = residual_function.observations
    ratios = _log_ratios(residual_function, residuals, np.take_along_axis(offsets, observations.output_index, axis=1))
    logarithmic = observations.per_observation([float(name in LOGARITHMIC_OUTPUTS) for name in observations.outputs]) > 0
    test_fits = []
    for k, history in enumerate(histories):
        test_ratios = ratios[k][np.isfinite(ratios[k])]
        rms, bias = (float(np.sqrt(np.mean(test_ratios**2))), float(np.mean(test_ratios))) if test_ratios.size else (np.nan, np.nan)
        linear = int((observations.present[k] & ~logarithmic[k]).sum())
        offset_by_output = {name: float(v) for name, v in zip(observations.outputs, offsets[k], strict=True)}
        outputs = tuple(
            _output_fit(history, name, prediction.of(k)[:, prediction.outputs.index(name)], offset_by_output[name])
            for name in compared_outputs(residual_function.predictor, history) if name in offset_by_output and usable_frames(history, name).any()
        )  # fmt: skip
        rate_factor, weight = float(np.exp(log_factors[k])), float(residuals.test_weights[k])
        test_fits.append(
            TestFit(
                history.name, history.condition, test_ratios.size + linear, rms, bias, rate_factor, weight, outputs, ruptures[k]
            )
        )
    return tuple(test_fits)


def _output_fit(history: History, name: str, predicted: Floats, offset: float) -> OutputFit:
    frames, noise = usable_frames(history, name), noise_standard_deviation(history, name)
    errors_of_output = output_errors(history.outputs[name][frames], predicted[frames] + offset, noise[frames])
    return OutputFit(name, errors_of_output, offset, float(np.median(noise[frames])))


def _log_ratios(residual_function: ResidualFunction, residuals: Residuals, offset: Floats) -> Floats:
    """ln((predicted + the test's offset) / measured) where the measured strain is above twice the floor, else NaN.

    For tests compared over their whole life, the distance instead.
    """
    observations = residual_function.observations
    floor = observations.per_observation([s.floor if n in LOGARITHMIC_OUTPUTS else np.inf for n, s in zip(observations.outputs, observations.transforms,
                                                                                  strict=True)])  # fmt: skip
    vertical = np.where(observations.followed_to_rupture[:, None], 0.0, residuals.values)
    predicted = observations.inverse(vertical + residual_function.observed) + offset
    above_floor = observations.present & (observations.values > 2 * floor)
    measured = np.where(above_floor, observations.values, 1.0)
    predicted_strain = np.where(above_floor, np.maximum(predicted, floor), 1.0)
    log_ratio = np.where(observations.followed_to_rupture[:, None], residuals.values + residuals.transform_derivatives * offset, np.log(predicted_strain / measured))
    return np.where(above_floor, log_ratio, np.nan)


def pooled_log_strain_rms(tests: Sequence[TestFit]) -> float:
    """Root mean square of ln strain over the fitted strains of all tests; NaN without any."""
    with_strain = [m for m in tests if np.isfinite(m.log_strain_rms)]
    frames = np.array([m.frames for m in with_strain], float)
    if not frames.sum() > 0:
        return float("nan")
    return float(np.sqrt((frames * np.array([m.log_strain_rms**2 for m in with_strain])).sum() / frames.sum()))


def pooled_errors(histories: Sequence[History], prediction: Prediction, tests: Sequence[TestFit]) -> Mapping[str, OutputErrors]:
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
