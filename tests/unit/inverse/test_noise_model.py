"""Scatter: the likelihood is the textbook one, and planted sizes are found again."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import f

from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.noise_covariance import CovarianceFactor, effective_sample_size, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals, autocorrelated_components
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.output_transforms import LinearTransform
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.variance_components import LONGEST_DRIFT, LinearisedProblem, estimate_variance_components
from creepkit.inverse.working_noise import WorkingNoiseEstimator
from creepkit.records import History, Nuisance, constant_stress
from creepkit.specimens.uniaxial import Uniaxial

BOTH = (Nuisance("offset"), Nuisance("rate"))


def sizes(noise, misfit=0.0, offset=0.0, rate=0.0, drift=0.0, correlation_length=1.0):
    """Scatter of strains alone."""
    return NoiseModel({"strain": OutputNoise(noise, misfit, offset, drift, correlation_length)}, rate)


def residuals_of(values, slopes, present, times, effect, output=None):
    """Residuals of frames of equal noise."""
    output = np.zeros(values.shape, np.int64) if output is None else output
    return Residuals(
        values, slopes, present, np.log(times), np.zeros((*values.shape, 0)), effect, output, np.ones(values.shape)
    )


def made(tests, frames, seed, scatter):
    """Residuals drawn from the very covariance, on strains that grow in time."""
    rng = np.random.default_rng(seed)
    times = np.tile(np.geomspace(10, 1e5, frames), (tests, 1))
    strain = 1e-4 + 2e-2 * times / times.max()
    slopes = 1 / strain
    effect = 0.7 * np.ones_like(slopes)
    shape = residuals_of(np.zeros_like(slopes), slopes, np.ones_like(slopes, bool), times, effect)
    factor = np.linalg.cholesky(CovarianceFactor.of_residuals(shape, scatter).blocks)
    return replace(shape, values=(factor @ rng.normal(size=(tests, frames, 1)))[..., 0])


def test_planted_scatter_is_found():
    """150 tests: the standard error of a standard deviation from 150 draws is 6 %, so 25 % is four of them."""
    truth = sizes(noise=2e-5, offset=1e-4, rate=0.4, drift=0.1, correlation_length=0.45)
    residuals = made(150, 30, 2, truth)
    found = estimate_variance_components(residuals, sizes(2e-5, 0, 3e-5, 0.5, 0.2, 0.2), BOTH)
    assert found["strain"].offset == pytest.approx(truth["strain"].offset, rel=0.25)
    assert found.rate == pytest.approx(truth.rate, rel=0.25)
    assert found["strain"].drift == pytest.approx(truth["strain"].drift, rel=0.25)
    assert found["strain"].correlation_length == pytest.approx(truth["strain"].correlation_length, rel=0.5)


def test_effective_size_counts_a_test_once_when_its_residuals_move_together():
    residuals = made(6, 40, 4, sizes(1e-6, 0.0, 0.0, 1.0, 0.0, 1.0))
    assert effective_sample_size(residuals, sizes(1e-6, 0.0, 0.0, 1.0, 0.0, 1.0)) == pytest.approx(6, rel=0.01)
    assert effective_sample_size(residuals, sizes(1e-1, 0.0, 0.0, 0.0, 0.0, 1.0)) == pytest.approx(240, rel=0.01)


def test_expected_effects_find_the_offset_and_rate_of_each_test():
    """With tiny noise the best linear prediction is the truth; the sign is that of measured minus predicted."""
    times = np.tile(np.geomspace(10, 1e5, 40), (2, 1))
    strain = 1e-4 + 2e-2 * times / times.max()
    slopes, effect = 1 / strain, np.ones_like(strain)
    offset, log_factor = np.array([3e-5, -2e-5]), np.array([0.2, -0.1])
    residual = -(slopes * offset[:, None] + effect * log_factor[:, None])
    shape = residuals_of(residual, slopes, np.ones_like(slopes, bool), times, effect)
    found = predicted_random_effects(shape, sizes(1e-8, 0.0, 1e-3, 2.0, 0.0, 1.0))
    np.testing.assert_allclose(found.offsets[:, 0], offset, rtol=1e-2)
    np.testing.assert_allclose(found.log_factors, [log_factor, [0.0, 0.0]], rtol=1e-2)


# ---- several outputs -----------------------------------------------------------------------------------------------


def two_outputs():
    """Two tests of two outputs end to end, five frames each; only the rate joins them."""
    rng = np.random.default_rng(5)
    times = np.tile(np.geomspace(10, 1e4, 5), (2, 2))
    output = np.repeat([[0, 1]], 5, axis=1).repeat(2, axis=0)
    slopes, effect = 1 + rng.uniform(size=(2, 10)), rng.normal(size=(2, 10))
    scatter = NoiseModel(
        {"amplitude": OutputNoise(0.1, 0.2, 0.3, 0.4, 1.0), "width": OutputNoise(0.2, 0.1, 0.5, 0.3, 2.0)}, 0.6
    )
    return residuals_of(rng.normal(size=(2, 10)), slopes, np.ones((2, 10), bool), times, effect, output), scatter


# ---- model discrepancy ---------------------------------------------------------------------------------------------


def with_discrepancy(seed=6):
    """The residuals of two outputs, their units of discrepancy, and a noise model with a discrepancy."""
    residuals, scatter = two_outputs()
    unit = 0.5 + np.random.default_rng(seed).uniform(size=residuals.values.shape)
    return replace(residuals, discrepancy_unit=unit), replace(scatter, discrepancy=1.3, discrepancy_length=0.8)


@pytest.mark.parametrize("restricted", [False, True])
def test_slopes_of_the_likelihood_are_its_differences(restricted):
    """Plain and restricted; the noise of the first output is stated, a sixth below, which gives it a prior."""
    from creepkit.inverse.variance_components import LinearisedProblem, _Likelihood

    residuals, scatter = with_discrepancy()
    scatter, linear = scatter.with_output("amplitude", stated=0.085), None
    if restricted:
        design = np.random.default_rng(7).normal(size=(2, 10, 3))
        residuals = replace(residuals, jacobian=design)
        bounds = np.array([[-np.inf], [np.inf]]) * np.ones(3)
        linear = LinearisedProblem(residuals, np.full(3, 0.1), np.array([0.2, 0.0, -0.1]), np.ones(3, bool), bounds)
    free = [("amplitude", "noise"), ("", "discrepancy"), ("", "discrepancy_length"), ("", "rate")]
    free += [("width", name) for name in ("noise", "offset", "drift", "correlation_length")]
    likelihood = _Likelihood(residuals, scatter, free, linear)
    x = np.log([0.1, 1.3, 0.8, 0.6, 0.2, 0.5, 0.3, 2.0])
    slope = likelihood.cost(x)[1]
    for k in range(x.size):
        step = 1e-5 * np.eye(x.size)[k]
        difference = (likelihood.cost(x + step)[0] - likelihood.cost(x - step)[0]) / 2e-5
        assert slope[k] == pytest.approx(difference, rel=1e-5, abs=1e-7)


def test_a_planted_discrepancy_of_two_outputs_is_found():
    """300 series: 4 % of a standard deviation in one standard error; the outputs' noises differ by a factor of 20."""
    rng, frames = np.random.default_rng(8), 24
    clock = np.tile(np.linspace(0.2, 5.0, frames), (150, 2))
    output = np.tile(np.repeat([0, 1], frames), (150, 1))
    noise = np.where(output == 0, 0.02, 0.4)
    ones = np.ones_like(clock)
    shape = Residuals(0 * ones, ones, ones > 0, clock, np.zeros((*ones.shape, 0)), 0 * ones, output, ones,
                      discrepancy_unit=noise)  # fmt: skip
    parts = {"amplitude": OutputNoise(0.02), "width": OutputNoise(0.4)}
    truth = NoiseModel(parts, discrepancy=2.0, discrepancy_length=1.2)
    drawn = np.linalg.cholesky(CovarianceFactor.of_residuals(shape, truth).blocks) @ rng.normal(size=(*clock.shape, 1))
    start = replace(truth, discrepancy=0.5, discrepancy_length=0.5)
    found = estimate_variance_components(replace(shape, values=drawn[..., 0]), start, (), fixed=())
    assert found.discrepancy == pytest.approx(2.0, rel=0.12)
    assert found.discrepancy_length == pytest.approx(1.2, rel=0.3)
    assert [found[name].noise for name in parts] == pytest.approx([0.02, 0.4], rel=0.1)


