"""Scatter of rupture lives: the closed form of its effect on a residual, against a curve that is moved in life."""

from types import SimpleNamespace

import numpy as np
import pytest

from creepkit.inverse.residuals import life_sensitivity, orthogonal_distance


@pytest.mark.parametrize("share", [0.05, 0.5, 0.8, 0.95, 0.99])
def test_a_longer_life_moves_the_residual_of_a_frame_as_stated(share):
    """Kachanov and Rabotnov's curve e = tr l [1 - (1 - t / tr)^(1/l)], its life longer by 1e-5 at the same rate."""
    growth, step = 5.0, 1e-5

    def strain(t, life):
        return life * growth * (1.0 - (1.0 - t / life) ** (1.0 / growth))

    def log_time(e, life):
        return np.log(life * (1.0 - (1.0 - e / (life * growth)) ** growth))

    e = strain(share, 1.0)
    slope = share * (1.0 - share) ** (1.0 / growth - 1.0) / e

    def moved(strain_error, time_error):
        found = orthogonal_distance(np.array(strain_error), np.array(time_error), np.array(slope))
        return float(found.values) / step

    by_life = -moved(np.log(strain(share, np.exp(step)) / e), np.log(share) - log_time(e, np.exp(step)))
    by_rate = moved(slope * step, step)
    residuals = SimpleNamespace(present=np.ones((1, 1), bool), log_rate_sensitivity=np.full((1, 1), by_rate))
    observations = SimpleNamespace(followed_frames=np.ones((1, 1), bool))
    assert life_sensitivity(residuals, observations)[0, 0] == pytest.approx(abs(by_life), rel=2e-3, abs=1e-3)
    observations.followed_frames = np.zeros((1, 1), bool)
    assert life_sensitivity(residuals, observations)[0, 0] == 0.0
