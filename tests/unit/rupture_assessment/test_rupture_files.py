"""Assessments as text, picture and file, and the command `creepkit rupture`."""

import json

import pytest

import creepkit as ck
from creepkit.errors import FitError
from helpers.planted_rupture import TENSILE, larson_miller, planted

SETTINGS = ck.RuptureSettings(degrees=(1,))


@pytest.fixture(scope="module")
def tests():
    return planted(larson_miller, count=27, heats=4, end=3000.0)


@pytest.fixture(scope="module")
def assessment(tests):
    return ck.rupture(tests, temperatures=[873.15], tensile_strength=TENSILE, settings=SETTINGS)


def test_a_file_gives_the_same_assessment(assessment, tmp_path):
    path = assessment.save(tmp_path / "rupture.json")
    read = ck.load_rupture_assessment(path)
    assert str(read) == str(assessment)
    assert read.strength(860.0, hours=2e4) == assessment.strength(860.0, hours=2e4)
    assert read.provenance["data"] == assessment.tests.fingerprint
    data = json.loads(path.read_text())
    data["ranked"][0]["fit"]["covariance"] = [[1.0]]
    path.write_text(json.dumps(data))
    with pytest.raises(FitError, match="does not belong to its"):
        ck.load_rupture_assessment(path)
    data["ranked"] = []
    path.write_text(json.dumps(data))
    with pytest.raises(FitError, match="no method is ranked"):
        ck.load_rupture_assessment(path)
