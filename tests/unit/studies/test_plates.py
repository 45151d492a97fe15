"""Files of a plate go together by name and by time, questions stay questions; the table of alloys and what it says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

import creepkit as ck
from creepkit.errors import CreepkitError, HistoryError, StudyError
from creepkit.studies.alloy_table import looks_like_alloys, read_alloy_table
from creepkit.studies.proposal import propose_study
from creepkit.studies.study_file import parse_study
from helpers.camera_samples import dice, vic_3d
from helpers.instrument_samples import plate_record
from helpers.paths import ROOT
from helpers.plates import Schedule, write_record, write_times

BULGE = ck.specimen("bulge")


def write_views(folder: Path, counts: dict[str, int]) -> None:
    """Folders of so many small frames each, DICe and VIC-3D in turn."""
    for k, (name, count) in enumerate(counts.items()):
        (folder / name).mkdir()
        for frame in range(count):
            file = f"DICe_solution_{frame:02d}.txt" if k % 2 else f"plate-{frame:03d}_0.csv"
            (folder / name / file).write_bytes(dice() if k % 2 else vic_3d())


def proposed(folder: Path):
    proposal = propose_study(folder, folder / "study.toml")
    return proposal, parse_study(folder / "study.toml", proposal.text).model


def test_four_runs_have_their_own_times_and_records(tmp_path: Path) -> None:
    """Though all have as many frames: with run10 and a folder of capitals among them."""
    names = ["run1", "run2", "run10", "Run_11"]
    write_views(tmp_path, dict.fromkeys(names, 6))
    schedule = Schedule(frames=6)
    for k, name in enumerate(["run1", "run2", "run10", "run11"]):
        write_times(tmp_path / f"{name}_times.csv", schedule.times)
        write_record(tmp_path / f"{name}_log.csv", schedule, 1.0, {"T [C]": 730.0 + 27 * k})
    _, model = proposed(tmp_path)
    found = {Path(one.frames[0]).name: (one.times, one.record) for one in model.camera}
    assert found == {
        name: (f"{stem}_times.csv", f"{stem}_log")
        for name, stem in zip(names, ["run1", "run2", "run10", "run11"], strict=True)
    }
    assert model.temperature is not None  # four temperatures


def test_a_common_record_is_of_both_cameras_and_times_are_by_name(tmp_path: Path) -> None:
    write_views(tmp_path, {"west": 6, "east": 6})
    schedule = Schedule(frames=6)
    for name in ("west", "east"):
        write_times(tmp_path / f"{name}_times.csv", schedule.times)
    write_record(tmp_path / "logger.csv", schedule, 23.4, {"TC1 [C]": 800.0, "TC2 [C]": 802.0, "room [C]": 23.0})
    _, model = proposed(tmp_path)
    assert [(one.times, one.record) for one in model.camera] == [
        ("east_times.csv", "logger"),
        ("west_times.csv", "logger"),
    ]
    assert model.camera[0].channels == {"": ["P", "TC1", "TC2"]}  # the room is no thermocouple of the plate


def test_folders_say_that_they_hold_frames_and_files_may_have_the_number_alone(tmp_path: Path) -> None:
    write_views(tmp_path, {"run1_frames": 6, "run2_frames": 6})
    for k in (1, 2):
        write_times(tmp_path / f"times_{k}.csv", Schedule(frames=6).times)
        write_record(tmp_path / f"run{k}_log.csv", Schedule(frames=6), 1.0, {"T [C]": 800.0})
    _, model = proposed(tmp_path)
    files = [(one.times, one.record) for one in model.camera]
    assert files == [("times_1.csv", "run1_log"), ("times_2.csv", "run2_log")]


def test_where_several_would_do_it_is_a_question(tmp_path: Path) -> None:
    """Neither the first is taken, nor a number of seconds assumed; a run says what is missing."""
    write_views(tmp_path, {"frames": 6})
    for name in ("first", "second"):
        write_times(tmp_path / f"{name}.csv", Schedule(frames=6).times)
        write_record(tmp_path / f"rig_{name}.csv", Schedule(frames=6), 1.0, {"T [C]": 800.0})
    proposal, model = proposed(tmp_path)
    (camera,) = model.camera
    assert (camera.times, camera.interval_s, camera.record) == (None, None, None)
    asked = [line for line in proposal.summary if line.startswith("question: ")]
    assert asked == [
        "question: which of first.csv, second.csv is the times of frames?",
        "question: which of rig_first.csv, rig_second.csv is the record of frames?",
    ]
    assert '# times = "first.csv" or "second.csv"' in proposal.text
    assert '# record = "rig_first" or "rig_second"' in proposal.text
    text = proposal.text.replace(
        '# record = "rig_first" or "rig_second"', "load = { pressure_bar = 5 }\ntemperature_C = 9"
    )
    text = "".join(part for part in text.split("[[record]]")[0:1]) + "[[camera]]" + text.split("[[camera]]")[1]
    (tmp_path / "study.toml").write_text(text)
    (tmp_path / "alloys.csv").write_text(proposal.alloys)
    (failure,) = ck.Study.load(tmp_path / "study.toml").run(only="extraction").failures
    assert "their files hold no times; give times, a file with a row for each of the 6 frames" in failure.sentence


def test_a_record_that_is_too_short_is_not_of_the_frames(tmp_path: Path) -> None:
    write_views(tmp_path, {"frames": 6})
    write_times(tmp_path / "times.csv", Schedule(frames=6).times)
    write_record(tmp_path / "long.csv", Schedule(frames=6), 1.0, {"T [C]": 800.0})
    lines = (tmp_path / "long.csv").read_text().splitlines()
    (tmp_path / "short.csv").write_text("\n".join(lines[:60]) + "\n")
    _, model = proposed(tmp_path)
    assert model.camera[0].record == "long"


TABLE = """\
Camera;Dimple;Alloy;Thickness [µm];Thickness tolerance [%];Modulus [GPa];grain size [um];Ni [wt.%];exclude
west;D1;A 17;492,5;2;148,2;35;61,2;
west;D2;A 18;500;2;;40;58;leaked at the braze
east;D1;A 19;;;150;;;x
"""


def test_a_table_of_alloys_says_lengths_moduli_labels_and_exclusions(tmp_path: Path) -> None:
    path = tmp_path / "alloys.csv"
    path.write_text(TABLE, encoding="cp1252")
    first, second, third = read_alloy_table(path, BULGE).rows
    assert (first.camera, first.name, first.alloy, first.excluded) == ("west", "D1", "A 17", "")
    assert first.lengths == {"apex_thickness": pytest.approx(0.4925)}
    assert first.tolerances == {"apex_thickness": pytest.approx(0.00985)}
    assert first.modulus == pytest.approx(148.2e3)
    assert first.labels == {"grain size [um]": "35", "Ni [wt.%]": "61,2"}
    assert (second.excluded, second.modulus) == ("leaked at the braze", None)
    assert third.excluded.startswith("excluded by ")
    assert looks_like_alloys(path, BULGE)
    book = Workbook()
    for line in TABLE.splitlines():
        book.active.append([float(c.replace(",", ".")) if c[:1].isdigit() else c or None for c in line.split(";")])
    book.save(tmp_path / "alloys.xlsx")
    again = read_alloy_table(tmp_path / "alloys.xlsx", BULGE).rows
    assert [(o.alloy, o.lengths, o.tolerances, o.modulus) for o in again] == [
        (o.alloy, o.lengths, o.tolerances, o.modulus) for o in (first, second, third)
    ]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Dimple", "Hole number", "has the columns dimple and alloy"),
        ("Modulus [GPa]", "Modulus", "'Modulus' has no unit; allowed: Modulus_MPa"),
        ("492,5;2", ";2", "a tolerance in % needs the length that it is of"),
        ("492,5;2", "-4;2", "write a number above zero"),
        ("west;D2", "west;D1", "'D1' stands there twice"),
        ("west;D2", "west;", "does not name its dimple"),
        ("148,2", "many", "is 'many'"),
        ("grain size [um]", "Dicke [mm]", "is given twice"),
    ],
)
def test_mistakes_in_a_table_of_alloys_name_their_row(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "alloys.csv"
    path.write_text(TABLE.replace(old, new), encoding="cp1252")
    with pytest.raises(CreepkitError) as caught:
        read_alloy_table(path, BULGE)
    assert words in str(caught.value)
    assert "alloys.csv:" in str(caught.value)


def test_a_table_that_lacks_a_dimple_or_has_one_too_many_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "alloys.csv"
    path.write_text(TABLE, encoding="cp1252")
    table = read_alloy_table(path, BULGE)
    with pytest.raises(HistoryError, match=r"has no row of D3 of camera 'west'"):
        table.check("west", ["D1", "D2", "D3"], ["west", "east"])
    with pytest.raises(HistoryError, match=r"alloys.csv:3: camera 'west' shows no dimple 'D2'"):
        table.check("west", ["D1"], ["west", "east"])
    with pytest.raises(HistoryError, match="there is no camera 'east'; did you mean 'west'"):
        table.check("west", ["D1", "D2"], ["west"])


def nuisances_of(folder: Path, text: str, priors: list[ck.Nuisance], names: list[str], *, warm: bool = False):
    from creepkit.studies.arguments import settings_of_group

    tests = [
        ck.History(name, np.arange(3.0), {"strain": np.arange(3.0)}, ck.constant_stress(10.0), 1000.0) for name in names
    ]
    file = parse_study(folder / "study.toml", f'[data]\nfiles = ["*.csv"]\n[identification]\nlaws = ["norton"]\n{text}')
    everywhere = ["east D1", "east D2", "west D1"]
    return settings_of_group(file, tests, everywhere, priors, warm=warm).nuisances


def test_a_nuisance_of_one_dimple_is_of_its_alloy_alone(tmp_path: Path) -> None:
    stated = 'nuisances = ["thickness=0.49:0.01 for east D1"]\n'
    own = nuisances_of(tmp_path, stated, [], ["east D1"])
    assert [(one.kind, one.mean, one.tests) for one in own] == [("offset", 0.0, ()), ("thickness", 0.49, ())]
    assert [one.kind for one in nuisances_of(tmp_path, stated, [], ["west D1"])] == ["offset"]
    with pytest.raises(StudyError, match="there is no test 'east D9'"):
        nuisances_of(tmp_path, stated.replace("D1", "D9"), [], ["east D1"])


def test_priors_of_the_table_enter_and_rates_of_one_test_do_not(tmp_path: Path) -> None:
    priors = [
        ck.Nuisance("thickness", sd=0.01, tests=("east D1",)),
        ck.Nuisance("thickness", sd=0.02, tests=("west D1",)),
        ck.Nuisance("temperature", sd=2.0, tests=("east D1",)),
    ]
    one = nuisances_of(tmp_path, "", priors, ["east D1"])
    assert [(n.kind, n.sd, n.tests) for n in one] == [("offset", None, ()), ("thickness", 0.01, ())]
    both = nuisances_of(tmp_path, "", priors, ["east D1", "west D1"], warm=True)
    assert [(n.kind, n.sd, n.tests) for n in both] == [
        ("offset", None, ()),
        ("rate", None, ()),
        ("thickness", 0.02, ()),
        ("temperature", 2.0, ("east D1",)),
    ]
    stated = 'nuisances = ["rate=0:0.2", "thickness=0.4:0.1"]\n'
    kinds = [(n.kind, n.sd) for n in nuisances_of(tmp_path, stated, priors, ["east D1"])]
    assert kinds == [("offset", None), ("rate", 0.2), ("thickness", 0.1)]


def test_numbers_of_dimples_are_no_names_of_the_record(tmp_path: Path) -> None:
    """A record of A1, B2 and D1 does not lend the channels of its D1 to the first of several dimples in the view."""
    from creepkit.api.extraction import ImposedChannels

    path = tmp_path / "rig.csv"
    path.write_text(plate_record())
    record = ck.read_record(path)
    ImposedChannels(numbered=True).check(record, ["D1"])
    ImposedChannels().check(record, ["D1", "D2"])
    with pytest.raises(
        HistoryError, match=r"channels of A1, B2, D1, and .* only numbered, D1 to D2 row by row; say names"
    ):
        ImposedChannels(numbered=True).check(record, ["D1", "D2"])


# ---- cameras ---------------------------------------------------------------------------------------------------------

# Cameras of a study file, found wrong before a frame is read; planned forecasts; what a report alone shows.


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
    assert f"study.toml:{line}:" in text


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
