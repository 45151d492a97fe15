"""The CSV file of one history: what it may say, and what comes of it in s, MPa, mm, K."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, HistoryError
from creepkit.language import Elastic, wachtman
from creepkit.readers.history_csv import HISTORY_CSV, HistoryCsvReader, history_text, write_history
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records import History, PressureJump, Program, RecordedLoading, StressSteps, constant_stress
from helpers.written_files import names_in

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
    assert (history.temperature, history.loading) == (pytest.approx(1123.15), StressSteps(((0.0, 60.0),), "stress"))
    assert history.elastic == Elastic(E=153e3, nu=0.3)
    assert (history.strain_measure, history.includes_elastic) == ("logarithmic", True)
    assert (history.alloy, history.specimen, dict(history.labels)) == ("Alloy 617", "uniaxial", {"heat": "X7"})
    assert history.condition == "850 °C, 60 MPa"


def test_what_was_not_said_is_assumed_and_recorded(read):
    history = read(CREEP + "time_s,strain_1\n0,0\n1,0.1\n")
    assert history.labels == {"assumed": "control load, strain_measure engineering, includes_elastic no"}
    assert (history.strain_measure, history.includes_elastic, history.loading.control) == ("engineering", False, "load")


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
    assert (history.specimen, list(history.outputs)) == ("bulge", ["amplitude", "width", "shape"])
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
    parted = read(
        "Stress: 50 MPa\nTemperature steps: 0 s 900 K; 5 s 910 K\n\nTime (s);Strain (%)\n0;0.0\n5;0.05\n10;0.1\n"
    )
    assert parted.temperature_program() == stepped
    ramped = read("# temperature_program: 0 s 900 K; 10 s 910 K\n" + body).temperature_program()
    np.testing.assert_allclose(ramped.at([0, 5, 20]), [900, 905, 910])


def test_frames_of_one_time_become_their_mean_and_are_counted(read):
    history = read(CREEP + "time_s,strain_1,strain_sd_1\n0,0,1e-4\n5,0.1,1e-4\n5,0.2,3e-4\n5,0.6,2e-4\n9,1,1e-4\n")
    np.testing.assert_allclose([history.times, history.outputs["strain"]], [[0, 5, 9], [0, 0.3, 1]])
    np.testing.assert_allclose(history.standard_deviation["strain"], [1e-4, 2e-4, 1e-4])
    assert history.labels["merged_frames"] == "2"


def test_words_of_another_laboratory(read):
    words = HeaderVocabulary(
        synonyms={"Zeit_h": "time_h", "Dehnung_pct": "strain_pct", "Pruefspannung_MPa": "stress_MPa"},
        ignored=("T1_C", "T2_C"),
    )
    reader = HistoryCsvReader("lab", "our laboratory", columns=("Zeit_h", "Dehnung_pct"), vocabulary=words)
    text = "# Pruefspannung_MPa: 60\n# temperature_C: 850\nZeit_h,Dehnung_pct,T1_C,T2_C\n0,0,850,852\n1,2,850,851\n"
    history = read(text, reader)
    assert (history.times.tolist(), history.loading.steps) == ([0.0, 3600.0], ((0.0, 60.0),))


def test_reader_with_columns_accepts_only_files_that_have_them(tmp_path):
    reader = HistoryCsvReader("lab", "our laboratory", columns=("Zeit_h",))
    (tmp_path / "a.csv").write_text("# x: 1\n\nZeit_h,Dehnung_pct\n0,0\n")
    (tmp_path / "b.csv").write_text("time_h,strain_1\n0,0\n")
    assert [reader.accepts(tmp_path / name) for name in ("a.csv", "b.csv", "c.csv")] == [True, False, False]


# ---- noise correlation -----------------------------------------------------------------------------------------------

# The key `noise_correlation` of a history file: read, written, refused.


NOISY_HEAD = "# specimen: bulge\n# pressure_1_MPa: 8\n# pressure_2_MPa: 8\n# jump_time_h: 1\n# temperature_C: 780\n"
FRAMES = "time_h,amplitude_mm,width_mm,shape,amplitude_sd_mm\n1,0.05,3.7,2.0,0.001\n2,0.08,3.6,2.1,0.001\n"


def read_noisy(folder: Path, text: str) -> ck.History:
    path = folder / "test.csv"
    path.write_text(f"{NOISY_HEAD}# noise_correlation: {text}\n{FRAMES}")
    return ck.read_histories(path)[0]


def test_it_is_read_in_any_order_and_written(tmp_path: Path) -> None:
    test = read_noisy(tmp_path, "amplitude width -0.31;shape   amplitude 0.2")
    assert (test.noise_correlation, test.labels) == ({("amplitude", "width"): -0.31, ("amplitude", "shape"): 0.2}, {})
    written = ck.write_history(test, tmp_path / "again.csv")
    assert "# noise_correlation: amplitude width -0.31; amplitude shape 0.2\n" in written.read_text()
    assert ck.read_histories(written)[0].noise_correlation == test.noise_correlation


def test_every_digit_survives(tmp_path: Path) -> None:
    rho = float(np.random.default_rng(1).uniform(-1, 1))
    test = read_noisy(tmp_path, "amplitude width 0.5").replace(noise_correlation={("amplitude", "width"): rho})
    again = ck.read_histories(ck.write_history(test, tmp_path / "again.csv"))[0]
    assert again.noise_correlation == {("amplitude", "width"): rho}


# ---- writing ---------------------------------------------------------------------------------------------------------

# What is written is read back to the last digit, or not written at all.


TIMES = np.array([0.1, 1 / 3, 7e5])
BULGE = {"amplitude": [0.1, 0.2, 1 / 7], "width": [3.6, 3.5, 3.4], "shape": [2.0, 1.9, 2.1]}

HISTORIES = [
    History("a", TIMES, {"strain": [0.0, 1e-17, -np.pi]}, constant_stress(1 / 3), 1123.15),
    History(
        "b c",
        TIMES,
        {"strain": [0, 1e-3, 0.1]},
        StressSteps(((0, 100.1), (3600.7, 1e-3)), "stress"),
        Program([0, 10, 10], [900.1, 901, 950]),
        elastic=Elastic(153e3 / 7, 0.31),
        strain_measure="engineering",
        includes_elastic=True,
        standard_deviation={"strain": [1e-5, 2e-5, 1 / 3e5]},
        used=[True, False, True],
        geometry={"gauge": 25.0, "slit_mm": 0.1},
        operator="window 0.8",
        alloy="Alloy 617",
        labels={"heat": "X7: hot", "specimen": "Round, 6 mm", "empty": "", "stress_MPa": "about 100"},
    ),
    History("d", TIMES, BULGE, PressureJump(8.0, 1e1 / 3, 14580.3, 4.9), 1075.6, specimen="bulge"),
    History(
        "e", TIMES, BULGE, RecordedLoading(Program([0, 5], [0, 8.1]), "pressure"), 1075.6, specimen="bulge-of-mine"
    ),
    History("g", TIMES, {"strain": [0, 1, 2]}, constant_stress(100.0), 900.0, rupture_time=7.1e5 / 1.01),
    History("h", TIMES, {"strain": [0, 1, 2]}, constant_stress(100.0), 900.0, unruptured=True),
    History("f", TIMES, {"strain": [0, 1, 2]}, RecordedLoading(Program([0, 5], [0, 8]), "stress", "stress"), 900.0),
]


def assert_same(one: History, two: History) -> None:
    for name in ("name", "loading", "temperature", "specimen", "elastic", "strain_measure", "includes_elastic"):
        assert getattr(one, name) == getattr(two, name), name
    for name in ("geometry", "operator", "alloy", "labels", "rupture_time", "unruptured"):
        assert getattr(one, name) == getattr(two, name), name
    np.testing.assert_array_equal(one.times, two.times, strict=True)
    np.testing.assert_array_equal(one.used, two.used, strict=True)
    for name in ("outputs", "standard_deviation"):
        assert getattr(one, name).keys() == getattr(two, name).keys()
        for key, values in getattr(one, name).items():
            np.testing.assert_array_equal(values, getattr(two, name)[key], strict=True)


@pytest.mark.parametrize("history", HISTORIES, ids=lambda history: history.name)
def test_round_trip(history: History, tmp_path: Path):
    path = write_history(history, tmp_path / "x.csv")
    (back,) = HISTORY_CSV.read(path)
    assert_same(history, back)
    assert (back.source, history_text(back), names_in(tmp_path)) == (str(path), path.read_text(), ["x.csv"])


def test_modulus_of_temperature_is_written_at_the_temperature_of_the_test(tmp_path):
    elastic = Elastic(wachtman(210e3, 80.0, 300.0))
    history = HISTORIES[0].replace(elastic=elastic)
    (back,) = HISTORY_CSV.read(write_history(history, tmp_path / "x.csv"))
    assert back.elastic.E == pytest.approx(210e3 - 80.0 * 1123.15 * np.exp(-300.0 / 1123.15), rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"labels": {"a": "two\nlines"}}, r"history 'a': 'two\\nlines' cannot be written in one line"),
        ({"labels": {"a:b": ""}}, "history 'a': 'a:b' cannot name a line; use words without a colon"),
        ({"labels": {"": "x"}}, "history 'a': '' cannot name a line"),
        ({"geometry": {" gauge": 1.0}}, "history 'a': ' gauge' cannot be written in one line"),
        ({"alloy": " 617"}, "history 'a': ' 617' cannot be written in one line"),
        ({"specimen": "Round Bar"}, "history 'a': specimen 'Round Bar' is not a name in small letters"),
        ({"outputs": {"strain": [0, np.nan, 1]}}, "history 'a': 'strain_1' holds a number that is not finite"),
        ({"outputs": {"sag": [0, 1, 1]}}, "history 'a': no registered specimen has an output 'sag', whose"),
        (
            {"elastic": Elastic(wachtman(2e5, 80.0, 300.0)), "temperature": Program([0, 1], [900, 910])},
            "history 'a': elastic data that change during a test",
        ),
    ],
)
def test_what_would_not_survive_is_refused_and_nothing_is_written(changes, message, tmp_path):
    with pytest.raises(HistoryError, match=message):
        write_history(HISTORIES[0].replace(**changes), tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


# ---- ignored columns -------------------------------------------------------------------------------------------------

# Columns that nobody needs are left out where that is said, and only there; names are told as they were written.


LOGGER_HEAD = "# stress_MPa: 60\n# temperature_C: 850\n"
TABLE = "Time (h);Strain (%);load, kN;operator;Date\n0;0;3,1;Ms A;1.3.24\n1;0,112;3,1;Mr B;1.3.24\n2;0,2;3,1;;2.3.24\n"


def read_ignoring(text: str, path: Path, **options: object) -> list[History]:
    path.write_text(text, encoding="utf-8")
    return ck.read_histories(path, **options)


def test_by_a_key_of_the_head(tmp_path: Path):
    for key in ("ignore: load, kN; operator; Date", "Ignore: load, kN; OPERATOR; date"):
        (history,) = read_ignoring(f"# {key}\n{LOGGER_HEAD}{TABLE}", tmp_path / "x.csv")
        np.testing.assert_allclose(history.outputs["strain"], [0, 0.00112, 0.002])
        assert set(history.labels) == {"assumed"}


def test_by_the_call_in_every_file_that_has_them(tmp_path: Path):
    (tmp_path / "y.csv").write_text(f"{LOGGER_HEAD}time_h,strain_pct\n0,0\n1,0.1\n")
    (tmp_path / "x.csv").write_text(LOGGER_HEAD + TABLE)
    found = ck.read_histories(tmp_path, ignore=["load, kN", "operator", "Date"])
    assert [history.name for history in found] == ["x", "y"]
    with pytest.raises(CreepkitError, match="ignore of .* is 'Date'; allowed is a list, each item a text"):
        ck.read_histories(tmp_path, ignore="Date")


def test_columns_of_a_wide_table_and_of_a_table_of_tests(tmp_path: Path):
    wide = "Stress (MPa),60,,80\nTemperature (C),850,,850\nTime (h),A strain (%),load_kN,B strain (%)\n"
    first, second = read_ignoring("# ignore: load_kN\n" + wide + "0,0,x,0\n1,0.1,y,0.2\n", tmp_path / "x.csv")
    assert (first.outputs["strain"][1], second.outputs["strain"][1]) == (0.001, 0.002)
    table = "test,stress_MPa,T_C,t_r (h),stress ratio\nA,60,850,120,?\n"
    (history,) = read_ignoring(table, tmp_path / "y.csv", ignore=["stress ratio"])
    assert "stress ratio" not in history.labels
