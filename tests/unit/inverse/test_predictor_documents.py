"""An identification from a file knows what predicted its tests, with changed settings, or says why it does not."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.identification_document import identification_from_json, identification_to_json
from creepkit.inverse.identify import identify
from creepkit.inverse.predictor_documents import missing_predictor, predictor_documents, predictor_from_documents
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from helpers.planted_alloys import bars
from helpers.steady_rate_predictor import Steady, planted

BAR = ck.specimen("uniaxial").replace(strain_limit=0.7, max_steps=5000)
TESTS = bars("X")


@dataclass(frozen=True)
class Foreign(ck.Predictor):
    """A predictor that no plugin registers."""

    name: str = "foreign"

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        return BAR.predict(law, theta, histories, nuisances=nuisances, sensitivities=sensitivities)


@pytest.fixture(scope="module")
def fit():
    return ck.identify("norton", TESTS, using=BAR, starts=2)


@pytest.fixture(scope="module")
def document(fit):
    return json.loads(json.dumps(identification_to_json(fit)))


def test_several_specimens_come_back_each_with_its_settings(fit):
    several = replace(fit, predictor=CompositePredictor({"uniaxial": BAR, "relaxation": ck.specimen("relaxation")}))
    back = identification_from_json(json.loads(json.dumps(identification_to_json(several))))

    assert back.predictor == several.predictor


def test_a_specimen_of_a_missing_plugin_is_said_in_one_sentence_and_kept(document, tmp_path):
    changed = {**document, "predictor_documents": {"": {"kind": "specimen", "name": "torsion-tube", "fields": {}}}}
    back = identification_from_json(changed)

    assert back.values["n"] > 1
    for ask in (lambda: back.predict(TESTS), lambda: back.with_histories(TESTS), lambda: back.rupture_time(80.0)):
        with pytest.raises(FitError, match="with specimen 'torsion-tube', which is not known here: install"):
            ask()
    np.testing.assert_array_equal(back.with_histories(TESTS, BAR).predict().values, back.predict(TESTS, BAR).values)
    assert ck.load(back.save(tmp_path / "fit.json")).predictor_documents == back.predictor_documents


def test_a_predictor_that_no_file_holds_is_named(fit, tmp_path):
    back = ck.load(replace(fit, predictor=Foreign()).save(tmp_path / "fit.json"))

    with pytest.raises(FitError, match="made with 'foreign', which a file cannot hold: give using="):
        back.predict(TESTS)
    assert back.predict(TESTS, Foreign()).values.shape[1] == len(TESTS)


def test_a_reduced_order_model_is_found_again_with_the_fields_of_its_specimen():
    dimple = ck.surrogate("dimple")
    coarse = dimple.specimen.replace(refinement=0.5).reduced_order_model()
    for model in (dimple, coarse):
        documents = predictor_documents(model)
        assert documents[""].kind == "reduced-order model"
        assert predictor_from_documents(documents) == model

    gone = {"": replace(documents[""], name="torsion-tube")}
    assert predictor_from_documents(gone) is None
    assert "made with specimen 'torsion-tube', which is not known here" in missing_predictor(gone)


# ---- identification document -----------------------------------------------------------------------------------------

# Identifications as files: noise model, adequacy, numerical error, unmodelled effects and samples come back.


SAMPLES = np.random.default_rng(0).normal(size=(400, 2))


@pytest.fixture(scope="module")
def fit_of_the_file():
    tests = planted(NORTON, {"A": 1e-15, "n": 4.0}, [(60.0, 1000.0), (80.0, 1000.0)], seed=1, noise=2e-5)
    settings = IdentificationSettings(
        starts=1, sobol_points=8, weights="likelihood", nuisances=(), further_laws=3, usual_errors="none"
    )
    return identify(NORTON, tests, Steady(), settings=settings)


def test_intervals_from_a_file_come_from_its_samples(fit_of_the_file):
    samples = fit_of_the_file.u + 0.1 * SAMPLES
    again = identification_from_json(identification_to_json(replace(fit_of_the_file, samples=samples)))
    _, low, high = again.interval_of(lambda u: u[..., 1])
    assert (low, high) == pytest.approx(np.quantile(samples[:, 1], (0.025, 0.975)))
