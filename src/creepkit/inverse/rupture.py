"""When will it break: predicted rupture times with intervals, and how they compare with those that were measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.findings import RuptureComparison
from creepkit.inverse.life import predict_to_rupture
from creepkit.inverse.scales import RUPTURE_OUTPUT
from creepkit.inverse.scatter import NoiseModel
from creepkit.inverse.together import predicts_rupture, predictor_for
from creepkit.records import History, Predictor, constant_stress

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

EXTRAPOLATION_FACTOR = 1000.0
"""How far beyond the longest measured test, or its own last time, a test is followed to its rupture; the predictor's
own horizon comes on top."""


def predict_rupture_times(
    coordinates: Coordinates, u: Floats, covariance: Floats, noise_model: NoiseModel | None, quantile: float,
    histories: Sequence[History], predictor: Predictor,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Rupture times of histories, s, with intervals: (time, low, high), (tests,) each; infinite where none comes.

    By the delta method on ln t, from the covariance of u; with `scatter` that of a single test's life comes on top.
    """
    for history in histories:
        if not predicts_rupture(predictor, history):
            name = getattr(predictor_for(predictor, history), "name", "predictor")
            raise FitError(
                f"history '{history.name}': {name} follows no test to rupture; give using=, such as uniaxial"
            )
    extended = [_extended_to_rupture(history) for history in histories]
    prediction = predict_to_rupture(predictor, coordinates.law, coordinates.values(u), extended, jacobian=True)
    assert prediction.times_to_strain is not None
    assert prediction.times_to_strain.rupture_jacobian is not None
    median_times = prediction.times_to_strain.rupture_times[0]
    sensitivities = np.nan_to_num(prediction.times_to_strain.rupture_jacobian[0]) @ coordinates.jacobian(u)
    variance = np.einsum("ti,ij,tj->t", sensitivities, covariance, sensitivities)
    if noise_model is not None:
        rupture_sd = noise_model[RUPTURE_OUTPUT].misfit if RUPTURE_OUTPUT in noise_model.outputs else 0.0
        variance = variance + noise_model.rate**2 + rupture_sd**2
    interval_factor = np.exp(quantile * np.sqrt(variance))
    ruptured = np.isfinite(median_times)
    return tuple(np.where(ruptured, each, np.inf) for each in (median_times, median_times / interval_factor, median_times * interval_factor))  # type: ignore[return-value]


def _extended_to_rupture(history: History) -> History:
    """What is asked of a test is when it breaks, however long after its last frame that may be."""
    last_time = max(float(history.times[-1]), history.rupture_time or 0.0)
    return history.replace(times=np.array([EXTRAPOLATION_FACTOR * last_time]), outputs={}, standard_deviation={})


def constant_stress_tests(
    stress: ArrayLike, temperature: ArrayLike, duration: float, control: str
) -> tuple[list[History], tuple[int, ...]]:
    """Uniaxial tests at constant load or stress for every pair of stress (MPa) and temperature (K), and their shape."""
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
    coordinates: Coordinates, u: Floats, covariance: Floats, noise_model: NoiseModel, quantile: float,
    histories: Sequence[History], predictor: Predictor,
) -> list[RuptureComparison | None]:  # fmt: skip
    """Measured against predicted, for every history; None where its end is not known or not predicted."""
    followed = [k for k, h in enumerate(histories) if h.end_known and predicts_rupture(predictor, h)]
    comparisons: list[RuptureComparison | None] = [None] * len(histories)
    if not followed:
        return comparisons
    tests = [histories[k] for k in followed]
    times = predict_rupture_times(coordinates, u, covariance, noise_model, quantile, tests, predictor)
    for k, history, time, low, high in zip(followed, tests, *times, strict=True):
        measured = history.rupture_time or float(history.times[-1])
        comparisons[k] = RuptureComparison(measured, history.unruptured, float(time), float(low), float(high))
    return comparisons


def rupture_rows(fit: Identification) -> list[tuple[str, str, RuptureComparison]]:
    """(test, condition, rupture) of the tests whose end is known."""
    return [(m.name, m.condition, m.rupture) for m in fit.tests if m.rupture is not None]
