"""Profiles to D_amp, S_d, S_p: planted bulges, other fits, exact derivatives."""

import mpmath
import numpy as np
import pytest
from scipy.optimize import curve_fit

from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.fem.time_interpolation import TimeInterpolation
from creepkit.specimens.bulge.field_fit import joint_center
from creepkit.specimens.bulge.observation import Observation
from helpers.bulge_profiles import FINE, LOOKED_AT, NODES, bell, cross, plates, profile_with_apex, richardson, table
from helpers.paths import needs_shared_data

FORMS = [Observation(), Observation("field"), Observation("profile", 5.3, 51), Observation("field", 4.7)]


# What is observed


@pytest.mark.parametrize(("D", "S", "p"), [(0.81, 3.85, 2.2), (0.07, 3.65, 1.98), (1.6, 5.0, 3.2), (-0.02, 2.0, 1.3)])
def test_planted_profile_is_recovered(D, S, p):
    # nodes at every radius that is looked at: no interpolation between
    nodes = np.linspace(0.0, 7.5, 151)
    np.testing.assert_allclose(Observation().observe(nodes, [bell(nodes, D, S, p)]), [[D, S, p]], rtol=1e-10)


@pytest.mark.parametrize(
    "shape",
    [
        lambda r: (1 - (r / 7.5) ** 2) ** 2,
        lambda r: np.maximum(1 - (r / 5) ** 2, 0),
        lambda r: np.maximum(1 - r / 6, 0) - 0.02,
        lambda r: 0.3 * (1 + np.cos(np.pi * r / 7.5)),
    ],
)
def test_profiles_that_are_no_gaussians_are_fitted_as_scipy_does(shape):
    nodes = np.linspace(0.0, 7.5, 151)
    tight = dict(ftol=1e-15, xtol=1e-15, gtol=1e-15)
    expected, _ = curve_fit(bell, LOOKED_AT, shape(LOOKED_AT), [shape(0.0), 3.5, 2.0], **tight)
    # curve_fit minimises with first derivatives and stops at the rounding of the sum, so some 1e-8 of the unknowns
    np.testing.assert_allclose(Observation().observe(nodes, [shape(nodes)])[0], expected, rtol=2e-8)


def test_the_answer_is_a_stationary_point_in_fifty_digits():
    nodes = np.linspace(0.0, 7.5, 151)
    D, S, p = (mpmath.mpf(float(v)) for v in Observation().observe(nodes, plates(nodes)[-1:])[0])
    data = [(mpmath.mpf(float(r)), mpmath.mpf(float(u))) for r, u in zip(LOOKED_AT, plates(LOOKED_AT)[-1], strict=True)]

    def squares(D, S, p):
        return mpmath.fsum((D * mpmath.exp(-((r / S) ** p)) - u) ** 2 for r, u in data)

    with mpmath.workdps(50):
        start = (D, S, p)
        gradient = lambda *v: [mpmath.diff(squares, v, n) for n in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]  # noqa: E731
        exact = mpmath.findroot(gradient, start)
    np.testing.assert_allclose([float(v) for v in start], [float(v) for v in exact], rtol=1e-12)


def test_field_sees_equation_7_as_a_dense_grid_of_pixels_does():
    profile = bell(FINE, 0.81, 3.9, 2.4)
    pixels = np.arange(-5.0, 5.0, 0.05) + 0.025
    x, y = np.meshgrid(pixels, pixels)
    inside = np.hypot(x, y) <= 5.0
    x, y = x[inside], y[inside]
    tight = dict(ftol=1e-15, xtol=1e-15, gtol=1e-15)
    expected, _ = curve_fit(
        lambda xy, *v: cross(*xy, *v), (x, y), bell(np.hypot(x, y), 0.81, 3.9, 2.4), [0.8, 3.5, 2.0], **tight
    )
    got = Observation("field", 5.0).observe(FINE, [profile])[0]
    np.testing.assert_allclose(got, expected, rtol=2e-5)  # the edge of a disc of pixels is ragged
    assert abs(got[2] - 2.4) > 0.05  # and it is not what Eq. (3) sees


