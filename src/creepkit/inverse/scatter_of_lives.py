"""Scatter of rupture lives: what it does to the frames of tests that were followed to rupture.

Specimens of one alloy that creep alike still break at different times, and the last part of their curves moves with the
life. Along a curve whose creep ends in a damage that grows at a rate of its own, such as

    e = A t_r lambda [1 - (1 - t / t_r)^(1 / lambda)]

a life longer by a factor exp(b) moves the time at which a strain is reached by (1 - 1/s) b in ln t, with
s = d ln e / d ln t: not at all in steady creep, where s = 1, and by all of b at rupture, where s is infinite. A rate
that scatters moves the whole curve by one amount in ln t, and the orthogonal residual of the frame by
L = sqrt(2) s / sqrt(1 + s^2); with that, a life moves it by L - sqrt(2 - L^2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.noise_model import NoiseModel, Residuals
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.variance_components import LinearisedProblem


def life_sensitivity(residuals: Residuals, observations: ObservationVector) -> Floats:
    """(tests, observations) -, derivative of the residuals of frames to ln of the rupture life; 0 of other tests."""
    frames = observations.followed_to_rupture[:, None] & residuals.present & ~observations.single_value_mask
    shift = np.clip(residuals.log_rate_sensitivity, 0.0, np.sqrt(2.0))
    return np.where(frames, np.maximum(shift - np.sqrt(np.maximum(2.0 - shift**2, 0.0)), 0.0), 0.0)


def with_scatter_of_lives(
    linear: LinearisedProblem, observations: ObservationVector, noise_model: NoiseModel
) -> LinearisedProblem:
    """The linear problem with the scatter of lives, as estimated of rupture times, as a random effect of each test."""
    scatter = noise_model[RUPTURE_OUTPUT].misfit if RUPTURE_OUTPUT in noise_model.outputs else 0.0
    effect = scatter * life_sensitivity(linear.residuals, observations)
    if not effect.any():
        return linear
    known = linear.residuals.random_effect_sensitivities
    columns = [*([] if known is None else [known]), effect[..., None]]
    residuals = replace(linear.residuals, random_effect_sensitivities=np.concatenate(columns, axis=-1))
    return replace(linear, residuals=residuals)
