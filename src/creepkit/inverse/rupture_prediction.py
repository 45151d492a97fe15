"""Rupture times of tests with intervals, predicted and beside what was measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import predict_to_rupture, predictor_for, predicts_rupture
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.goodness_of_fit import RuptureComparison
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT
from creepkit.inverse.uncertainty.log_values import LogValues, misfit_variance
from creepkit.inverse.uncertainty.rate_scatter import RateScatter
from creepkit.records import History, Predictor, constant_stress

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
    rate_effects = np.array([_log_time_by_log_rate(coordinates, row) for row in by_parameter])
    ruptured = np.isfinite(at_values)
    log_times = LogValues(np.log(np.where(ruptured, at_values, 1.0)), by_parameter, rate_effects)
    low, high = log_times.intervals(
        coordinates,
        u,
        scatter,
        histories,
        None if noise_model is None else misfit_variance(noise_model, RUPTURE_OUTPUT),
    )
    times = (at_values, np.exp(low), np.exp(high))
    return tuple(np.where(ruptured, each, np.inf) for each in times)  # type: ignore[return-value]


def _log_time_by_log_rate(coordinates: Coordinates, by_parameter: Floats) -> float:
    """Derivative of ln of a rupture time to ln of a factor on all rates: -1 where the law has no explicit time.

    by_parameter : (parameters,) derivatives of ln of the time.
    """
    coefficients = list(coordinates.coefficients)
    if len(coefficients) < len(coordinates.law.terms) + len(coordinates.law.states):
        return -1.0
    return float(by_parameter[coefficients].sum())


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
    *,
    without_curves: bool = True,
) -> list[RuptureComparison | None]:
    """Measured against predicted, for every history; None where its end is not known or not predicted.

    u : (parameters,) conditioned coordinates. without_curves : whether ends of tests without frames were compared.
    """
    followed = [k for k, h in enumerate(histories) if h.end_known and predicts_rupture(predictor, h)]
    comparisons: list[RuptureComparison | None] = [None] * len(histories)
    if not followed:
        return comparisons
    tests = [histories[k] for k in followed]
    times = predict_rupture_times(coordinates, u, scatter, noise_model, tests, predictor)
    for k, history, time, low, high in zip(followed, tests, *times, strict=True):
        measured = history.rupture_time or float(history.times[-1])
        comparisons[k] = RuptureComparison(
            measured, history.unruptured, float(time), float(low), float(high), without_curves or bool(history.outputs)
        )
    return comparisons
