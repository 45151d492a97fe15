"""Mixtures over laws against closed forms."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from creepkit.inverse.uncertainty.model_averaging import MixtureDistribution, ModelAverage
from creepkit.laws.norton import NORTON
from helpers.log_rate_predictor import known_scatter, measured

TRUTH = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
SD = 0.2
R = 8.314462618


def parts(weight, middle, sd, freedom=1e9):
    columns = (np.array(v, float) for v in (weight, np.full(len(weight), freedom), middle, sd))
    weight, freedom, middle, sd = columns
    return MixtureDistribution(weight, freedom, middle, sd)


def test_one_part_has_its_own_quantiles():
    for freedom in (1e9, 3.0):
        found = parts([1.0], [2.0], [0.5], freedom)
        for p in (0.025, 0.5, 0.9):
            assert float(found.quantile(p)) == pytest.approx(2.0 + 0.5 * student.ppf(p, freedom), abs=1e-9)


def test_two_parts_far_apart():
    """The lower tail of the mixture is that of the lower part alone, at its share: P(x < q) = w F(q)."""
    found = parts([0.4, 0.6], [0.0, 100.0], [1.0, 2.0])
    assert float(found.quantile(0.025)) == pytest.approx(norm.ppf(0.025 / 0.4), abs=1e-7)
    assert float(found.quantile(0.975)) == pytest.approx(100.0 + 2.0 * norm.ppf((0.975 - 0.4) / 0.6), abs=1e-7)


def test_quantiles_invert_the_distribution():
    found = parts([0.2, 0.5, 0.3], [[0.0, 5.0], [1.0, 4.0], [3.0, 4.5]], [[1.0, 0.1], [0.5, 2.0], [2.0, 1.0]], 5.0)
    for p in (0.025, 0.3, 0.975):
        assert found.cumulative(found.quantile(p)) == pytest.approx([p, p], abs=1e-12)


@pytest.fixture(scope="module")
def fit():
    return known_scatter(NORTON, measured(NORTON, TRUTH, (30.0, 50.0, 80.0), sd=SD, seed=3), SD)


def test_a_mixture_of_one_law_is_that_law(fit):
    for stress in (40.0, [30.0, 90.0]):
        assert ModelAverage.from_ranking(fit).rate(stress, warn=False) == pytest.approx(
            np.array(fit.rate(stress, warn=False)), rel=1e-8
        )
        assert ModelAverage.from_ranking(fit).local_exponent(stress, warn=False) == pytest.approx(
            np.array(fit.local_exponent(stress, warn=False)), rel=1e-6
        )


def test_two_laws_that_disagree_widen_the_interval(fit):
    """The same law at n + 3: at the reference stress both agree, and half of the belief each lies 3 apart in n."""
    other = replace(fit, u=fit.u + np.array([0.0, 3.0]))
    mixture = ModelAverage((fit, other), (1.0, 1.0))
    sd = float(np.sqrt(fit.covariance[1, 1]))
    _, low, high = mixture.local_exponent(60.0)
    assert float(low) == pytest.approx(fit.u[1] + sd * norm.ppf(0.05), abs=1e-4)
    assert float(high) == pytest.approx(fit.u[1] + 3.0 + sd * norm.ppf(0.95), abs=1e-4)
    r = fit.reference.stress
    assert mixture.rate(r) == pytest.approx(np.array(fit.rate(r)), rel=1e-6)
    assert "norton (0.5), norton (0.5)" in str(mixture)


def test_a_ranking_is_a_mixture_of_its_laws(fit):
    other = replace(fit, u=fit.u + np.array([0.0, 3.0]))
    weighed = [SimpleNamespace(fit=fit, weight=0.75), SimpleNamespace(fit=other, weight=0.25)]
    ranking = SimpleNamespace(laws=[*weighed, SimpleNamespace(fit=None, weight=0.0)])
    found = ModelAverage.from_ranking(ranking)
    assert found.weights == (0.75, 0.25)
    sd = float(np.sqrt(fit.covariance[1, 1]))
    assert float(found.local_exponent(60.0)[1]) == pytest.approx(fit.u[1] + sd * norm.ppf(0.025 / 0.75), abs=1e-4)
