"""Whitening and likelihood by the filter: arithmetic of fifty digits, SciPy's normal density, and facts of REML."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from creepkit.inverse.noise_covariance import CovarianceFactor, NoiseLikelihood
from creepkit.inverse.noise_model import OUTPUT_COMPONENTS, SHARED_COMPONENTS, NoiseModel, OutputNoise, Residuals
from creepkit.inverse.observation_series import SharedNoise

NAMES = ("amplitude", "width", "rupture_time")
CORRELATIONS = np.array([
    [[1.0, 0.9, 0.3], [0.9, 1.0, 0.1], [0.3, 0.1, 1.0]],
    np.eye(3),
    [[1.0, -0.6, 0.0], [-0.6, 1.0, 0.0], [0.0, 0.0, 1.0]],
])  # fmt: skip
"""Of the noise of the outputs of a frame, for each test."""


def example(seed=0, frames=5, tests=3, correlated=False):
    """Tests of two outputs and one rupture time each, with every source of scatter, and residuals of three unknowns.

    correlated : whether the noise of the outputs of a frame is.

    Absent frames, one of them the whole second output of a test; two frames at one time; the third
    unknown belongs to the first test alone.
    """
    rng, count = np.random.default_rng(seed), 2 * frames + 1
    times = np.sort(rng.uniform(0.1, 5.0, size=(tests, frames)), axis=1)
    times[0, 2] = times[0, 1]
    clock = np.concatenate([times, times, times[:, -1:] + 0.3], axis=1)
    output = np.tile(np.repeat([0, 1, 2], [frames, frames, 1]), (tests, 1))
    frame = np.tile([*range(frames), *range(frames), 0], (tests, 1))
    present = np.ones((tests, count), bool)
    present[0, 1] = present[-1, count - 1] = False
    present[1, frames : 2 * frames] = False
    jacobian = rng.normal(size=(tests, count, 3)) * present[..., None]
    jacobian[1:, :, 2] = 0.0
    values, slope, rate, unit, life = (rng.normal(size=(tests, count)) * present for _ in range(5))
    residuals = Residuals(
        values=values,
        offset_sensitivity=slope,
        present=present,
        correlation_coordinate=clock,
        jacobian=jacobian,
        log_rate_sensitivity=rate,
        log_life_sensitivity=life,
        output_index=output,
        relative_noise=1.0 + rng.uniform(size=(tests, count)),
        random_effect_sensitivities=0.3 * rng.normal(size=(tests, count, 2)) * present[..., None],
        discrepancy_unit=np.where(output == 2, 0.0, np.abs(unit)),
        shared_noise=SharedNoise.of_correlations(CORRELATIONS, output, frame) if correlated else None,
    )
    noise = NoiseModel(
        {
            "amplitude": OutputNoise(0.1, 0.05, 0.7, 0.4, 0.6),
            "width": OutputNoise(0.3, 0.0, 0.2, 0.9, 2.0),
            "rupture_time": OutputNoise(0.2 if correlated else 0.0, 0.4, 0.0, 0.0, 1.0),
        },
        rate=0.5,
        life=0.6,
        discrepancy=1.3,
        discrepancy_length=0.8,
    )
    return residuals, noise


def likelihood_of(residuals, noise, precision=(0.1, 0.0, 2.0), prior_residual=(0.2, 0.0, -0.4)):
    values = np.concatenate([residuals.values[..., None], residuals.jacobian], axis=-1)
    return NoiseLikelihood(residuals.series, values, np.array(precision), np.array(prior_residual), noise.components)


# ---- fifty digits ----------------------------------------------------------------------------------------------------


def exact_covariance(residuals, sizes, test):
    """The covariance of the data of one test, entry by entry; sizes : {(output, component): number}."""
    r, index = residuals, np.flatnonzero(residuals.present[test])
    s, d, b, t, w, u = (
        [mpmath.mpf(float(v)) for v in array[test]]
        for array in (
            r.offset_sensitivity,
            r.log_rate_sensitivity,
            r.log_life_sensitivity,
            r.correlation_coordinate,
            r.relative_noise,
            r.discrepancy_unit,
        )
    )
    effects = mpmath.matrix(r.random_effect_sensitivities[test].tolist())
    c = mpmath.zeros(index.size)
    for row, i in enumerate(index):
        for column, j in enumerate(index):
            entry = sizes["", "rate"] ** 2 * d[i] * d[j] + sizes["", "life"] ** 2 * b[i] * b[j]
            entry += sum(effects[int(i), k] * effects[int(j), k] for k in range(effects.cols))
            if r.output_index[test, i] == r.output_index[test, j]:
                own, lag = NAMES[r.output_index[test, i]], abs(t[i] - t[j])
                entry += sizes[own, "offset"] ** 2 * s[i] * s[j]
                entry += sizes[own, "drift"] ** 2 * mpmath.exp(-lag / sizes[own, "correlation_length"])
                entry += (
                    sizes["", "discrepancy"] ** 2 * u[i] * u[j] * mpmath.exp(-lag / sizes["", "discrepancy_length"])
                )
            if i != j and r.shared_noise is not None and r.shared_noise.frame[test, i] == r.shared_noise.frame[test, j]:
                pair = [r.output_index[test, k] for k in (i, j)]
                rho = mpmath.mpf(CORRELATIONS[test][pair[0], pair[1]])
                noises = [sizes[NAMES[o], "noise"] * w[k] * s[k] for o, k in zip(pair, (i, j), strict=True)]
                entry += rho * noises[0] * noises[1]
            if i == j:
                own = NAMES[r.output_index[test, i]]
                entry *= 1 + mpmath.mpf(1e-9)
                entry += (sizes[own, "noise"] * w[i] * s[i]) ** 2 + sizes[own, "misfit"] ** 2 + mpmath.mpf(1e-10)
            c[row, column] = entry
    return c


def exact_restricted_cost(residuals, sizes, precision, prior_residual):
    """(ln|C| + ln|A| + least chi-square) / 2 by LU decompositions."""
    p = len(precision)
    normal, right, total = mpmath.diag(list(precision)), mpmath.zeros(p, 1), mpmath.mpf(0)
    for k in range(p):
        right[k] = precision[k] * mpmath.mpf(prior_residual[k])
        total += right[k] * mpmath.mpf(prior_residual[k])
    for test, present in enumerate(residuals.present):
        c = exact_covariance(residuals, sizes, test)
        X = mpmath.matrix(residuals.jacobian[test, present].tolist())
        y = mpmath.matrix(residuals.values[test, present].tolist())
        inverse = c**-1
        total += mpmath.log(mpmath.det(c)) + (y.T * inverse * y)[0]
        normal += X.T * inverse * X
        right += X.T * inverse * y
    total += mpmath.log(mpmath.det(normal)) - (right.T * mpmath.lu_solve(normal, right))[0]
    return total / 2


@pytest.fixture
def fifty_digits():
    with mpmath.workdps(50):
        yield


def exact_sizes(noise):
    sizes = {(o, n): getattr(noise[o], n) for o in noise.outputs for n in OUTPUT_COMPONENTS}
    sizes |= {("", n): getattr(noise, n) for n in SHARED_COMPONENTS}
    return {key: mpmath.mpf(float(v)) for key, v in sizes.items()}


@pytest.mark.usefixtures("fifty_digits")
@pytest.mark.parametrize(("restricted", "correlated"), [(True, False), (False, False), (True, True)])
def test_value_and_gradient_are_those_of_fifty_digits(restricted, correlated):
    residuals, noise = example(correlated=correlated)
    precision, prior_residual = ((0.1, 0.0, 2.0), (0.2, 0.0, -0.4)) if restricted else ((), ())
    residuals = residuals if restricted else replace(residuals, jacobian=residuals.jacobian[..., :0])
    value, gradient = likelihood_of(residuals, noise, precision, prior_residual)(noise.components)

    def exact(sizes):
        if restricted:
            return exact_restricted_cost(residuals, sizes, precision, prior_residual)
        total = mpmath.mpf(0)
        for test, present in enumerate(residuals.present):
            c, y = exact_covariance(residuals, sizes, test), mpmath.matrix(residuals.values[test, present].tolist())
            total += mpmath.log(mpmath.det(c)) + (y.T * mpmath.lu_solve(c, y))[0]
        return total / 2

    sizes, step = exact_sizes(noise), mpmath.mpf(10) ** -15
    assert value == pytest.approx(float(exact(sizes)), rel=1e-12)
    for (key, size), found in zip(sizes.items(), gradient, strict=True):
        ends = [exact(sizes | {key: size * mpmath.exp(sign * step)}) for sign in (1, -1)]
        slope = float((ends[0] - ends[1]) / (2 * step)) if size > 0 else 0.0
        assert found == pytest.approx(slope, rel=1e-10, abs=1e-12), key


@pytest.mark.usefixtures("fifty_digits")
def test_offsets_far_above_the_noise_cost_no_digits():
    """A condition of up to 1e10: the matrix itself, in double precision, would leave six digits."""
    residuals, noise = example(seed=1)
    small = {name: replace(output, noise=1e-5, misfit=1e-5) for name, output in noise.outputs.items()}
    noise = replace(noise, outputs=small)
    value, _ = likelihood_of(residuals, noise)(noise.components)
    exact = exact_restricted_cost(residuals, exact_sizes(noise), (0.1, 0.0, 2.0), (0.2, 0.0, -0.4))
    assert value == pytest.approx(float(exact), rel=1e-10)


# ---- one factor ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("correlated", [False, True])
def test_whitening_is_by_the_cholesky_factor_and_solving_by_the_inverse(correlated):
    """Of observations by output, or by frame where the noise of a frame is correlated."""
    residuals, noise = example(frames=12, correlated=correlated)
    factor = CovarianceFactor.of_residuals(residuals, noise)
    c = factor.blocks
    for block, here, test in zip(c, residuals.present, range(3), strict=True):
        exact = np.array(exact_covariance(residuals, exact_sizes(noise), test).tolist(), float)
        np.testing.assert_allclose(block[np.ix_(here, here)], exact, rtol=1e-9, atol=1e-12)
    values = np.random.default_rng(3).normal(size=(*residuals.values.shape, 4))
    order = np.lexsort((residuals.output_index[0], residuals.shared_noise.frame[0])) if correlated else slice(None)
    root = np.linalg.cholesky(c[:, order][:, :, order])
    np.testing.assert_allclose(factor.whiten(values)[:, order], np.linalg.solve(root, values[:, order]), rtol=1e-8)
    np.testing.assert_allclose(factor.inverse_times(values), np.linalg.solve(c, values), rtol=1e-7)
    np.testing.assert_array_equal(factor.whiten(values[..., 1]), factor.whiten(values)[..., 1])
    assert factor.log_determinant == pytest.approx(np.linalg.slogdet(c)[1].sum(), rel=1e-10)


@pytest.mark.parametrize("correlated", [False, True])
def test_standard_deviations_are_those_of_the_covariance(correlated):
    residuals, noise = example(correlated=correlated)
    common = np.random.default_rng(1).normal(size=(*residuals.values.shape, 2)) * residuals.present[..., None]
    factor = CovarianceFactor.of_residuals(replace(residuals, common_effects=common), noise)
    whole = np.diagonal(factor.blocks, axis1=1, axis2=2) + (common**2).sum(axis=-1)
    np.testing.assert_allclose(factor.standard_deviations**2, whole, rtol=1e-9)


def test_correlated_noise_at_a_correlation_of_zero_is_no_other():
    """The states by frame and by output give one likelihood."""
    residuals, noise = example(frames=9)
    none = np.zeros((*residuals.values.shape, 1))
    frame = np.tile([*range(9), *range(9), 0], (3, 1))
    by_frame = replace(residuals, shared_noise=SharedNoise(frame, none))
    ends = [likelihood_of(one, noise)(noise.components) for one in (residuals, by_frame)]
    assert ends[0][0] == pytest.approx(ends[1][0], rel=1e-12)
    np.testing.assert_allclose(ends[0][1], ends[1][1], rtol=1e-9)


def test_the_likelihood_is_scipys():
    residuals, noise = example(frames=12)
    c = CovarianceFactor.of_residuals(residuals, noise).blocks
    truth = sum(
        multivariate_normal(np.zeros(p.sum()), c[k][np.ix_(p, p)]).logpdf(residuals.values[k, p])
        for k, p in enumerate(residuals.present)
    )
    factor, count = CovarianceFactor.of_residuals(residuals, noise), int(residuals.present.sum())
    squares = (factor.whiten(residuals.values) ** 2).sum()
    found = -0.5 * (squares + factor.log_determinant + count * np.log(2 * np.pi))
    assert found == pytest.approx(truth, rel=1e-10)


@pytest.mark.parametrize("correlated", [False, True])
def test_the_order_of_observations_does_not_matter(correlated):
    """Frames shuffled, and outputs among each other: the same likelihood, and a whitening of the same squares."""
    residuals, noise = example(frames=7, correlated=correlated)
    order = np.random.default_rng(4).permutation(residuals.values.shape[1])
    arrays = {name: v[:, order] for name, v in vars(residuals).items() if isinstance(v, np.ndarray) and v.ndim > 1}
    shuffled = replace(residuals, **arrays)
    if correlated:
        own = residuals.shared_noise
        shuffled = replace(shuffled, shared_noise=SharedNoise(own.frame[:, order], own.loadings[:, order]))
    ends = [likelihood_of(one, noise)(noise.components) for one in (residuals, shuffled)]
    assert ends[0][0] == pytest.approx(ends[1][0], rel=1e-12)
    np.testing.assert_allclose(ends[0][1], ends[1][1], rtol=1e-10)
    factor = CovarianceFactor.of_residuals(shuffled, noise)
    expected = np.einsum("te,tef,tf->", shuffled.values, np.linalg.inv(factor.blocks), shuffled.values)
    assert (factor.whiten(shuffled.values) ** 2).sum() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("correlated", [False, True])
def test_an_observation_without_data_is_left_as_it_is(correlated):
    residuals, noise = example(correlated=correlated)
    values = np.ones(residuals.values.shape)
    for found in (CovarianceFactor.of_residuals(residuals, noise).whiten(values),
                  CovarianceFactor.of_residuals(residuals, noise).inverse_times(values)):  # fmt: skip
        np.testing.assert_array_equal(found[~residuals.present], 1.0)
    nothing = replace(residuals, present=np.zeros_like(residuals.present))
    assert CovarianceFactor.of_residuals(nothing, noise).log_determinant == 0.0


def test_components_go_into_a_noise_model_and_out():
    _, noise = example()
    assert noise.with_components(noise.components) == noise
    doubled = noise.with_components(2.0 * noise.components)
    assert doubled["width"].drift == 2.0 * noise["width"].drift
    assert doubled.discrepancy_length == 2.0 * noise.discrepancy_length
    for output, name in (("width", "offset"), ("", "rate")):
        size = getattr(noise[output] if output else noise, name)
        assert noise.components[noise.position(output, name)] == size


# ---- restricted likelihood -------------------------------------------------------------------------------------------

FLAT = (0.0, 0.0, 0.0)


def test_what_the_unknowns_can_explain_changes_nothing():
    """Patterson & Thompson (1971): y + X b has the same restricted likelihood, and the same gradient."""
    residuals, noise = example(frames=9)
    moved = replace(residuals, values=residuals.values + residuals.jacobian @ np.array([3.0, -2.0, 5.0]))
    plain, other = (likelihood_of(one, noise, FLAT, FLAT)(noise.components) for one in (residuals, moved))
    assert other[0] == pytest.approx(plain[0], rel=1e-11)
    np.testing.assert_allclose(other[1], plain[1], rtol=1e-9, atol=1e-11)


def test_a_prior_is_an_observation_of_the_unknown():
    """Precision 1 / v about m: one more observation m of variance v, apart from ln v."""
    residuals, noise = example(frames=6)
    own = {
        name: np.concatenate([v, np.zeros((1, *v.shape[1:]), v.dtype)])
        for name, v in vars(residuals).items()
        if isinstance(v, np.ndarray)
    }
    own["present"][-1, 0] = True
    own["values"][-1, 0], own["jacobian"][-1, 0, 0], own["output_index"][-1] = -0.7, 1.0, 2
    variance = noise["rupture_time"].misfit ** 2 + 1e-10
    stated = likelihood_of(residuals, noise, (1.0 / variance, 0.0, 0.0), (-0.7, 0.0, 0.0))(noise.components)[0]
    observed = likelihood_of(Residuals(**own), noise, FLAT, FLAT)(noise.components)[0]
    assert observed == pytest.approx(stated + 0.5 * np.log(variance), rel=1e-11)
