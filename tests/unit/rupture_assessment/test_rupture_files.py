"""Assessments as text, picture and file, and the command `creepkit rupture`."""

import json

import pytest

import creepkit as ck
from creepkit.errors import FitError
from helpers.command_line import creepkit
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


def test_command_answers_as_python(tests, tmp_path):
    for test in tests:
        ck.write_history(_with_frames(test), tmp_path / f"{test.name}.csv")
    words = ["--method", "larson-miller", "--degrees", "2", "--times", "1e3h,500d", "--temperature-c", "600,650"]
    files = ["--to", str(tmp_path / "a.json"), "--plot", str(tmp_path / "a.png"), "--json"]
    result = creepkit("rupture", str(tmp_path / "*.csv"), *words, *files)
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    read = ck.read_histories(str(tmp_path / "*.csv"))
    expected = ck.rupture(
        read,
        "larson-miller",
        hours=[1e3, 12e3],
        temperatures=[873.15, 923.15],
        settings=ck.RuptureSettings(degrees=(2,)),
    )
    assert (answer["tests"], answer["run_outs"]) == (27, int(expected.tests.censored.sum()))
    for one, other in zip(answer["strengths"], expected.strengths, strict=True):
        assert one["strength"] == pytest.approx(other.value)
        assert one["hours"] == other.hours
    assert (tmp_path / "a.png").is_file()
    assert ck.load_rupture_assessment(tmp_path / "a.json").best.method == "larson-miller"


def _with_frames(test):
    """The same test with strains at half its time and at its end."""
    end = {"rupture_time": test.rupture_time} if test.rupture_time else {"unruptured": True}
    last = test.times[-1]
    return test.replace(times=[0.5 * last, last], outputs={"strain": [0.01, 0.1]}, **end)
