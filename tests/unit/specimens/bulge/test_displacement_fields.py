"""Fields of points, as cameras give them, to D_amp, S_d, S_p and the place of the bulge."""

import numpy as np
import pytest

from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.specimens.bulge.field_fit import fit_field
from creepkit.specimens.bulge.observation import Observation
from helpers.bulge_profiles import cross, profile_with_apex
from helpers.paths import needs_shared_data


def pixels(points=50):
    side = np.linspace(-8.0, 8.0, points)
    return np.meshgrid(side, side)


@pytest.mark.parametrize("D", [0.35, -0.35])
def test_planted_field_is_recovered(D):
    x, y = pixels()
    fit = fit_field(x, y, cross(x - 0.7, y + 0.4, D, 3.6, 2.3))
    got = [fit.amplitude, fit.width, fit.shape, fit.x_center, fit.y_center]
    np.testing.assert_allclose(got, [D, 3.6, 2.3, 0.7, -0.4], rtol=1e-10)
    assert max(fit.standard_errors) < 1e-10
    assert fit.points == 2500


@pytest.mark.nightly
def test_standard_errors_of_a_field_are_its_scatter():
    x, y = pixels(30)
    truth, noise = np.array([0.35, 3.6, 2.3, 0.7, -0.4]), np.random.default_rng(8).normal(size=(150, 30, 30))
    surface = cross(x - 0.7, y + 0.4, *truth[:3])
    fits = [fit_field(x, y, surface + 0.02 * some) for some in noise]
    values = np.array([[f.amplitude, f.width, f.shape, f.x_center, f.y_center] for f in fits])
    scores = (values - truth) / [f.standard_errors for f in fits]
    np.testing.assert_allclose(scores.std(axis=0), 1.0, atol=0.2)  # 150 draws know a deviation to 6 %
    np.testing.assert_allclose([f.residual_sd for f in fits], 0.02, rtol=0.15)


def test_lost_and_wild_points():
    x, y = pixels()
    surface = cross(x - 0.7, y + 0.4, 0.35, 3.6, 2.3)
    surface[3, 4], surface[9:12, 9] = 2.0, np.nan
    fit = fit_field(x, y, surface)
    assert fit.points == 2497
    np.testing.assert_allclose([fit.amplitude, fit.width, fit.shape], [0.35, 3.6, 2.3], rtol=0.005)


@needs_shared_data
def test_field_and_operator_see_the_same():
    nodes, profile = profile_with_apex(0.81)
    x, y = pixels(160)
    inside = np.hypot(x, y) <= 5.0
    heights = surface_interpolation(nodes, np.hypot(x, y)[inside]) @ profile[0]
    fit = fit_field(x[inside] + 1.3, y[inside] - 2.0, heights)
    expected = Observation("field", 5.0).observe(nodes, profile)[0]
    np.testing.assert_allclose([fit.amplitude, fit.width, fit.shape], expected, rtol=2e-4)  # pixels end raggedly
    np.testing.assert_allclose([fit.x_center, fit.y_center], [1.3, -2.0], atol=1e-6)
