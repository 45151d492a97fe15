"""Rigid motion and noise against planted ones."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from creepkit.extraction.frame_checks import frames_at_rest
from creepkit.extraction.noise import autocorrelation, patch_covariance, patch_numbers, rigid_gains, time_correlation
from creepkit.extraction.plate import plate_axes, point_areas, rigid_motions


def flat_points(seed=0, count=400):
    xy = np.random.default_rng(seed).uniform(-15, 15, (count, 2))
    return np.c_[xy, np.zeros(count)]


@pytest.mark.parametrize("degrees", [1e-7, 0.2, 25.0])
def test_a_planted_rigid_motion_is_found_beside_wild_points(degrees):
    places = flat_points()
    vector = np.radians(degrees) * np.array([0.6, -0.64, 0.48])
    shift = np.array([0.3, -0.2, 0.1])
    moved = (places @ Rotation.from_rotvec(vector).as_matrix().T + shift - places)[None]
    valid = np.ones(moved.shape[:2], bool)
    moved[0, :80] += np.random.default_rng(1).uniform(-3, 3, (80, 3))  # a fifth of them
    valid[0, 80:90] = False
    moved[0, 80:90] = np.nan
    motion = rigid_motions(places, np.nan_to_num(moved), valid)
    np.testing.assert_allclose(motion.rotation_vectors()[0], vector, rtol=1e-6, atol=1e-13)
    np.testing.assert_allclose(motion.translations()[0], shift, atol=1e-9)
    np.testing.assert_allclose(motion.taken_off(places, np.nan_to_num(moved))[0, 90:], 0.0, atol=1e-9)


def test_axes_of_a_tilted_plate_leave_a_fixture_out():
    places = flat_points(2)
    places[:60, 2] = 5.0
    turn = Rotation.from_rotvec([0.2, -0.1, 0.3]).as_matrix()
    axes = plate_axes(places @ turn.T + [3.0, 4.0, 500.0])
    np.testing.assert_allclose(axes.axes[2], turn[:, 2], atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(axes.axes), 1.0)
    here = axes.camera_places(np.array([[1.5, -2.0]]))[0]
    np.testing.assert_allclose(axes.place_of(*here[:2]), [1.5, -2.0], atol=1e-9)


def test_areas_of_points_fill_the_plate():
    side = np.arange(-10.0, 10.01, 0.5)
    x, y = (g.ravel() for g in np.meshgrid(side, side))
    areas = point_areas(np.stack([x + 0.2 * np.sin(y), y], axis=1), 0.5)
    np.testing.assert_allclose(areas[np.hypot(x, y) < 8.0], 0.25, rtol=0.02)


def test_patches_give_the_scatter_of_a_fit_to_correlated_errors():
    """The linear fit of a plane and a bell to noise that neighbours share; patches see its residuals alone."""
    random = np.random.default_rng(5)
    side = np.arange(-7.5, 7.51, 0.5)
    places = np.stack([g.ravel() for g in np.meshgrid(side, side)], axis=1)
    white = random.normal(size=(600, side.size, side.size))
    errors = gaussian_filter(white, (0, 1.0, 1.0)).reshape(600, -1)
    columns = np.c_[np.exp(-(places**2).sum(axis=1) / 14.0), np.ones(len(places)), places]
    gains = np.linalg.pinv(columns)
    truth = (errors @ gains.T).std(axis=0)
    residuals = errors - errors @ gains.T @ columns.T
    rho = autocorrelation(residuals, places, 0.5)
    numbers = patch_numbers(places, 3.0)
    stated = np.sqrt(np.diag(patch_covariance(gains[None], residuals, numbers)[0]))
    assert stated[0] < 0.8 * truth[0]  # what the fit took
    np.testing.assert_allclose(
        stated / np.sqrt(rho.kept_by_residuals(gains, places, numbers, columns, gains).within), truth, rtol=0.12
    )


def test_gains_of_the_clamped_plate_are_shift_and_small_rotations():
    places = flat_points(3)[:, :2]
    heights = 0.1 + 2e-3 * places[:, 1] - (-3e-3) * places[:, 0]
    np.testing.assert_allclose(rigid_gains(places) @ heights, [0.1, 2e-3, -3e-3], atol=1e-12)


def test_correlation_in_time_of_a_moving_average():
    white = np.random.default_rng(0).normal(size=20_000)
    lag_one, integral = time_correlation(white[1:] + white[:-1])
    assert lag_one == pytest.approx(0.5, abs=0.03)
    assert integral == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("loaded_from", "expected"), [(20, range(1, 20)), (1, [0])])
def test_frames_at_rest(loaded_from, expected):
    random = np.random.default_rng(1)
    signal = 1e-3 * random.normal(size=80)
    signal[0] = 0.0
    signal[loaded_from:] += 0.03 + 0.002 * np.arange(80 - loaded_from)
    rest = frames_at_rest(signal, np.ones(80, bool), True, None)
    assert set(rest) <= set(expected)
    assert len(rest) >= 0.8 * len(expected)
    load = np.where(np.arange(80) < loaded_from, 0.0, 8.0)
    assert frames_at_rest(signal, np.ones(80, bool), True, load).tolist() == list(expected)