@pytest.mark.parametrize(("actual", "stated"), [(0.3, 0.2), (0.1, 0.2), (0.21, 0.2)])
def test_stated_noise_is_a_lower_bound_with_a_prior(actual, stated):
    """White noise s of n frames: the least of n ln s + RSS / 2 s^2 + (ln(s / stated) / 0.2)^2 / 2 over s >= stated."""
    values = actual * np.random.default_rng(9).normal(size=(1, 25))
    ones = np.ones_like(values)
    residuals = residuals_of(values, ones, ones > 0, np.linspace(1.0, 2.0, 25)[None], 0 * ones)
    start = NoiseModel({"strain": OutputNoise(stated, stated=stated)})
    found = estimate_variance_components(residuals, start, (), fixed=())["strain"].noise
    s = stated * np.exp(np.linspace(0.0, 2.0, 200001))
    cost = 25 * np.log(s) + 0.5 * (values**2).sum() / s**2 + 0.5 * (np.log(s / stated) / 0.2) ** 2
    assert found == pytest.approx(s[np.argmin(cost)], rel=1e-3)
    assert found >= stated * (1 - 1e-9)


# ---- known noise -----------------------------------------------------------------------------------------------------

# Noise that is known without a law: in proportion to strain or constant, and p-values of several tests.


