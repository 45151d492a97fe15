"""The command line as a user runs it: from a folder of curves to a law, and one clear sentence when that cannot be."""

import importlib.util
import json
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.cli.demo import PLANTED, PLANTED_BULGE
from helpers.command_line import creepkit
from helpers.paths import EXAMPLES

CURVES = sorted(str(p) for p in PLANTED.glob("*.csv"))


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    folder = tmp_path_factory.mktemp("identified")
    laws = ("--law", "strain-hardening", "--law", "norton")
    result = creepkit("identify", *CURVES, *laws, "--to", folder, "--starts", 2, "--json")
    assert result.exit_code == 0, result.output
    return folder, json.loads(result.stdout)


def test_identify_finds_the_planted_law_and_its_values(identified):
    _, answer = identified
    truth = json.loads((PLANTED / "truth.json").read_text())
    assert answer["verdict"].startswith("decisive: strain-hardening*arrhenius, of ")
    best = answer["laws"][0]["parameters"]
    assert all(best[name]["low"] <= value <= best[name]["high"] for name, value in truth["values"].items())


def test_exported_python_gives_the_identified_rate(identified):
    """The module needs nothing but `math`; its rate is that of the identification at the same point."""
    folder, _ = identified
    fit = ck.load(folder / "strain-hardening-arrhenius.json")
    spec = importlib.util.spec_from_file_location("exported_law", folder / "strain-hardening-arrhenius.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    rate, _, _ = fit.rate(80.0, 1073.15, strain=0.01)
    assert module.rate(80.0, strain=0.01, temperature=1073.15) == pytest.approx(float(rate), rel=1e-6)


def test_demo_identifies_measured_curves_then_the_law_of_a_virtual_bulge_test(tmp_path):
    result = creepkit("demo", "--to", tmp_path / "demo")
    assert result.exit_code == 0, result.output
    measured, simulated = result.stdout.split("SIMULATED")
    rupture = re.findall(r"980 °C, (\d+) MPa +(\S.*?)  +(\d+) +(\d+) to (\d+)", measured)
    assert [int(row[0]) for row in rupture] == [230, 200, 170, 140]
    for _, times, predicted, low, high in rupture:
        for time in times.split(", "):
            broke = time.removeprefix("> ")
            assert float(low) < float(broke) < float(high) if broke == time else float(broke) < float(predicted)
    assert "decisive; weights: strain-hardening 1.00" in simulated
    assert len(re.findall(r" yes$", simulated.split("the truth: strain-hardening")[1], re.MULTILINE)) == 3
    assert re.search(r"time: \d+ s", simulated)
    assert len(result.stdout.splitlines()) <= 40
    last = result.stdout.splitlines()[-1]
    assert last.startswith("reports: ")
    for path in last.removeprefix("reports: ").split():
        assert Path(path).stat().st_size > 20_000
    again = creepkit("run", path, "--to", tmp_path / "again", "--only", "quality")
    assert again.exit_code == 0, again.output
    assert "all numbers are those of" in again.stdout


def test_the_virtual_bulge_test_is_what_its_script_makes(tmp_path):
    """To a third of its noise: the solver may change within its tolerance."""
    script = EXAMPLES / "00_make_a_virtual_bulge_test.py"
    runpy.run_path(str(script))["main"](tmp_path)
    (made,), (shipped,) = (ck.read_histories(folder / "virtual_bulge_test.csv") for folder in (tmp_path, PLANTED_BULGE))
    for name, noise in (("amplitude", 1.5e-3), ("width", 0.02), ("shape", 0.02)):
        assert made.outputs[name] == pytest.approx(shipped.outputs[name], abs=noise / 3)
    assert (tmp_path / "truth.json").read_text() == (PLANTED_BULGE / "truth.json").read_text()


def test_a_cut_forgets_how_every_test_ended():
    """A stopped test that never came to the strain of the cut must not be the only one judged by its end."""
    from creepkit.cli.identify import _truncate_at_strain

    times = np.linspace(3600, 36000, 5)
    curves = {name: {"strain": np.linspace(0.01, end, 5)} for name, end in (("far", 0.1), ("near", 0.03))}
    tests = [
        ck.History(name, times, outputs, ck.constant_stress(100), 1000.0, unruptured=True)
        for name, outputs in curves.items()
    ]
    assert [(h.rupture_time, h.unruptured) for h in _truncate_at_strain(tests, 0.05)] == [(None, False)] * 2


def test_laws_are_ranked_by_likelihood_and_further_tests_are_told(tmp_path):
    words = ("--law", "norton", "--law", "hyperbolic-sine", "--further-tests", "--starts", 1, "--no-sums")
    result = creepkit("identify", *CURVES[:3], *words, "--to", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "BIC - best" in result.stdout
