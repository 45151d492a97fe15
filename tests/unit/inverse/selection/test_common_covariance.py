"""Laws under one covariance: what a law makes of its own scatter does not count in its favour."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.selection.discrimination import under_common_covariance
from creepkit.inverse.variance_components import LinearisedProblem

TESTS, ENTRIES = 3, 12


def law(seed, size=1.0, **changes):
    """A law of one parameter that moves every entry alike, its residuals drawn."""
    shape, rng = (TESTS, ENTRIES), np.random.default_rng(seed)
    ones = np.ones(shape)
    values = size * rng.normal(size=shape)
    values -= values.mean()
    clock = np.broadcast_to(np.linspace(0.0, 5.0, ENTRIES), shape)
    r = Residuals(values, ones, ones > 0, clock, ones[..., None], ones, np.zeros(shape, int), ones, np.ones(TESTS))
    free, room = np.ones(1, bool), np.array([[-9.0], [9.0]])
    linear = LinearisedProblem(replace(r, **changes), np.full(1, 1e-9), np.zeros(1), free, room)
    return SimpleNamespace(
        linearised=linear, noise_model=NoiseModel({"strain": OutputNoise(1.0)}, rate=0.5), u=np.zeros(1)
    )


def test_little_trust_in_a_test_does_not_make_a_law_better():
    best, poor = law(0), law(1, size=3.0)
    doubting = law(1, size=3.0, test_weights=np.array([1.0, 0.1, 0.1]))
    found = under_common_covariance([best, poor, doubting])
    assert found.reference_law == 0
    assert found.chi_square[2] == pytest.approx(found.chi_square[1], rel=1e-12)


def test_rates_that_matter_more_to_a_law_do_not_excuse_it():
    best, poor = law(0), law(1, size=3.0)
    excusing = law(1, size=3.0, log_rate_sensitivity=np.full((TESTS, ENTRIES), 20.0))
    found = under_common_covariance([best, poor, excusing])
    assert found.chi_square[2] == pytest.approx(found.chi_square[1], rel=1e-12)


def test_chi_square_between_laws_is_that_of_their_difference_under_the_covariance():
    """One law whose residuals are the other's and one more everywhere but in the mean of all, which is fitted."""
    one, other = law(0), law(0)
    step = np.zeros((TESTS, ENTRIES))
    step[0, :6], step[0, 6:] = 1.0, -1.0
    residuals = replace(other.linearised.residuals, values=other.linearised.residuals.values + step)
    other.linearised = replace(other.linearised, residuals=residuals)
    white = under_common_covariance([one, other]).whitened
    assert ((white[0] - white[1]) ** 2).sum() == pytest.approx(12.0, rel=1e-9)


def test_a_law_that_has_nothing_to_say_of_an_entry_is_compared_by_the_others():
    present = np.ones((TESTS, ENTRIES), bool)
    present[2, -1] = False
    silent = law(1)
    r = silent.linearised.residuals
    blank = {
        name: np.where(present, getattr(r, name), 0.0)
        for name in ("values", "offset_sensitivity", "log_rate_sensitivity")
    }
    residuals = replace(r, present=present, jacobian=present[..., None].astype(float), **blank)
    silent.linearised = replace(silent.linearised, residuals=residuals)
    found = under_common_covariance([law(0), silent])
    assert found.whitened.shape == (2, TESTS * ENTRIES)
    assert found.whitened[1, -1] == 0.0
