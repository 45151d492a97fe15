"""`creepkit init` and `creepkit run` as a user: a folder of files to a report, and the report to the same numbers."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

import creepkit as ck
from helpers.command_line import creepkit
from helpers.paths import EXAMPLES, SHARED, needs_shared_data


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
    assert {"study.lock", "law.tex", "law.py"} <= {path.name for path in (tmp_path / "made").iterdir()}
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
