"""The command line as a user runs it: from a folder of curves to a law, and one clear sentence when that cannot be."""

import csv
import importlib.util
import json
import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import creepkit as ck
from creepkit.cli import demo
from creepkit.cli.app import app
from creepkit.cli.demo import PLANTED, PLANTED_BULGE
from creepkit.registry import default_registry
from helpers.paths import EXAMPLES
from helpers.written_files import names_in

CURVES = sorted(str(p) for p in PLANTED.glob("*.csv"))


def creepkit(*words):
    return CliRunner().invoke(app, [str(w) for w in words])


def sentence(result):
    """The one line on stderr of a failed command, after whatever progress was told."""
    assert result.exit_code == 1, result.output
    lines = [line for line in result.stderr.strip().splitlines() if not re.search(r": \d+ of \d+$", line)]
    assert len(lines) == 1
    assert lines[0].startswith("creepkit: ")
    return lines[0]


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


def test_identify_leaves_json_plots_latex_and_python(identified):
    folder, answer = identified
    assert sorted(Path(f).name for f in answer["files"]) == names_in(folder)
    assert {Path(name).suffix for name in names_in(folder)} == {".json", ".png", ".tex", ".py"}


def test_identifying_again_replaces_what_was_left(tmp_path):
    words = ("identify", CURVES[0], "--law", "norton", "--starts", 1, "--to", tmp_path)
    for _ in range(2):
        result = creepkit(*words)
        assert result.exit_code == 0, result.output
        assert "norton.py" in result.stdout


def test_saved_identification_reloads_and_predicts(identified):
    folder, _ = identified
    fit = ck.load(folder / "strain-hardening-arrhenius.json")
    again = fit.with_histories(ck.read_histories(CURVES), ck.specimen("uniaxial"))
    assert again.predict().values.shape[1] == len(CURVES)