TIMES = np.linspace(1e4, 1e6, 120)
CURVE = 1e-3 * (TIMES / 1e4) ** 0.7


def history(noise, name="a", **more):
    rng = np.random.default_rng(3)
    strain = CURVE + noise * rng.standard_normal(TIMES.size)
    return History(name, TIMES, {"strain": strain}, constant_stress(100.0), 1000.0, **more)


def known(*histories):
    tests = list(histories)
    return KnownNoise.of_histories(ObservationVector.from_histories(tests, Uniaxial()), tests)


def test_noise_in_proportion_to_strain_is_seen_as_such():
    """1.5 % of the strain, estimated of 120 frames: 20 % are two standard errors of each half's estimate."""
    sd = known(history(0.015 * CURVE)).sd[0]
    ratio = sd / (0.015 * CURVE)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.25)
    assert ratio[-1] / ratio[10] == pytest.approx(1.0, abs=0.4)


def test_stated_noise_is_known_exactly_and_short_tests_are_not_judged():
    stated = history(1e-5, standard_deviation={"strain": 3e-5})
    assert known(stated).sd[0] == pytest.approx(3e-5)
    assert np.isinf(known(stated).freedom).all()
    short = history(1e-5).replace(times=TIMES[:20], outputs={"strain": CURVE[:20]})
    assert not known(short).judged.any()


def test_one_test_has_the_distribution_of_f_and_several_about_the_nominal_chance():
    """Nine tests of 60 white frames, each over its own variance of 12 degrees of freedom; 1 % of 4000 draws."""
    one = KnownNoise(np.ones((1, 60), bool), np.ones((1, 60)), np.full((1, 60), 12.0))
    assert one.distribution(0.9, one.judged).sf(1.5) == pytest.approx(f.sf(1.5, 54.0, 12.0))
    nine = KnownNoise(np.ones((9, 60), bool), np.ones((9, 60)), np.full((9, 60), 12.0))
    rng = np.random.default_rng(0)
    draws = (rng.chisquare(60, (4000, 9)) / 60 / (rng.chisquare(12, (4000, 9)) / 12)).mean(axis=1)
    assert np.mean(nine.distribution(1.0, nine.judged).sf(draws) < 0.01) < 0.025


# ---- working noise ---------------------------------------------------------------------------------------------------

# Which autocorrelated parts stay in the working noise: drawn residuals with none, with a drift, with a discrepancy.


TESTS, FRAMES = 4, 40
NAMES = ("amplitude", "width")
NOISE = (0.02, 0.05)
SCALE = 2.0
"""mm of an output in one of its transform."""
LIKELIHOOD = IdentificationSettings(weights="likelihood", nuisances=())
OUTPUT = np.tile(np.repeat([0, 1], FRAMES), (TESTS, 1))
CLOCK = np.tile(np.linspace(0.1, 5.0, FRAMES), (TESTS, 2))
SHAPE = (TESTS, 2 * FRAMES)


def observations(stated=True, names=NAMES):
    transforms = tuple(LinearTransform(SCALE, 1.0) for _ in names)
    return SimpleNamespace(
        outputs=names, transforms=transforms, noise=np.array(NOISE), stated=np.full(2, stated), count=2 * FRAMES * TESTS
    )


