"""Cameras of a study file, found wrong before a frame is read; planned forecasts; what a report alone shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import StudyError
from creepkit.studies.proposal import propose_study
from creepkit.studies.study_file import parse_study
from helpers.camera_samples import vic_3d
from helpers.instrument_samples import plate_record
from helpers.paths import ROOT

CAMERA = """\
[[record]]
name = "rig"
file = "record.csv"

[[camera]]
name = "plate"
frames = "frames"
record = "rig"
interval_s = 10
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three frames and a record beside them."""
    (tmp_path / "frames").mkdir()
    for k in range(3):
        (tmp_path / "frames" / f"plate-{k:03d}_0.csv").write_bytes(vic_3d())
    (tmp_path / "frames" / "notes.txt").write_text("of no use")
    (tmp_path / "record.csv").write_text(plate_record())
    (tmp_path / "times.csv").write_text("time\n1\n2\n3\n")
    return tmp_path


def loaded(folder: Path, text: str) -> ck.Study:
    (folder / "study.toml").write_text(text)
    return ck.Study.load(folder / "study.toml")


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ('record = "rig"', 'record = "rog"', 8, "there is no record 'rog'; did you mean 'rig'?"),
        ('record = "rig"', "load = { pressure_bar = 5 }\ntemperature_C = 700", 2, "no [[camera]] says record = 'rig'"),
        ('frames = "frames"', 'frames = "films"', 7, "there is no file or folder 'films'"),
        ('file = "record.csv"', 'file = "rec*.txt"', 3, "there is no file or folder 'rec*.txt'"),
        ("interval_s = 10", 'interval_s = 10\ntimes = "times.csv"', 9, "interval_s: contradicts times"),
        ("interval_s = 10", 'format = "vic-4d"', 9, "there is no format 'vic-4d'; did you mean 'vic-3d'?"),
        ("interval_s = 10", 'specimen = "uniaxial"', 9, "does not say how cameras see its surface"),
        ("interval_s = 10", 'rest_frames = "9-3"', 9, "rest is 9-3: write the first and the last"),
        ("interval_s = 10", 'camera_start = "yesterday"', 9, "'yesterday' is not known"),
        ("interval_s = 10", 'camera_start = "2025-08-18T18:51:53"', 9, "is not known"),
        ("interval_s = 10", "load = { pressure_bar = 5 }", 9, "contradicts record"),
        ("interval_s = 10", 'names = ["A", "A"]', 9, "stand there twice"),
        ("interval_s = 10", "lag_s = 3\nsearch_s = [-1, 1]", 10, "contradicts lag_s"),
        ("interval_s = 10", "channels = []", 9, "needs 1 or more entries"),
        ("interval_s = 10", 'infrared = { images = "frames" }', 9, "infrared has no 'center_mm'"),
        ("interval_s = 10", "thermocouples_mm = { T1 = [1] }", 9, "needs 2 or more entries"),
        ("interval_s = 10", "lengths = { apex_thicknes_mm = 0.5 }", 9, "did you mean 'apex_thickness_mm'?"),
        ("interval_s = 10", 'labels = { heat = "7" }\nlagg_s = 3', 10, "did you mean 'lag_s'?"),
    ],
)
def test_a_mistake_is_one_sentence_with_its_line(folder: Path, old: str, new: str, line: int, words: str) -> None:
    with pytest.raises(StudyError) as caught:
        loaded(folder, CAMERA.replace(old, new, 1) if old != 'record = "rig"' else CAMERA.replace(old, new))
    text = str(caught.value)
    assert words in text.replace('"', "'")
    assert "\n" not in text
    assert f"study.toml:{line}:" in text


def test_only_frames_are_inputs_and_a_folder_that_holds_none_is_refused(folder: Path) -> None:
    study = loaded(folder, CAMERA)
    (camera,) = study.cameras
    assert [path.name for path in camera.files[0]] == [f"plate-{k:03d}_0.csv" for k in range(3)]
    (folder / "empty").mkdir()
    with pytest.raises(StudyError, match="has no files of frames"):
        loaded(folder, CAMERA.replace('"frames"', '"empty"'))


def test_a_camera_that_fails_leaves_the_tests_of_files(folder: Path) -> None:
    """49 points cannot hold a clamped plate; the curve of the file is identified all the same."""
    (path,) = ck.example_data("planted creep curves").glob("*850C_70MPa*.csv")
    (folder / path.name).write_bytes(path.read_bytes())
    text = CAMERA + f'[data]\nfiles = ["{path.name}"]\n[[exclude]]\ntest = "plate D1"\nreason = "of the camera"\n'
    result = loaded(folder, text).run()
    assert {one.name: one.state for one in result.stages} == {
        "extraction of plate": "failed",
        "record of plate": "failed",
        "quality": "made",
    }
    assert len(result.histories) == 1


CURVES = """\
[data]
files = ["*.csv"]
[identification]
laws = ["norton"]
starts = 1
frames = 8
temperature = "none"
[[forecast]]
name = "combined"
load = { stress_11_MPa = 30, stress_12_MPa = [{ from_h = 5, level = 10 }] }
end_h = 10
draws = 50
[[forecast]]
name = "bolt"
specimen = "relaxation"
load = { strain = 0.002 }
modulus_GPa = 150
end_h = 10
draws = 50
"""


@pytest.fixture
def curves(tmp_path: Path) -> Path:
    for path in ck.example_data("planted creep curves").glob("*850C*.csv"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


def test_points_under_several_components_and_bars_under_strain_are_forecast(curves: Path) -> None:
    result = loaded(curves, CURVES).run()
    assert result.failures == ()
    fit = result.rankings[""].best
    point = result.forecasts["combined"].tests[0].outputs
    A, n = fit.values["A"], fit.values["n"]
    tension, both = A * 30.0**n, A * (30.0**2 + 3.0 * 10.0**2) ** (n / 2)  # Norton's law of the von Mises stress
    assert point["strain"].value[-1] == pytest.approx(18000 * (tension + both), rel=1e-3)
    stress = result.forecasts["bolt"].tests[0].outputs["stress"].value[-1]
    held = 150e3 * 0.002  # integral of d(stress)/dt = -E A stress^n
    assert stress == pytest.approx((held ** (1 - n) + (n - 1) * 150e3 * A * 36000) ** (1 / (1 - n)), rel=1e-2)
    assert {one.state for one in loaded(curves, CURVES).run().stages} == {"kept"}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("stress_11_MPa = 30", "stress_44_MPa = 30", "no unit of 'stress' that is known"),
        ("stress_11_MPa = 30", "strain_12 = 0", "component 12 has both"),
        ("strain = 0.002", "strain = 0.002, stress_MPa = 3", "has one load, found strain and stress_MPa"),
        ("modulus_GPa = 150", "", "needs modulus_GPa"),
        ("stress_11_MPa = 30", "strain_11 = 0.001", "needs modulus_GPa"),
        ("load = { strain = 0.002 }", "load = {}", "a planned test has a load"),
    ],
)
def test_loads_that_no_test_can_have(curves: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(StudyError, match=words):
        loaded(curves, CURVES.replace(old, new, 1))


def test_a_report_alone_says_which_results_it_shows(curves: Path) -> None:
    text = CURVES.partition("[[forecast]]")[0]
    loaded(curves, text).run()
    text += '[report]\n[[export]]\ntarget = "python"\n'
    result = loaded(curves, text).run(only="report")
    said = {one.name: (one.state, one.sentence) for one in result.stages}
    assert said["identification"] == ("kept", "was not asked for; the report shows what was kept of it")
    assert said["export 1: python"][0] == "left out"
    assert "the report lacks it" in said["export 1: python"][1]
    assert result.rankings[""].best.law.name in result.report.read_text()


def test_a_proposal_names_frames_records_and_times(folder: Path) -> None:
    """What it assumed stands in comments, and the file is a study."""
    proposal = propose_study(folder, folder / "study.toml")
    model = parse_study(folder / "study.toml", proposal.text).model
    (camera,), (record,) = model.camera, model.record
    assert (camera.frames, camera.times, camera.record) == (["frames"], "times.csv", record.name)
    assert record.file == "record.csv"
    assert "assumed" in proposal.text
    (folder / "alloys.csv").write_text(proposal.alloys)
    loaded(folder, proposal.text)


def test_the_tables_of_the_guide_are_valid() -> None:
    text = (ROOT / "docs" / "how-to" / "run_a_study.md").read_text()
    blocks = re.findall(r"```toml\n(.*?)```", text, re.S)
    models = [
        parse_study(Path("study.toml"), block if "[[camera]]" in block or "[data]" in block else DATA + block).model
        for block in blocks
    ]
    assert [len(model.camera) for model in models] == [0, 1, 0]


DATA = '[data]\nfiles = ["*.csv"]\n'
