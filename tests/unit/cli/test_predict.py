"""creepkit predict: measured and planned tests on the command line."""

import json

import pytest

import creepkit as ck
from helpers.command_line import answers, creepkit, one_line


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("predict")
    data = ck.example_data("planted creep curves")
    result = creepkit(f"identify {data} --law strain-hardening --law norton --starts 1 --to {folder / 'fits'}")
    assert result.exit_code == 0, result.output
    return folder / "fits", data


def test_a_planned_bar_is_forecast_as_in_python(saved):
    folder, _ = saved
    fit = folder / "strain-hardening-arrhenius.json"
    result = creepkit(f"predict {fit} --stress 75 --temperature-c 820 --end-h 200 --json")
    assert result.exit_code == 0, result.output
    (test,) = json.loads(result.stdout)["tests"]
    fit = ck.load(folder / "strain-hardening-arrhenius.json")
    plan = ck.History("plan", [72e4], {}, ck.constant_stress(75.0, "load"), 1093.15)
    value = fit.forecast(plan).tests[0].outputs["strain"].value[-1]
    assert test["outputs"]["strain"]["value"][-1] == pytest.approx(value, rel=1e-4)
    (time,) = test["times"]
    assert time["low"] < time["value"] < time["high"]


def test_measured_tests_are_compared_and_drawn(saved, tmp_path):
    folder, data = saved
    picture = tmp_path / "forecast.png"
    result = creepkit("predict", folder / "ranking.json", data / "planted_850C_70MPa.csv", "--plot", picture)
    assert result.exit_code == 0, result.output
    assert "of the frames in the band" in result.stdout
    assert picture.stat().st_size > 10_000


def test_targets_of_a_dimple(saved):
    folder, _ = saved
    words = "--pressure 8 --end-h 0.5 --temperature-c 850 --modulus-gpa 150 --target amplitude=0.05,0.06"
    result = creepkit(f"predict {folder / 'ranking.json'} {words}")
    assert result.exit_code == 0, result.output
    assert "amplitude 0.05 mm:" in result.stdout
    assert "amplitude 0.06 mm:" in result.stdout


WRONG = {
    "": "there is no test to forecast",
    "--stress 80": "--stress describes a planned test, which needs an end",
    "--stress 80 --end-h 100": "the fitted tests were made at 750 to 850 °C: give --temperature-c",
    "--pressure 8 --end-h 1 --temperature-c 800": "'bulge' needs a modulus",
    "--stress 80 --end-h 1 --temperature-c 800 --target strain=x": "write NAME=NUMBER,..., such as strain=0.01,0.05",
    "--stress 80 --end-h 1 --temperature-c 800 --level 2": "--level is 2.0; allowed are numbers from 0.5 to 0.999999",
    "--stress 80 --end-h -1 --temperature-c 800": "--end-h is -1.0; allowed are numbers from 1e-09 to 1000000000",
    "--stress 80 --end-h 1 --temperature-c 800 --plot x.txt": "is no format of pictures",
}


def test_what_is_wrong_is_said_in_one_line(saved):
    fit = saved[0] / "strain-hardening-arrhenius.json"
    assert answers((f"predict {fit} {words}", said) for words, said in WRONG.items()) == []


def test_a_file_of_something_else_is_refused(tmp_path):
    (tmp_path / "x.json").write_text("{}")
    said = one_line(creepkit(f"predict {tmp_path / 'x.json'} --stress 80 --end-h 1"))
    assert "this is not an identification" in said
