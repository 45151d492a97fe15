"""The CSV file of one history: what it may say, and what comes of it in s, MPa, mm, K."""

from pathlib import Path

import numpy as np
import pytest

from creepkit.language import Elastic
from creepkit.readers.history_csv import HISTORY_CSV, HistoryCsvReader
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records import History, PressureJump, Program, RecordedLoading, StressSteps

CREEP = "# temperature_C: 850\n# stress_MPa: 60\n"


@pytest.fixture
def read(tmp_path: Path):
    def one(text: str, reader: HistoryCsvReader = HISTORY_CSV) -> History:
        path = tmp_path / "test_1.csv"
        path.write_text(text, encoding="utf-8")
        (history,) = reader.read(path)
        return history

    return one


def test_uniaxial_test_in_laboratory_units(read):
    history = read(
        "# exported on a rainy day\n# alloy: Alloy 617\n# temperature_C: 850\n# stress_MPa: 60\n# modulus_GPa: 153\n"
        "# control: stress\n# strain_measure: logarithmic\n# includes_elastic: yes\n# heat: X7\n"
        "time_h,strain_pct\n0,0\n0.5,0.25\n1,-0.01\n"
    )
    assert history.name == "test_1"
    np.testing.assert_allclose(history.times, [0, 1800, 3600])
    np.testing.assert_allclose(history.outputs["strain"], [0, 0.0025, -0.0001])
    assert history.temperature == pytest.approx(1123.15)
    assert history.loading == StressSteps(((0.0, 60.0),), "stress")
    assert history.elastic == Elastic(E=153e3, nu=0.3)
    assert (history.strain_measure, history.includes_elastic) == ("logarithmic", True)
    assert (history.alloy, history.specimen, dict(history.labels)) == ("Alloy 617", "uniaxial", {"heat": "X7"})
    assert history.condition == "850 °C, 60 MPa"


def test_what_was_not_said_is_assumed_and_recorded(read):
    history = read(CREEP + "time_s,strain_1\n0,0\n1,0.1\n")
    assert history.labels == {"assumed": "control load, strain_measure engineering, includes_elastic no"}
    assert (history.strain_measure, history.includes_elastic) == ("engineering", False)
    assert history.loading.control == "load"


@pytest.mark.parametrize(
    ("head", "loading"),
    [
        ("stress_kPa: 2500", StressSteps(((0, 2.5),))),
        ("stress_bar: 25", StressSteps(((0, 2.5),))),
        ("stress_ksi: 10", StressSteps(((0, 68.94757293168361),))),
        ("stress_1_MPa: 50\n# stress_2_MPa: 60\n# jump_time_min: 2", StressSteps(((0, 50), (120, 60)))),
        ("stress_steps: 0 s 100 MPa; 1 h 120 MPa", StressSteps(((0, 100), (3600, 120)))),
        ("stress_program: 0 s 0 MPa; 5 s 8 MPa", RecordedLoading(Program([0, 5], [0, 8]), "stress")),
    ],
)
def test_stress_may_be_told_in_several_ways(read, head, loading):
    history = read(f"# temperature_K: 1000\n# {head}\n# control: load\ntime_s,strain_1\n0,0\n1,0.1\n")
    assert history.loading == loading


@pytest.mark.parametrize(
    ("head", "loading"),
    [
        ("pressure_1_MPa: 8\n# pressure_2_MPa: 10\n# jump_time_h: 4.05", PressureJump(8, 10, 14580)),
        ("pressure_1_MPa: 8\n# pressure_2_MPa: 10\n# jump_time_s: 60\n# ramp_s: 2", PressureJump(8, 10, 60, 2)),
        ("pressure_MPa: 8", PressureJump(8, 8, 300)),
        ("pressure_steps: 0 s 8 MPa; 60 s 9 MPa", RecordedLoading(Program([0, 60, 60], [8, 8, 9]), "pressure")),
    ],
)
def test_pressure_may_be_told_in_several_ways(read, head, loading):
    history = read(f"# temperature_K: 1000\n# {head}\ntime_s,amplitude_um,width_mm,shape\n150,80,3.6,2\n300,90,3.6,2\n")
    assert history.specimen == "bulge"
    assert list(history.outputs) == ["amplitude", "width", "shape"]
    np.testing.assert_allclose(history.outputs["amplitude"], [0.08, 0.09])
    assert history.loading.program() == loading.program()
    assert isinstance(history.loading, type(loading))


def test_recorded_columns_become_programs(read):
    history = read(
        "# alloy: x\ntime_s,strain_1,stress_MPa,temperature_C,strain_sd_pct\n10,0,50,700,0.01\n20,1e-3,60,701,0.02\n"
    )
    assert history.loading.program() == Program([0, 10, 20], [50, 50, 60])
    np.testing.assert_allclose(history.temperature_program().values, [973.15, 973.15, 974.15])
    np.testing.assert_allclose(history.standard_deviation["strain"], [1e-4, 2e-4])