# Frames: at rest, noisy, hopeless


def test_a_frame_at_rest_has_no_amplitude_and_the_shape_of_the_next():
    moving = plates(NODES, 3)
    frames = np.vstack([0 * moving[:1], 1e-12 * moving[:1], moving[:2], 0 * moving[:1], moving[2:], 0 * moving[:1]])
    for operator in FORMS[:2]:
        one, two, three = operator.observe(NODES, moving)
        seen, slopes = operator.observe_with_derivatives(NODES, frames)
        at_rest = [[0.0, *shape[1:]] for shape in (one, one, three, three)]
        np.testing.assert_allclose(seen[[0, 1, 4, 6]], at_rest, rtol=1e-12)
        np.testing.assert_allclose(seen[[2, 3, 5]], [one, two, three], rtol=1e-12)
        np.testing.assert_allclose(slopes[0, 0], slopes[2, 0], rtol=1e-12)
        # D is homogeneous of degree one: its derivative along the profile itself is D
        np.testing.assert_allclose(slopes[0, 0] @ moving[0], one[0], rtol=1e-10)
        assert not slopes[[0, 1, 4, 6], 1:].any()


HOPELESS = {
    "not a number": np.full(41, np.nan),
    "infinite": np.full(41, np.inf),
    "flat": np.ones(41),
    "rising outwards": NODES,
    "a wave": np.cos(NODES),
    "one wild node": np.eye(41)[5],
    "a step": np.where(NODES < 3, 1.0, 0.0) * 1e-3,
    "noise": np.random.default_rng(3).normal(size=41),
}


@pytest.mark.parametrize("name", HOPELESS)
def test_a_frame_without_a_fit_is_nan_and_leaves_its_neighbours_alone(name):
    good = plates(NODES, 3)
    seen, slopes = Observation().observe_with_derivatives(NODES, np.vstack([good[:2], HOPELESS[name], good[2:]]))
    assert np.isnan(seen[2]).all()
    assert np.isnan(slopes[2]).all()
    alone, alone_slopes = Observation().observe_with_derivatives(NODES, good)
    np.testing.assert_allclose(seen[[0, 1, 3]], alone, rtol=1e-12)
    np.testing.assert_allclose(slopes[[0, 1, 3]], alone_slopes, rtol=1e-8, atol=1e-11)


@pytest.mark.parametrize("operator", FORMS, ids=str)
def test_noise_is_averaged_and_no_frame_leans_on_the_one_before(operator):
    noise = np.random.default_rng(5).normal(size=(200, 41))
    frames = bell(NODES, 0.1, 3.8, 2.2) + 0.003 * noise  # negative far out, in a good part of the nodes
    together = operator.observe(NODES, frames)
    alone = np.vstack([operator.observe(NODES, frame[None]) for frame in frames])
    np.testing.assert_allclose(together, alone, rtol=1e-10)
    clean, slopes = operator.observe_with_derivatives(NODES, [bell(NODES, 0.1, 3.8, 2.2)])
    expected = 0.003 * np.sqrt((slopes[0] ** 2).sum(axis=1))  # what the slopes say of the scatter
    np.testing.assert_allclose(together.std(axis=0), expected, rtol=0.2)
    np.testing.assert_allclose(together.mean(axis=0), clean[0], atol=0.4 * expected.max())


# Derivatives


