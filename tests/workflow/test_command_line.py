"""The command line as a user runs it: from a folder of curves to a law, and one clear sentence when that cannot be."""

from __future__ import annotations

import importlib.util
import json
import re
import runpy
import tomllib
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.cli.demo import PLANTED, PLANTED_BULGE
from helpers.command_line import creepkit
from helpers.paths import EXAMPLES, SHARED, needs_shared_data

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
    simulated = result.stdout.split("SIMULATED")[1]
    tests = ck.load(tmp_path / "demo/creep_curves/study.results/identified/ranking.json").best.tests
    assert {one.condition for one in tests} == {f"980 °C, {stress} MPa" for stress in (230, 200, 170, 140)}
    for end in (one.rupture for one in tests):
        assert end.measured < end.predicted if end.censored else end.low < end.measured < end.high
    assert re.search(
        r"\buse strain-hardening for .* on average it fits .*\n.*\n  decisive; weight 1.00 among 3 laws\n", simulated
    )
    assert len(re.findall(r" yes$", simulated.split("the truth: strain-hardening")[1], re.MULTILINE)) == 3
    assert re.search(r"time: \d+ s", simulated)
    assert len(result.stdout.splitlines()) <= 40
    last = result.stdout.splitlines()[-1]
    assert last.startswith("reports: ")
    for path in last.removeprefix("reports: ").split():
        assert Path(path).stat().st_size > 20_000
    again = creepkit("run", path, "--to", tmp_path / "again", "--only", "quality")
    assert again.exit_code == 0, again.output


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
    assert "behind  weight" in result.stdout


# ---- study commands --------------------------------------------------------------------------------------------------

# `creepkit init` and `creepkit run` as a user: a folder of files to a report, and the report to the same numbers.


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three creep curves, and a file that holds no test."""
    folder = tmp_path / "measured"
    folder.mkdir()
    for source in ck.example_data("planted creep curves").glob("*850C*.csv"):
        (folder / source.name).write_bytes(source.read_bytes())
    (folder / "notes.txt").write_text("the furnace was opened on Tuesday\n")
    return folder


def test_a_folder_becomes_a_study_and_its_results(folder: Path, tmp_path: Path) -> None:
    first = creepkit("init", folder)
    assert first.exit_code == 0, first.output
    study = folder / "study.toml"
    text = study.read_text()
    model = tomllib.loads(text)
    suited = ["norton*primary", "hyperbolic-sine*primary", "strain-hardening", "time-hardening"]
    assert model["identification"]["laws"] == suited  # rates of the curves fall, over three stresses or more
    assert "temperature" not in model  # all tests are at one
    assert "# [[forecast]]" in text
    study.write_text(f"{text}\n# edited")
    again = creepkit("init", folder)
    assert again.exit_code == 1
    assert "creepkit did not write it as it is now" in again.output
    assert study.read_text() == f"{text}\n# edited"
    study.write_text(text)

    text = text.partition("[report]")[0]  # the page takes seconds; that of 'creepkit demo' is tested
    study.write_text(text.replace("# starts = 8", "starts = 1\nframes = 15").replace('"hyperbolic-sine*primary", ', ""))
    ran = creepkit("run", study, "--to", tmp_path / "made", "--json")
    assert ran.exit_code == 0, ran.output
    told = json.loads(ran.stdout)
    assert {one["state"] for one in told["stages"]} == {"made"}
    assert {"law.tex", "law.py"} <= {path.name for path in (tmp_path / "made").iterdir()}
    assert len([one for one in folder.iterdir() if one.name[0] != "."]) == 5  # the data, the notes and the study


def study_text(name: str) -> str:
    return (EXAMPLES / "studies" / f"{name}.toml").read_text()


def study_of_public_data(name: str, folder: Path) -> ck.Study:
    """A study of the examples, in a folder of its own."""
    (folder / "data").symlink_to(SHARED, target_is_directory=True)
    (folder / "study.toml").write_text(study_text(name).replace("../../../shared/data", "data"))
    return ck.Study.load(folder / "study.toml")


@needs_shared_data
def test_the_study_of_94_tests_is_valid(tmp_path: Path) -> None:
    """Its checks of the tests take as long as those of all others together, and are part of the benchmark program."""
    assert study_of_public_data("alloy617", tmp_path).file.model.rupture is not None


@needs_shared_data
@pytest.mark.parametrize("name", ["cmsx6", "inconel625"])
def test_the_studies_of_public_data_are_valid_and_their_tests_are_checked(name: str, tmp_path: Path) -> None:
    """Their identifications are a benchmark program, tests/benchmarks/studies.py."""
    data = Path(tomllib.loads(study_text(name))["data"]["files"][0]).relative_to("../../../shared/data")
    result = study_of_public_data(name, tmp_path).run(only="quality")
    assert len(result.measured) == len(
        ck.read_histories(SHARED / data if data.suffix == "" else sorted(SHARED.glob(str(data))))
    )
    assert result.quality is not None


@needs_shared_data
def test_studies_of_public_folders_are_proposed_and_valid(tmp_path: Path) -> None:
    proposed = {"uniaxial/cmsx6": "kachanov-rabotnov", "uniaxial/alloy617": "mpc-omega", "dabi/in625": "norton"}
    for name, laws in proposed.items():
        target = tmp_path / Path(name).name / "study.toml"
        target.parent.mkdir()
        (tmp_path / Path(name).name / "data").symlink_to(SHARED / name, target_is_directory=True)
        ran = creepkit("init", target.parent / "data", "--to", target)
        assert ran.exit_code == 0, ran.output
        assert laws in tomllib.loads(target.read_text())["identification"]["laws"]
        ck.Study.load(target)