def drawn(seed, **noise_model):
    """A problem, linear in three values, whose residuals come from this noise model."""
    rng, design = np.random.default_rng(seed), np.stack([CLOCK**k / 5.0**k * (1 + OUTPUT) for k in range(3)], axis=-1)
    ones = np.ones(SHAPE)
    unit = np.array(NOISE)[OUTPUT] / SCALE
    residuals = Residuals(0 * ones, ones / SCALE, ones > 0, CLOCK, design, 0 * ones, OUTPUT, ones,
                          discrepancy_unit=unit)  # fmt: skip
    drift = noise_model.pop("drift", 0.0)
    outputs = {
        name: OutputNoise(sd, drift=drift if k == 0 else 0.0, correlation_length=0.2)
        for k, (name, sd) in enumerate(zip(NAMES, NOISE, strict=True))
    }
    factor = np.linalg.cholesky(CovarianceFactor.of_residuals(residuals, NoiseModel(outputs, **noise_model)).blocks)
    values = (factor @ rng.normal(size=(*SHAPE, 1)))[..., 0]
    bounds = np.array([[-np.inf], [np.inf]]) * np.ones(3)
    return LinearisedProblem(
        replace(residuals, values=values), np.full(3, 1e-12), np.zeros(3), np.ones(3, bool), bounds
    )


def working(linear, errors=None, **known):
    estimator = WorkingNoiseEstimator(LIKELIHOOD, observations(**known), errors)
    previous = NoiseModel({name: OutputNoise(sd) for name, sd in zip(NAMES, NOISE, strict=True)})
    return estimator.estimate(linear, previous)


def parts(noise_model):
    return tuple(name for name in NAMES if noise_model[name].drift > 0), noise_model.discrepancy > 0


def test_white_noise_has_no_autocorrelated_part():
    """Six components at 95 %: at most one in twenty, so of 40 at most 8 at four sigma; stated noise stays."""
    found = [working(drawn(seed)) for seed in range(40)]
    assert sum(autocorrelated_components(one) > 0 for one in found) <= 8
    plain = next(one for one in found if autocorrelated_components(one) == 0)
    assert [plain[name].noise for name in NAMES] == pytest.approx(NOISE, rel=0.1)
    assert all(plain[name].noise >= sd * (1 - 1e-9) for name, sd in zip(NAMES, NOISE, strict=True))


def test_what_the_law_cannot_follow_is_a_discrepancy_of_all_outputs():
    """Three noises, a quarter of the test long, in both outputs: in 9 of 10 draws, none of them with drifts alone."""
    found = [working(drawn(seed, discrepancy=3.0, discrepancy_length=1.2)) for seed in range(10)]
    assert sum(parts(one)[1] for one in found) >= 9
    sizes = [one.discrepancy for one in found if parts(one) == ((), True)]
    assert len(sizes) >= 7
    assert np.median(sizes) == pytest.approx(3.0, rel=0.25)


def test_short_noise_of_one_instrument_is_its_drift():
    """Three noises in the amplitude alone, 4 % of the test long: one size for all outputs does not replace it."""
    found = [working(drawn(seed, drift=0.03)) for seed in range(10)]
    assert sum("amplitude" in parts(one)[0] for one in found) >= 9
    assert np.median([one["amplitude"].drift for one in found]) == pytest.approx(0.03, rel=0.3)
    assert max(one["amplitude"].correlation_length for one in found) <= LONGEST_DRIFT * (1 + 1e-9)


@pytest.mark.parametrize("periods", [0.75, 1.5])
def test_the_misfit_of_one_output_alone_cannot_be_called_its_noise(periods):
    """A slow wave of the amplitude, 20 noises: a drift would need its longest correlation, which means discrepancy."""
    linear = drawn(3)
    wave = np.where(OUTPUT == 0, 20 * NOISE[0] / SCALE * np.sin(2 * np.pi * CLOCK / 5.0 * periods), 0.0)
    found = working(replace(linear, residuals=replace(linear.residuals, values=linear.residuals.values + wave)))
    assert parts(found) == ((), True)
    assert found.discrepancy > 3.0
    assert found["amplitude"].noise < 2 * NOISE[0]


def test_the_error_of_the_predictor_is_a_drift_that_is_not_estimated():
    """0.06 mm are 0.03 of the transform, beside what is estimated; correlated as the curve is."""
    linear = drawn(0)
    plain, found = working(linear), working(linear, {"width": 0.06, "unknown": 1.0})
    assert found["width"].drift == pytest.approx(np.hypot(plain["width"].drift, 0.06 / SCALE))
    assert found["width"].correlation_length == 1.0
    assert found["amplitude"] == plain["amplitude"]
