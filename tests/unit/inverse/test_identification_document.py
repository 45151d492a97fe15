"""Identifications as files: noise model, adequacy, numerical error, unmodelled effects and samples come back."""

import json
from dataclasses import replace

import numpy as np
import pytest

from creepkit.errors import FitError
from creepkit.inverse.adequacy import Adequacy, OutputAdequacy
from creepkit.inverse.defect_correction import NumericalError
from creepkit.inverse.identification_document import (
    identification_from_json,
    identification_to_json,
    read_identification,
)
from creepkit.inverse.identify import identify
from creepkit.inverse.largest_deviation import LargestDeviation
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.unmodelled_effect import UnmodelledEffect
from creepkit.laws.norton import NORTON
from helpers.steady_rate_predictor import Steady, planted

ADEQUACY = Adequacy(
    "leaves a discrepancy",
    (OutputAdequacy("strain", 80, 2e-5, "estimated", 3.25, 1e-4, 3e-5),),
    3.25, 78.0, 1e-4, 0.4, LargestDeviation("bar 1", "strain", 5400.0, -4e-5, 2.0), ("thickness", "offset of strain"),
    critical_chi_square=1.5, smallest_p_value=5e-5,
)  # fmt: skip
ERROR = NumericalError("bulge", "bulge on a finer mesh", {"amplitude": 5e-4}, 0.33, 0.2, ("D4",))
EFFECTS = (
    UnmodelledEffect("thickness", 0.01, "mm", 0.08),
    UnmodelledEffect("temperature drift", 5.0, "K over a test", 0.05, -3.1, 0.93, np.ones((2, 40))),
    UnmodelledEffect("temperature", 3.0, "K", -0.14, common=True, tests=2, activation_energy=4e5, assumed=True),
)
NOISE = NoiseModel({"strain": OutputNoise(2e-5, 0.01, 3e-5, 0.02, 0.3, 1.5e-5)}, 0.1, 2.5, 1.7)
SAMPLES = np.random.default_rng(0).normal(size=(400, 2))


@pytest.fixture(scope="module")
def fit():
    tests = planted(NORTON, {"A": 1e-15, "n": 4.0}, [(60.0, 1000.0), (80.0, 1000.0)], seed=1, noise=2e-5)
    settings = IdentificationSettings(starts=1, sobol_points=8, weights="likelihood", nuisances=(), further_laws=3)
    return identify(NORTON, tests, Steady(), settings=settings)


def with_everything(fit):
    """The fit with each new part, whatever its own is."""
    parts = {"adequacy": ADEQUACY, "numerical_error": ERROR, "unmodelled": EFFECTS, "noise_model": NOISE}
    return replace(fit, samples=SAMPLES, problem=None, linearised=None, **parts)


def test_all_parts_come_back_from_a_file(fit, tmp_path):
    whole = with_everything(fit)
    again = read_identification(whole.save(tmp_path / "fit.json"))
    assert again.adequacy == ADEQUACY
    assert str(again.adequacy) == str(ADEQUACY)
    assert again.numerical_error == ERROR
    assert again.noise_model == NOISE
    assert again.settings.further_laws == 3
    np.testing.assert_array_equal(again.samples, SAMPLES)
    assert identification_to_json(again) == identification_to_json(whole)


def test_effects_come_back_but_for_their_residuals(fit):
    again = identification_from_json(identification_to_json(with_everything(fit))).unmodelled
    assert [e.sentence for e in again] == [e.sentence for e in EFFECTS]
    assert np.isnan(again[0].like_hardening)
    assert np.isnan(again[0].hardening_correlation)
    assert (again[1].like_hardening, again[1].hardening_correlation) == (-3.1, 0.93)
    assert all(e.residual_change.size == 0 for e in again)


def test_a_real_identification_comes_back_without_parts_that_it_has_not(fit):
    again = identification_from_json(identification_to_json(fit))
    assert again.adequacy.explains
    assert str(again.adequacy) == str(fit.adequacy)
    assert np.isnan(again.adequacy.correlation)
    assert (again.numerical_error, again.samples) == (None, None)
    bare = identification_from_json(identification_to_json(replace(fit, adequacy=None, unmodelled=())))
    assert bare.adequacy is None
    assert bare.unmodelled == ()


def test_an_adequacy_that_could_not_be_judged_comes_back(fit):
    unknown = Adequacy("cannot be judged", (), np.nan, 0.0, np.nan, np.nan, None)
    again = identification_from_json(identification_to_json(replace(fit, adequacy=unknown)))
    assert again.adequacy.verdict == "cannot be judged"
    assert np.isnan(again.adequacy.p_value)


def test_intervals_from_a_file_come_from_its_samples(fit):
    samples = fit.u + 0.1 * SAMPLES
    again = identification_from_json(identification_to_json(replace(fit, samples=samples)))
    _, low, high = again.interval_of(lambda u: u[..., 1])
    assert (low, high) == pytest.approx(np.quantile(samples[:, 1], (0.025, 0.975)))


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("adequacy", "verdict"), "splendid", "adequacy.verdict"),
        (("adequacy", "outputs", 0, "noise"), 0.0, "adequacy.outputs.0.noise"),
        (("adequacy", "outputs", 0, "noise_source"), "guessed", "adequacy.outputs.0.noise_source"),
        (("adequacy", "remedies"), 3, "adequacy.remedies"),
        (("numerical_error", "noises"), -1.0, "numerical_error.noises"),
        (("unmodelled", 0, "size"), -1.0, "unmodelled.0.size"),
        (("unmodelled", 1, "hardening_correlation"), -0.5, "unmodelled.1.hardening_correlation"),
        (("noise_model", "discrepancy_length"), 0.0, "noise_model.discrepancy_length"),
        (("noise_model", "discrepancy"), -1.0, "noise_model.discrepancy"),
        (("noise_model", "outputs", "strain", "stated"), -1.0, "noise_model.outputs.strain.stated"),
        (("samples",), "many", "samples"),
    ],
)
def test_a_part_that_is_damaged_is_named(fit, path, value, words):
    data = json.loads(json.dumps(identification_to_json(with_everything(fit))))
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(FitError, match=words.replace(".", r"\.")):
        identification_from_json(data)


@pytest.mark.parametrize("samples", [SAMPLES[:, :1], SAMPLES[0], np.zeros((0, 2))])
def test_samples_that_are_not_of_this_law_are_refused(fit, samples):
    data = json.loads(json.dumps(identification_to_json(replace(fit, samples=samples))))
    with pytest.raises(FitError, match="samples"):
        identification_from_json(data)
