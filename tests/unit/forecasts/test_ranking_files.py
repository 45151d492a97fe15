"""Files of identifications and rankings from which forecasts are made; and what is refused of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.ranking_document import read_fit_or_ranking, write_ranking_document
from creepkit.inverse.selection.ranking import ranking_from_scores
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from helpers.rupture_tests import BAR


@pytest.fixture(scope="module")
def fit():
    times, rng = np.geomspace(3.6e3, 3.6e5, 20), np.random.default_rng(3)
    tests = [
        ck.History(
            f"bar {s:g}", times, {"strain": 1e-18 * s**5 * times + rng.normal(0.0, 2e-6, 20)},
            ck.constant_stress(s, "stress"), 1073.15,
        )
        for s in (80.0, 100.0, 120.0)
    ]  # fmt: skip
    return ck.identify("norton", tests, using=BAR, starts=1, nuisances=[ck.Nuisance("rate", sd=0.1)])


def test_a_ranking_has_a_file(fit, tmp_path):
    fit.save(tmp_path / "norton.json")
    write_ranking_document({"norton.json": 1.0}, tmp_path / "ranking.json")
    source = read_fit_or_ranking(tmp_path / "ranking.json")
    assert isinstance(source, ModelAverage)
    assert source.fits[0].values == fit.values


def test_a_ranking_saves_its_laws_beside_itself(fit, tmp_path):
    other = replace(fit, law=replace(fit.law, name="ranking"))  # a law of the name of the file itself
    ranking = ranking_from_scores([fit, other], np.array([0.0, 2.0]), "bic", independent_frames=60.0)
    path = ranking.save(tmp_path / "ranking.json")
    assert path == tmp_path / "ranking.json"
    found = ck.load_ranking(path)
    assert [one.law.name for one in found.fits] == ["norton", "ranking"]
    weight = 1.0 / (1.0 + np.exp(-1.0))  # of a law whose criterion is lower by 2
    assert found.weights == pytest.approx([weight, 1.0 - weight])
    assert {file.name for file in tmp_path.glob("[!.]*")} == {"ranking.json", "norton.json", "ranking-2.json"}


@pytest.mark.parametrize(
    ("laws", "sentence"),
    [
        ([], "laws is no list of 1 to 100 laws"),
        ([{"file": "ranking.json", "weight": 1.0}], "it is a name in the same folder"),
        ([{"file": "../norton.json", "weight": 1.0}], "it is a name in the same folder"),
        ([{"file": "norton.json", "weight": 2.0}], "it is a number from 0 to 1"),
        ([{"file": "norton.json"}], "each of its laws is a file and a weight"),
        ([{"file": "absent.json", "weight": 1.0}], "absent.json"),
    ],
)
def test_other_files_of_rankings_are_refused(laws, sentence, tmp_path):
    path = tmp_path / "ranking.json"
    path.write_text(json.dumps({"format": "creepkit-ranking", "version": 1, "laws": laws}))
    with pytest.raises(FitError, match=sentence):
        read_fit_or_ranking(path)


def test_weights_of_a_ranking_that_add_up_to_more_than_one_are_refused(fit, tmp_path):
    for name in ("a.json", "b.json"):
        fit.save(tmp_path / name)
    path = write_ranking_document({"a.json": 0.9, "b.json": 0.9}, tmp_path / "ranking.json")
    with pytest.raises(FitError, match=r"the weights add up to 1\.8, more than 1"):
        read_fit_or_ranking(path)


def test_values_and_coordinates_of_a_file_that_contradict_each_other_are_refused(fit, tmp_path):
    path = fit.save(tmp_path / "fit.json")
    content = json.loads(path.read_text())
    content["u"][0] += 2.0
    path.write_text(json.dumps(content))
    with pytest.raises(FitError, match="contradict each other"):
        read_fit_or_ranking(path)