def test_exported_python_gives_the_identified_rate(identified):
    """The module needs nothing but `math`; its rate is that of the identification at the same point."""
    folder, _ = identified
    fit = ck.load(folder / "strain-hardening-arrhenius.json")
    spec = importlib.util.spec_from_file_location("exported_law", folder / "strain-hardening-arrhenius.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    rate, _, _ = fit.rate(80.0, 1073.15, strain=0.01)
    assert module.rate(80.0, strain=0.01, temperature=1073.15) == pytest.approx(float(rate), rel=1e-6)


def test_simulate_writes_a_curve_that_identify_reads(tmp_path):
    path = tmp_path / "curve.csv"
    result = creepkit(
        "simulate",
        "norton",
        "--set",
        "A=1e-16",
        "--set",
        "n=5",
        "--stress",
        100,
        "--end-h",
        10,
        "--control",
        "stress",
        "--to",
        path,
    )
    assert result.exit_code == 0, result.output
    (history,) = ck.read_histories(path)
    assert history.outputs["strain"][-1] == pytest.approx(1e-16 * 100**5 * 36000, rel=1e-6)


def test_simulate_prints_to_the_terminal():
    result = creepkit(
        "simulate", "norton", "--set", "A=1e-16", "--set", "n=5", "--stress", 100, "--end-h", 1, "--points", 3
    )
    rows = [line for line in result.stdout.splitlines() if not line.startswith("#")]
    assert next(iter(csv.reader(rows))) == ["time_s", "strain_1"]


def test_unknown_law_suggests_the_nearest(tmp_path):
    told = sentence(creepkit("identify", *CURVES, "--law", "nortn", "--to", tmp_path / "none"))
    assert "norton" in told
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("# stress_MPa: 100\n# temperature_C: 800\ntime_s,strain_sd_1\n0,1\n1,1\n", "strain"),
        ("# stress_furlong: 100\n# temperature_C: 800\ntime_s,strain_1\n0,0\n1,1e-4\n", "furlong"),
        ("# stress_MPa: -100\n# temperature_C: 800\ntime_s,strain_1\n0,0\n1,1e-4\n", "stress"),
        ("# stress_MPa: 100\n# temperature_C: 800\ntime_s,strain_1\n0,0\n5,1e-4\n3,2e-4\n", "bad.csv:6"),
        ("# stress_MPa: 100\n# temperature_C: 800\ntime_s,strain_1\n0,0\n1,nan\n", "bad.csv:5"),
        ("# stress_MPa: 100\n# temperature_C: 800\ntime_s,strain_1\n0,0\n", "one"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_sentence_and_nothing_is_written(tmp_path, text, words):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    told = sentence(creepkit("identify", path, "--law", "norton", "--to", tmp_path / "out"))
    assert "bad.csv" in told
    assert words in told
    assert not (tmp_path / "out").exists()


def test_a_law_is_never_evaluated_from_text(tmp_path):
    told = sentence(creepkit("identify", *CURVES, "--law", "__import__('os').getcwd()", "--to", tmp_path / "out"))
    assert "__import__" in told


@pytest.mark.parametrize(
    ("text", "words"),
    [("def broken(:\n", "line 1"), ("raise ValueError('of its own')\n", "of its own"), ("x = 1\n", "hook")],
)
def test_a_broken_plugin_file_is_one_sentence(tmp_path, text, words):
    path = tmp_path / "law_of_mine.py"
    path.write_text(text)
    told = sentence(creepkit("--plugin", path, "laws"))
    assert "law_of_mine.py" in told
    assert words in told


def test_bounds_that_exclude_the_data_are_said(tmp_path):
    plugin = tmp_path / "narrow.py"
    plugin.write_text(
        "from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress\n"
        "A, n = parameters('A n')\n"
        "LAW = CreepLaw(name='narrow', title='Narrow', terms={'t': A * stress**n}, references=('none',), params={\n"
        "    A: Param('rate coefficient', unit='1/s', bounds=(1e-40, 1e-30), scale='log'),\n"
        "    n: Param('stress exponent', bounds=(1, 3))})\n"
        "@hookimpl\n"
        "def creepkit_laws():\n"
        "    return [LAW]\n"
    )
    told = sentence(
        creepkit("--plugin", plugin, "identify", *CURVES, "--law", "narrow", "--starts", 1, "--to", tmp_path / "o")
    )
    assert "bounds exclude the data" in told
    assert not (tmp_path / "o").exists()


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
    assert "decisive: strain-hardening" in simulated
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


def test_demo_runs_without_the_packages_of_further_laws(monkeypatch, capsys):
    """As after `pip install creepkit` alone; tests of the wheels run the whole."""
    registered = default_registry().laws().items()
    own = {name: one.value for name, one in registered if one.provenance.origin.startswith("creepkit ")}
    monkeypatch.setattr(ck, "available", lambda kind: own)
    study = demo._with_installed_laws(demo.MEASURED / "study.toml")
    assert study.model.identification.laws == ["norton"]
    assert study.model.identification.fix == {}
    told = capsys.readouterr().out
    assert "without mpc-omega and kachanov-rabotnov" in told
    assert 'pip install "creepkit[plugins]"' in told


def test_the_virtual_bulge_test_is_what_its_script_makes(tmp_path):
    """To a third of its noise: the solver may change within its tolerance."""
    script = EXAMPLES / "00_make_a_virtual_bulge_test.py"
    runpy.run_path(str(script))["main"](tmp_path)
    (made,), (shipped,) = (ck.read_histories(folder / "virtual_bulge_test.csv") for folder in (tmp_path, PLANTED_BULGE))
    for name, noise in (("amplitude", 1.5e-3), ("width", 0.02), ("shape", 0.02)):
        assert made.outputs[name] == pytest.approx(shipped.outputs[name], abs=noise / 3)
    assert (tmp_path / "truth.json").read_text() == (PLANTED_BULGE / "truth.json").read_text()


def test_demo_of_bars_prints_the_truth_beside_the_answer(tmp_path):
    result = creepkit("demo", "--uniaxial", "--to", tmp_path / "demo")
    assert result.exit_code == 0, result.output
    assert "the truth: strain-hardening" in result.stdout
    assert (tmp_path / "demo" / "report.html").stat().st_size > 20_000
    assert "identification: " in result.stderr or sys.stderr.isatty()


def test_demo_writes_its_data_alone_and_again(tmp_path):
    """Twice into the same folder, but not over a file of somebody else."""
    for _ in range(2):
        result = creepkit("demo", "--data", "--to", tmp_path)
        assert result.exit_code == 0, result.output
    assert sorted(path.name for path in tmp_path.iterdir() if path.name[0] != ".") == ["bulge", "curves", "ruptures"]
    assert len(ck.read_histories(tmp_path / "curves")) == len(ck.read_histories(PLANTED))
    assert not (tmp_path / "curves" / "study.toml").exists()
    (tmp_path / "curves" / "truth.json").write_text("mine")
    assert creepkit("demo", "--data", "--to", tmp_path).exit_code == 1
    assert (tmp_path / "curves" / "truth.json").read_text() == "mine"


def test_a_cut_forgets_how_every_test_ended():
    """A stopped test that never came to the strain of the cut must not be the only one judged by its end."""
    from creepkit.cli.identify import _truncate_at_strain

    times = np.linspace(3600, 36000, 5)
    tests = [
        ck.History(
            name=name,
            times=times,
            outputs={"strain": np.linspace(0.01, end, 5)},
            loading=ck.constant_stress(100),
            temperature=1000.0,
            unruptured=True,
        )
        for name, end in (("far", 0.1), ("near", 0.03))
    ]
    assert [(h.rupture_time, h.unruptured) for h in _truncate_at_strain(tests, 0.05)] == [(None, False)] * 2


def test_laws_are_ranked_by_likelihood_and_further_tests_are_told(tmp_path):
    words = ("--law", "norton", "--law", "hyperbolic-sine", "--further-tests", "--starts", 1, "--no-sums")
    result = creepkit("identify", *CURVES[:3], *words, "--to", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "BIC - best" in result.stdout


def test_a_search_and_a_penalty_are_asked_for_by_name(tmp_path):
    words = ("identify", *CURVES[:2], "--law", "norton", "--starts", 1, "--to", tmp_path / "out")
    assert "allowed are multi-start, swarm, cma-es" in sentence(creepkit(*words, "--search", "genetic"))
    assert "allowed are l2, group-l2, sqrt, subsets" in sentence(creepkit(*words, "--penalty", "lasso"))
    assert "has one term" in sentence(creepkit(*words, "--penalty", "sqrt"))
    told = sentence(creepkit(*words, "--sums", "--loss", "huber"))
    assert "--sums compares laws by their likelihood: leave out --weights, --search, --penalty and --loss" in told
