"""Identifications as files: noise model, adequacy, numerical error, unmodelled effects and samples come back."""

from dataclasses import replace

import numpy as np
import pytest

from creepkit.inverse.identification_document import identification_from_json, identification_to_json
from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from helpers.steady_rate_predictor import Steady, planted

SAMPLES = np.random.default_rng(0).normal(size=(400, 2))


@pytest.fixture(scope="module")
def fit():
    tests = planted(NORTON, {"A": 1e-15, "n": 4.0}, [(60.0, 1000.0), (80.0, 1000.0)], seed=1, noise=2e-5)
    settings = IdentificationSettings(
        starts=1, sobol_points=8, weights="likelihood", nuisances=(), further_laws=3, usual_errors="none"
    )
    return identify(NORTON, tests, Steady(), settings=settings)


def test_intervals_from_a_file_come_from_its_samples(fit):
    samples = fit.u + 0.1 * SAMPLES
    again = identification_from_json(identification_to_json(replace(fit, samples=samples)))
    _, low, high = again.interval_of(lambda u: u[..., 1])
    assert (low, high) == pytest.approx(np.quantile(samples[:, 1], (0.025, 0.975)))
