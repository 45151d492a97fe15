"""A specimen in one file of a plugin, from its options on the command line to a law, a forecast and a picture."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from helpers.command_line import creepkit as run_words

PLUGIN = Path(__file__).parents[1] / "helpers" / "cantilever_plugin.py"
TRUTH = ("--set", "A=1e-16", "--set", "n=4")


def creepkit(*words):
    return run_words("--plugin", PLUGIN, *words)


@pytest.fixture
def beams(tmp_path):
    """Five noisy beams of other heights, which their files state."""
    rng = np.random.default_rng(3)
    (tmp_path / "beams").mkdir()
    for k, (force, height) in enumerate(zip((9, 10, 11, 12, 14), 2.0 + 0.02 * rng.standard_normal(5), strict=True)):
        path = tmp_path / "beams" / f"beam{k}.csv"
        words = ("--specimen", "test-cantilever", "--end-force", force, f"--height={height:.4f}", "--points", 20)
        result = creepkit("simulate", "norton", *TRUTH, *words, "--end-h", 100, "--to", path)
        assert result.exit_code == 0, result.output
        (run,) = ck.read_histories(path)
        noisy = run.outputs["end_deflection"] + 0.002 * rng.standard_normal(20)
        sd = {"end_deflection": np.full(20, 0.002)}
        ck.write_history(run.replace(outputs={"end_deflection": noisy}, standard_deviation=sd), path)
    return tmp_path / "beams"


def test_loads_and_lengths_are_keys_and_options_in_their_units(tmp_path):
    ck.load_plugin(PLUGIN)
    path = tmp_path / "own.csv"
    path.write_text(
        "# specimen: test-cantilever\n# temperature_C: 700\n# end_force_kN: 0.011\n# height_mm: 2.02\n"
        "# breadth_m: 0.0101\ntime_h,end_deflection_um\n1,1\n10,20\n100,200\n"
    )
    (test,) = ck.read_histories(path)
    assert (test.specimen, dict(test.geometry)) == ("test-cantilever", {"height": 2.02, "breadth": 10.1})
    assert test.loading == ck.constant_load("end_force", 11.0)
    assert test.outputs["end_deflection"].tolist() == pytest.approx([1e-3, 0.02, 0.2])
    assert test.condition == "700 °C, 11 N"


def test_from_files_to_a_law_a_forecast_and_a_picture(beams, tmp_path):
    result = creepkit(
        "identify", beams, "--law", "norton", "--nuisance", "rate=none", "--weights", "likelihood", "--to", tmp_path
    )
    assert result.exit_code == 0, result.output
    assert "use norton for " in result.output
    fit = ck.load(tmp_path / "norton.json")
    for estimate, truth in zip(fit.estimates, (1e-16, 4.0), strict=True):
        assert estimate.low < truth < estimate.high
    words = ("--end-force", 13, "--height", 2.1, "--end-h", 50, "--temperature-c", 20, "--target", "end_deflection=0.1")
    forecast = creepkit("predict", tmp_path / "norton.json", *words, "--json", "--plot", tmp_path / "band.png")
    assert forecast.exit_code == 0, forecast.output
    assert (tmp_path / "band.png").stat().st_size > 10_000
    assert '"unit": "mm"' in forecast.output
