"""Which autocorrelated parts stay in the working noise: drawn residuals with none, with a drift, with a discrepancy."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals, autocorrelated_components, covariance
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT
from creepkit.inverse.output_transforms import LinearTransform
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.variance_components import LONGEST_DRIFT, LinearisedProblem
from creepkit.inverse.working_noise import WorkingNoiseEstimator

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
    residuals = Residuals(0 * ones, ones / SCALE, ones > 0, CLOCK, design, 0 * ones, OUTPUT, ones, np.ones(TESTS),
                          discrepancy_unit=unit)  # fmt: skip
    drift = noise_model.pop("drift", 0.0)
    outputs = {
        name: OutputNoise(sd, drift=drift if k == 0 else 0.0, correlation_length=0.2)
        for k, (name, sd) in enumerate(zip(NAMES, NOISE, strict=True))
    }
    factor = np.linalg.cholesky(covariance(residuals, NoiseModel(outputs, **noise_model)))
    values = (factor @ rng.normal(size=(*SHAPE, 1)))[..., 0]
    bounds = np.array([[-np.inf], [np.inf]]) * np.ones(3)
    return LinearisedProblem(
        replace(residuals, values=values), np.full(3, 1e-12), np.zeros(3), np.ones(3, bool), bounds
    )


def working(linear, errors=None, **known):
    estimator = WorkingNoiseEstimator(LIKELIHOOD, observations(**known), errors)
    previous = NoiseModel({name: OutputNoise(sd) for name, sd in zip(NAMES, NOISE, strict=True)})
    return estimator.estimate(linear.residuals, previous, linear)


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


@pytest.mark.parametrize("periods", [0.75, 1.0, 1.5])
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
    estimator = WorkingNoiseEstimator(LIKELIHOOD, observations(), {"width": 0.06})
    assert estimator.unestimated_drift_components(found) == {("width", "drift"), ("width", "correlation_length")}


def test_stated_noise_is_bounded_and_estimated_noise_is_not():
    linear = drawn(5)
    quiet = replace(linear, residuals=replace(linear.residuals, values=0.5 * linear.residuals.values))
    assert [working(quiet)[name].noise for name in NAMES] == pytest.approx(NOISE, rel=1e-6)
    free = working(quiet, stated=False)
    assert [free[name].noise for name in NAMES] == pytest.approx([0.5 * sd for sd in NOISE], rel=0.1)
    assert [free[name].stated for name in NAMES] == [0.0, 0.0]


def test_a_rupture_time_has_no_drift():
    estimator = WorkingNoiseEstimator(LIKELIHOOD, observations(names=("strain", RUPTURE_OUTPUT)))
    start = NoiseModel({"strain": OutputNoise(0.02), RUPTURE_OUTPUT: OutputNoise(0.05)})
    found = estimator._initial_components(start, drift=True, discrepancy=True)
    assert found["strain"].drift > 0
    assert found[RUPTURE_OUTPUT].drift == 0.0
    assert found.discrepancy > 0
