"""Noise that is known without a law: in proportion to strain or constant, and p-values of several tests."""

import numpy as np
import pytest
from scipy.stats import f

from creepkit.inverse.known_noise import KnownNoise, chance_of_larger
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.records import History, constant_stress
from creepkit.specimens.uniaxial import Uniaxial

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


def test_constant_noise_stays_constant():
    sd = known(history(2e-5)).sd[0]
    assert np.ptp(sd) == 0.0
    assert sd[0] == pytest.approx(2e-5, rel=0.3)


def test_each_test_has_its_own_noise():
    sd = known(history(1e-5), history(4e-5, "b")).sd
    assert np.median(sd[1]) / np.median(sd[0]) == pytest.approx(4.0, rel=0.05)


def test_stated_noise_is_known_exactly_and_short_tests_are_not_judged():
    stated = history(1e-5, standard_deviation={"strain": 3e-5})
    assert known(stated).sd[0] == pytest.approx(3e-5)
    assert np.isinf(known(stated).freedom).all()
    short = history(1e-5).replace(times=TIMES[:20], outputs={"strain": CURVE[:20]})
    assert not known(short).judged.any()


def test_one_test_has_the_distribution_of_f_and_several_about_the_nominal_chance():
    """Nine tests of 60 white frames, each over its own variance of 12 degrees of freedom; 1 % of 4000 draws."""
    one = KnownNoise(np.ones((1, 60), bool), np.ones((1, 60)), np.full((1, 60), 12.0))
    assert one.chance_of_larger(1.5, 0.9, one.judged) == pytest.approx(f.sf(1.5, 54.0, 12.0))
    assert chance_of_larger(1.5, 54.0, 12.0) == pytest.approx(f.sf(1.5, 54.0, 12.0))
    nine = KnownNoise(np.ones((9, 60), bool), np.ones((9, 60)), np.full((9, 60), 12.0))
    rng = np.random.default_rng(0)
    draws = (rng.chisquare(60, (4000, 9)) / 60 / (rng.chisquare(12, (4000, 9)) / 12)).mean(axis=1)
    alarms = np.mean([nine.chance_of_larger(float(value), 1.0, nine.judged) < 0.01 for value in draws])
    assert alarms < 0.025
