"""Noise that is known without a law: in proportion to strain or constant, and p-values of several tests."""

import numpy as np
import pytest

from creepkit.inverse.known_noise import KnownNoise
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
