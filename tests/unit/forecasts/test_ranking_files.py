"""Files of identifications and rankings from which forecasts are made; and what is refused of them."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
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