def test_temperature_steps_and_programs(read):
    body = "# stress_MPa: 50\ntime_s,strain_1\n0,0\n10,1e-3\n"
    stepped = read("# temperature_steps: 0 s 900 K; 5 s 910 K\n" + body).temperature_program()
    np.testing.assert_allclose(stepped.at([0, 4.9, 5, 9]), [900, 900, 910, 910])
    ramped = read("# temperature_program: 0 s 900 K; 10 s 910 K\n" + body).temperature_program()
    np.testing.assert_allclose(ramped.at([0, 5, 20]), [900, 905, 910])


def test_frames_of_one_time_become_their_mean_and_are_counted(read):
    history = read(CREEP + "time_s,strain_1,strain_sd_1\n0,0,1e-4\n5,0.1,1e-4\n5,0.2,3e-4\n5,0.6,2e-4\n9,1,1e-4\n")
    np.testing.assert_allclose(history.times, [0, 5, 9])
    np.testing.assert_allclose(history.outputs["strain"], [0, 0.3, 1])
    np.testing.assert_allclose(history.standard_deviation["strain"], [1e-4, 2e-4, 1e-4])
    assert history.labels["merged_frames"] == "2"


def test_marked_frames(read):
    history = read(CREEP + "time_s,strain_1,used\n0,0,1\n1,0.1,0\n2,0.1,1\n")
    assert history.used.tolist() == [True, False, True]


def test_text_of_the_specimen_is_a_label_and_its_name_a_name(read):
    assert read(CREEP + "# specimen: bar\ntime_s,strain_1\n0,0\n1,0.1\n").specimen == "bar"
    history = read(CREEP + "# specimen: Round bar, 6 mm\ntime_s,strain_1\n0,0\n1,0.1\n")
    assert (history.specimen, history.labels["specimen"]) == ("uniaxial", "Round bar, 6 mm")


@pytest.mark.parametrize("text", ["\ufeff{}", "{}\n\n", "{}   \n"])
def test_marks_blank_lines_and_spaces_do_not_matter(read, text):
    plain = CREEP + "time_s,strain_1\n0,0\n1,0.1"
    assert read(text.format(plain)).outputs["strain"].tolist() == [0.0, 0.1]
    assert read(plain.replace("\n", "\r\n").replace(",", " , ")).times.tolist() == [0.0, 1.0]


def test_words_of_another_laboratory(read):
    words = HeaderVocabulary(
        synonyms={"Zeit_h": "time_h", "Dehnung_pct": "strain_pct", "Pruefspannung_MPa": "stress_MPa"},
        averaged_columns={"ofen_C": ("T1_C", "T2_C")},
    )
    reader = HistoryCsvReader("lab", "our laboratory", columns=("Zeit_h", "Dehnung_pct"), vocabulary=words)
    text = "# Pruefspannung_MPa: 60\n# temperature_C: 850\nZeit_h,Dehnung_pct,T1_C,T2_C\n0,0,850,852\n1,2,850,851\n"
    history = read(text, reader)
    assert history.times.tolist() == [0.0, 3600.0]
    assert history.loading.steps == ((0.0, 60.0),)
    assert history.labels["ofen_C"] == "850.75"


def test_reader_with_columns_accepts_only_files_that_have_them(tmp_path):
    reader = HistoryCsvReader("lab", "our laboratory", columns=("Zeit_h",))
    (tmp_path / "a.csv").write_text("# x: 1\n\nZeit_h,Dehnung_pct\n0,0\n")
    (tmp_path / "b.csv").write_text("time_h,strain_1\n0,0\n")
    assert [reader.accepts(tmp_path / name) for name in ("a.csv", "b.csv", "c.csv")] == [True, False, False]


def test_column_that_never_changes_is_a_constant(read):
    history = read("# temperature_C: 700\ntime_s,strain_1,stress_MPa,temperature_C\n0,0,50,700\n1,1e-3,50,700\n")
    assert history.temperature == 973.15
    assert history.loading.steps == ((0.0, 50.0),)


def test_one_standard_deviation_serves_all_frames(read):
    history = read(CREEP + "# strain_sd_1: 1e-5\ntime_s,strain_1\n0,0\n1,0.1\n")
    np.testing.assert_array_equal(history.standard_deviation["strain"], [1e-5, 1e-5])


def test_geometry_is_in_mm_unless_it_says_otherwise(read):
    history = read(CREEP + "# geometry apex_thickness_um: 480\n# geometry angle: 3\ntime_s,strain_1\n0,0\n1,0.1\n")
    assert history.geometry == pytest.approx({"apex_thickness": 0.48, "angle": 3.0})


def test_frames_after_the_end_are_kept_but_not_used(read):
    history = read(CREEP + "# end_time_h: 4\ntime_s,strain_1\n0,0\n14400,0.1\n14550,0.09\n")
    assert history.used.tolist() == [True, True, False]
    assert history.labels["frames_after_end"] == "1"
