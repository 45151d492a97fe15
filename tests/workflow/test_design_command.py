"""`creepkit design` as a user runs it: from saved identifications and their tests to the next test."""

import json

import pytest
from typer.testing import CliRunner

import creepkit as ck
from creepkit.cli.app import app
from creepkit.cli.demo import PLANTED

CURVES = sorted(str(p) for p in PLANTED.glob("*.csv"))[:3]


def creepkit(*words):
    return CliRunner().invoke(app, [str(w) for w in words])


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    path = tmp_path_factory.mktemp("design") / "fit.json"
    ck.identify("norton", ck.read_histories(CURVES), starts=2).save(path)
    return path


def with_tests(*words):
    return (*words, *(word for curve in CURVES for word in ("--tests", curve)))


def test_the_next_test_is_told_as_text_json_and_a_map(saved, tmp_path):
    result = creepkit("design", saved, *with_tests("--goal", "rate:60", "--plot", tmp_path / "map.png"))
    assert result.exit_code == 0, result.output
    assert "brings the standard deviation of the rate at 60 MPa from" in result.stdout
    assert (tmp_path / "map.png").stat().st_size > 1000
    told = creepkit("design", saved, *with_tests("--goal", "rate:60", "--json"))
    answer = json.loads(told.stdout)
    fit = ck.load(saved).with_histories(ck.read_histories(CURVES))
    assert answer["advice"] == ck.design(fit, goal=ck.rate_at(60.0)).sentence


def test_what_the_rig_can_do_is_said_by_options(saved):
    words = ("--goal", "parameters", "--levels", "50:60", "--longest", 300, "--setup-hours", 2, "--budget", 102)
    answer = json.loads(creepkit("design", saved, *with_tests(*words, "--json")).stdout)
    levels = [v for test in answer["tests"] for one in test["tests"] for v in one["loading"]["values"]]
    assert (min(levels), max(levels)) == (50.0, 60.0)
    assert max(test["oven_hours"] for test in answer["tests"]) == pytest.approx(102.0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--goal", "rats"), "--goal rats is not known; write law, parameters, rate:60"),
        (("--levels", "4"), "--levels 4 is not known; write --levels 4:14"),
        (("--budget", "0"), "--budget 0: allowed are numbers from 1e-09 to 1000000000"),
        (("--dimension", "x=wide"), "--dimension x wide is not known"),
    ],
)
def test_what_is_not_understood_is_one_sentence(saved, words, told):
    result = creepkit("design", saved, *with_tests(*words))
    assert result.exit_code == 1
    assert told in result.stderr


def test_tests_of_another_law_are_refused(saved):
    result = creepkit("design", saved, "--tests", CURVES[0])
    assert result.exit_code == 1
    assert "which is not among the histories given" in result.stderr
