"""Points of cameras and profiles of simulations give the same outputs."""

import numpy as np
import pytest

from creepkit.errors import FitError
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.records import SurfacePoints
from creepkit.specimens.bulge.camera_points import observe_surface, surface_center
from creepkit.specimens.bulge.field_fit import fit_field, paper_parameters
from creepkit.specimens.bulge.observation import Observation
from helpers.bulge_profiles import NODES, plates
from helpers.paths import needs_shared_data
from helpers.static_test import static_test

PROFILES = plates(NODES)


def grid(spacing, subset=0.0, center=(0.0, 0.0), turn=0.3):
    """A turned grid of points, and the means of the plates over subsets there, by 7 by 7 Gauss points."""
    side = np.arange(-9.0, 9.01, spacing)
    x, y = (g.ravel() for g in np.meshgrid(side, side))
    places = np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)], axis=1)
    roots, weights = np.polynomial.legendre.leggauss(7)
    heights = 0.0
    for px, wx in zip(roots, weights / 2, strict=True):
        for py, wy in zip(roots, weights / 2, strict=True):
            r = np.hypot(*(places - center + 0.5 * subset * np.array([px, py])).T)
            heights = heights + wx * wy * (surface_interpolation(NODES, np.minimum(r, 10.0)) @ PROFILES.T)
    return SurfacePoints(places, np.full(len(places), spacing**2), heights.T, subset)


@pytest.mark.parametrize(("spacing", "subset"), [(0.5, 0.0), (0.5, 1.2), (0.25, 2.0)])
def test_the_fit_to_points_is_that_to_profiles(spacing, subset):
    seen = observe_surface(grid(spacing, subset), "field 0-7.5 mm")
    truth = Observation("field").observe(NODES, PROFILES)
    got = np.stack(list(seen.outputs.values()), axis=1)
    np.testing.assert_allclose(got[:, 0], truth[:, 0], rtol=1e-3)  # smoothed by 2 mm, D lies 3 % lower
    np.testing.assert_allclose(got[:, 1:], truth[:, 1:], rtol=3e-3)


def test_gains_are_the_derivatives_of_the_outputs():
    """In a series of 48 frames; weights follow from what 25 neighbours miss of Eq. (7), and change with their noise."""
    points = grid(0.5)
    heights = np.repeat(points.heights, 8, axis=0)
    seen = observe_surface(SurfacePoints(points.places, points.areas, heights), "field 0-6 mm")
    change = 1e-6 * np.random.default_rng(0).normal(size=heights.shape)
    changed = observe_surface(SurfacePoints(points.places, points.areas, heights + change), "field 0-6 mm")
    for k, name in enumerate(seen.outputs):
        expected = np.einsum("fn,fn->f", seen.gains[:, k], change)
        missed = changed.outputs[name] - seen.outputs[name] - expected
        assert np.sqrt((missed**2).mean() / (expected**2).mean()) < 0.5  # 12 % of the standard deviation


def test_one_centre_serves_all_frames():
    center, covariance = surface_center(grid(0.5, center=(0.6, -0.4)), 7.5)
    np.testing.assert_allclose(center, [0.6, -0.4], atol=3e-3)
    assert np.sqrt(np.diag(covariance)).max() < 0.01


def test_lost_points_are_not_filled():
    points = grid(0.4)
    heights = np.array(points.heights)
    heights[:, np.hypot(*(points.places - [2.0, 1.0]).T) < 1.5] = np.nan
    seen = observe_surface(SurfacePoints(points.places, points.areas, heights), "field 0-7.5 mm")
    assert (seen.gains[:, :, np.isnan(heights[0])] == 0.0).all()
    truth = Observation("field").observe(NODES, PROFILES)[:, 0]
    np.testing.assert_allclose(seen.outputs["amplitude"], truth, rtol=0.01)


@pytest.mark.parametrize("subset", [0.0, 1.2])
def test_rings_from_points(subset):
    radii = [0.0, 0.8, 2.0, 4.0, 6.0]
    seen = observe_surface(grid(0.5, subset), "rings 0, 0.8, 2, 4, 6 mm")
    truth = PROFILES @ surface_interpolation(NODES, radii).T
    got = np.stack(list(seen.outputs.values()), axis=1)
    assert np.abs(got - truth).max() < 2e-3 * truth.max()


def test_eight_parameters_as_those_of_the_paper():
    side = np.linspace(-8.0, 8.0, 81)
    x, y = np.meshgrid(side, side)
    p = 2.2
    fit = fit_field(x, y, 0.4 * np.exp(-0.5 * (np.abs(x / 2.7) ** p + np.abs(y / 2.7) ** p)))
    np.testing.assert_allclose(paper_parameters(0.4, 2.7, 2.7, p), [fit.amplitude, fit.width, fit.shape], rtol=1e-9)
    c = np.sqrt(0.5)
    along, across = c * (x + y), c * (y - x)
    turned = fit_field(x, y, 0.4 * np.exp(-0.5 * (np.abs(along / 2.7) ** 2 + np.abs(across / 2.7) ** 2)))
    np.testing.assert_allclose(
        paper_parameters(0.4, 2.7, 2.7, 2.0, 0.25 * np.pi), [turned.amplitude, turned.width, 2.0]
    )
    assert paper_parameters(0.4, 2.5, 2.8, 2.2, offset=-0.02).amplitude == pytest.approx(0.38)
    with pytest.raises(FitError, match=r"no bulge has sigma_x = -1\.0"):
        paper_parameters(0.4, -1.0, 2.7, 2.2)


@needs_shared_data
def test_the_static_test_of_the_group():
    """The mean on a ring of 0 mm is the raw apex within its noise; the published eight-parameter fit is not."""
    test = static_test()
    noise = test.apex[1:80].std()
    assert noise == pytest.approx(1.04e-3, abs=0.03e-3)
    places = np.stack([test.places, np.zeros_like(test.places)], axis=1)
    seen = observe_surface(SurfacePoints(places, np.full(len(places), 0.15**2), test.heights), "rings 0 mm")
    raw = test.heights.max(axis=1)
    missed = seen.outputs["displacement_1"] - raw
    published = test.published[:, 0] + test.published[:, 7] - raw
    assert np.sqrt((missed**2).mean()) < noise
    high = raw > 0.4
    share = 1.0 + published[high] / raw[high]
    assert (share < 0.99).all()
    assert (share > 0.98).all()
    assert (published[raw > 0.2] < -5 * noise).all()