@pytest.mark.parametrize("operator", FORMS, ids=str)
def test_slopes_against_differences(operator):
    profiles, directions = plates(NODES), np.random.default_rng(2).normal(size=(5, 41))
    seen, slopes = operator.observe_with_derivatives(NODES, profiles)
    np.testing.assert_allclose(seen, operator.observe(NODES, profiles), rtol=1e-13)
    for direction in directions:
        change = 0.1 * profiles[:, :1] * direction
        expected = richardson(lambda h, change=change: operator.observe(NODES, profiles + h * change), 1e-3)
        np.testing.assert_allclose(np.einsum("fvn,fn->fv", slopes, change), expected, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("operator", FORMS, ids=str)
def test_what_is_observed_is_smooth_in_the_window(operator):
    profiles = plates(NODES)
    slopes = operator.window_derivatives(NODES, profiles)
    expected = richardson(lambda h: operator.replace(window=operator.window + h).observe(NODES, profiles), 1e-5)
    np.testing.assert_allclose(slopes, expected, rtol=1e-6, atol=1e-7)  # radii on nodes: the kinks there cost a digit
    steps = np.linspace(operator.window - 0.2, operator.window, 81)
    seen = np.array([operator.replace(window=window).observe(NODES, profiles)[-1] for window in steps])
    assert np.abs(np.diff(seen, axis=0)).max() < 4 * np.abs(slopes[-1]).max() * (steps[1] - steps[0])


@pytest.mark.parametrize("operator", FORMS, ids=str)
def test_slopes_to_a_motion_of_the_nodes(operator):
    profiles, shift = plates(NODES), NODES * (10 - NODES) / 25
    slopes = operator.node_derivatives(NODES, profiles, shift)
    expected = richardson(lambda h: operator.observe(NODES + h * shift, profiles), 1e-6)
    np.testing.assert_allclose(slopes, expected, rtol=1e-6, atol=1e-7)


# Finite elements' profiles: CalculiX on the true dimple, u_z at eight radii and a fit made elsewhere


@needs_shared_data
@pytest.mark.parametrize("name", ["dabi_norton_in625_800C_steady.csv", "dabi_timehardening.csv"])
def test_fits_of_calculix_profiles(name):
    # the fits of the tables are unweighted ones over the nodes; tolerances are three times what the spline leaves
    nodes, profiles, fits = table(name)
    error = np.abs(Observation(points=61).observe(nodes, profiles) - fits).max(axis=0)
    assert (error < [5e-5, 3e-4, 8e-4]).all()
    # radii .1 mm apart instead: the two ends of the window weigh a little less
    error = np.abs(Observation().observe(nodes, profiles) - fits).max(axis=0)
    assert (error < [2e-4, 8e-4, 2e-3]).all()


@needs_shared_data
def test_window_at_an_apex_of_two_thirds_of_a_mm():
    # printed to three digits with the sentence "the window matters" of the notes on the true dimple
    nodes, profile = profile_with_apex(0.66)
    for window, share, shape in ((7.5, 0.992, 2.18), (5.0, 0.997, 2.11), (4.0, 0.999, 2.07)):
        D, _, p = Observation("profile", window, round(10 * window) + 1).observe(nodes, profile)[0]
        assert abs(D / 0.66 - share) < 6e-4
        assert abs(p - shape) < 6e-3


# The operator as text


# ---- displacement fields ---------------------------------------------------------------------------------------------

# Fields of points, as cameras give them, to D_amp, S_d, S_p and the place of the bulge.


def pixels(points=50):
    side = np.linspace(-8.0, 8.0, points)
    return np.meshgrid(side, side)


def fitted(surface, near=(0.3, 0.0)):
    """D, S, p and the place of the bulge, by least squares to what was seen of a field."""
    places, seen = np.stack(pixels(), axis=-1).reshape(-1, 2), np.isfinite(surface).reshape(1, -1)
    start = np.array([[0.0, np.log(3.0), np.log(2.0)]])
    center, fits, _ = joint_center(places, np.nan_to_num(surface).reshape(1, -1), 1.0 * seen, np.array(near), start)
    return [fits.values[0, 0], *np.exp(fits.values[0, 1:]), *center]


def test_planted_field_is_recovered():
    x, y = pixels()
    for D in (0.35, -0.35):
        surface = cross(x - 0.7, y + 0.4, D, 3.6, 2.3)
        np.testing.assert_allclose(fitted(surface), [D, 3.6, 2.3, 0.7, -0.4], rtol=1e-10)
        surface[3, 4], surface[9:12, 9] = 2.0, np.nan  # a wild point, and lost ones
        np.testing.assert_allclose(fitted(surface)[:3], [D, 3.6, 2.3], rtol=0.01)


# ---- observation at times --------------------------------------------------------------------------------------------

# What is observed at the times of frames, from the accepted steps of a simulation, in one call.


TIMES = np.concatenate([[0.0, 0.0], np.geomspace(10, 14400, 12), [14400.0], 14400 + np.geomspace(10, 28800, 12)])
SEGMENTS = np.repeat([0, 1], [14, 13])
PROGRAM = np.zeros((2, 10))
PROGRAM[:, :4] = [[0, 14400, 8, 8], [14400, 43200, 10, 10]]
STEPS = TimeInterpolation.from_steps(TIMES, SEGMENTS, PROGRAM)
FRAMES = np.append(np.linspace(0.0, 43200.0, 31), 50000.0)


def profiles(growth=1.0, width=3.6):
    """Of the accepted steps, at rest first: (steps, nodes), mm."""
    share = (TIMES / 43200.0)[:, None]
    moved = bell(NODES, 0.1 + 0.5 * growth * share**0.7, width + 0.3 * share, 2.0 + 0.3 * share)
    return np.where(np.arange(TIMES.size)[:, None] == 0, 0.0, moved)


@pytest.mark.parametrize("lanes", ["2", "4", "8"])
def test_every_width_of_vectors_gives_the_same(monkeypatch, lanes):
    expected, derivatives = Observation("field").observe_with_derivatives(NODES, profiles())
    monkeypatch.setenv("CREEPKIT_LANES", lanes)  # a processor that has fewer takes what it has
    got, got_derivatives = Observation("field").observe_with_derivatives(NODES, profiles())
    np.testing.assert_allclose(got, expected, rtol=1e-13)
    np.testing.assert_allclose(got_derivatives, derivatives, rtol=1e-10, atol=1e-12)


def test_derivatives_against_differences():
    operator = Observation()
    fit = operator.sampling(NODES).fit
    directions = [dict(growth=1.0), dict(width=3.6)]
    base = [1.0, 3.6]

    def difference(function, k):
        name = next(iter(directions[k]))
        return richardson(lambda h: function(**{name: base[k] + h}), 1e-3)

    changes = np.stack([difference(profiles, k) for k in range(2)], axis=-1)
    _, derivatives = fit.observe_at_times(profiles(), STEPS, FRAMES, changes)
    for k in range(2):
        expected = difference(lambda **v: operator.observe_at_times(NODES, profiles(**v), STEPS, FRAMES), k)
        np.testing.assert_allclose(derivatives[:-1, :, k], expected[:-1], rtol=1e-7, atol=1e-8)


# ---- profile ---------------------------------------------------------------------------------------------------------

# Displacement at any radius, between the nodes of the top.


def test_interpolation_is_exact_for_parabolas_and_nodal():
    nodes = np.concatenate([[0.0], np.cumsum(np.repeat(np.random.default_rng(1).uniform(0.2, 0.9, 8), 2))])
    wanted = np.linspace(0.0, nodes[-1], 57)
    parabola = np.polynomial.Polynomial([0.3, -0.2, 0.07])
    np.testing.assert_allclose(surface_interpolation(nodes, wanted) @ parabola(nodes), parabola(wanted), atol=1e-13)
    np.testing.assert_allclose(surface_interpolation(nodes, nodes), np.eye(nodes.size), atol=1e-13)


def test_interpolation_follows_the_element_where_its_middle_node_is_off():
    first, middle, last = nodes = np.array([1.0, 1.4, 2.0])
    for c in (-0.9, -0.3, 0.2, 0.7):
        shapes = np.array([c * (c - 1) / 2, 1 - c * c, c * (c + 1) / 2])
        np.testing.assert_allclose(surface_interpolation(nodes, [shapes @ nodes])[0], shapes, atol=1e-13)
    assert first < middle < last
