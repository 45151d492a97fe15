"""Folders with an index: frames of all tests in one file, or one file a test."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.cli.asking import with_answer
from creepkit.errors import HistoryError
from creepkit.readers.indexed_folders import INDEXED_FILES, INDEXED_TABLE
from creepkit.readers.questions import Question, SeveralErrors
from creepkit.readers.reading import creepkit_readers, read_histories
from creepkit.readers.tests_file import answers_of
from creepkit.records import History, constant_stress

INDEX = "key,temperature_C,stress_MPa,youngs_MPa,state\na/1,900,25,149000,Ruptured\na/2,950,20,144000,\n"
CURVES = (
    "key,temperature_C,stress_MPa,time_s,strain\na/1,900,25,0,0\na/2,950,20,0,0\na/1,900,25,10,0.1\na/2,950,20,9,0.2\n"
)


def folder(tmp_path: Path, files: dict[str, str]) -> Path:
    made = tmp_path / "alloy9"
    made.mkdir()
    for name, text in files.items():
        (made / name).write_text(text, encoding="utf-8")
    return made


def files(index: str = "", frames: str = "") -> dict[str, str]:
    index = index or "test,temperature_C,stress_MPa,rupture_h\nB,980,230,78.7\nA,980,140,Not applicable\n"
    frames = frames or "time_h,creep_extension_pct,T_top_C,T_mid_C,T_bot_C\n0,0,980,981,982\n2,0.5,980,981,988\n"
    return {"index.csv": index, "A_creep.csv": frames, "B_creep.csv": frames}


def test_one_table_for_all_tests(tmp_path):
    first, second = INDEXED_TABLE.read(folder(tmp_path, {"index.csv": INDEX, "curves.csv": CURVES}))
    assert (first.name, second.name, first.alloy) == ("a/1", "a/2", "alloy9")
    assert (first.outputs["strain"].tolist(), second.times.tolist()) == ([0.0, 0.1], [0.0, 9.0])
    assert (first.elastic.E, first.temperature) == (149000.0, 1173.15)
    assert (first.rupture_time, first.labels["assumed"].split(", ")[-1]) == (10.0, "rupture at the last frame")
    assert (second.rupture_time, second.unruptured, second.end_known) == (None, False, False)
    assert first.source.endswith("curves.csv (a/1)")


def test_one_file_a_test_in_the_order_of_the_index(tmp_path):
    made = folder(tmp_path, files())
    first, second = INDEXED_FILES.read(made)
    assert (first.name, second.name, first.source) == ("B", "A", str(made / "B_creep.csv"))
    np.testing.assert_allclose([first.times, first.outputs["strain"]], [[0, 7200], [0, 0.005]])
    assert (first.loading.steps, first.temperature) == (((0.0, 230.0),), pytest.approx(1253.15))
    ends = [(one.rupture_time, one.unruptured) for one in (first, second)]
    assert ends == [(pytest.approx(78.7 * 3600), False), (None, True)]


def test_any_file_of_the_folder_leads_to_it(tmp_path):
    made = folder(tmp_path, files())
    assert all(INDEXED_FILES.accepts(made / name) for name in ("", "index.csv", "A_creep.csv"))
    assert [history.name for history in INDEXED_FILES.read(made / "index.csv")] == ["B", "A"]
    assert [history.name for history in INDEXED_FILES.read(made / "A_creep.csv")] == ["A"]
    assert not INDEXED_TABLE.accepts(made)
    (made / "notes.csv").write_text("x\n1\n")
    assert not INDEXED_FILES.accepts(made / "notes.csv")


# ---- reading ---------------------------------------------------------------------------------------------------------

# Which reader gets which file, and what tests are called when they come together.


READERS = creepkit_readers()
TEST = "# temperature_C: 850\n# stress_MPa: 60\ntime_s,strain_1\n0,0\n1,0.1\n"


@dataclass(frozen=True)
class Always:
    """A reader that wants every file."""

    name: str
    title: str = "wants everything"

    def accepts(self, path: Path) -> bool:
        return path.is_file()

    def read(self, path: Path) -> list[History]:
        return [History(f"{self.name} {path.stem}", [0, 1], {"strain": [0, 1]}, constant_stress(1), 900.0)]


@pytest.fixture
def tests_in_folders(tmp_path: Path) -> Path:
    for name in ("one/b.csv", "one/a.csv", "two/a.csv"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(TEST)
    return tmp_path


def names(*args: object, **kwargs: object) -> list[str]:
    return [history.name for history in read_histories(*args, **kwargs)]


def test_files_folders_and_patterns(tests_in_folders):
    """In the order given, each once; equal names get their folder in front, and a bad file among good ones is named."""
    one = tests_in_folders / "one"
    for paths, found in (
        (one / "b.csv", ["b"]),
        (str(one), ["a", "b"]),
        (f"{one}/*.csv", ["a", "b"]),
        ([one / "b.csv", one / "a.csv"], ["b", "a"]),
        ([one, one / "a.csv", f"{one}/*"], ["a", "b"]),
        (f"{tests_in_folders}/*/*.csv", ["one/a", "b", "two/a"]),
    ):
        assert names(paths, READERS) == found, paths
    (one / "c.csv").write_text("")
    with pytest.raises(HistoryError, match=r"c.csv: the file is empty"):
        read_histories(one, READERS)


# ---- tests file ------------------------------------------------------------------------------------------------------

# tests.toml beside the files of a laboratory: what they leave open is answered there, and every question names it.


TABLE = "Temp (C);Stress (MPa);tr (h);Status\n600;320;4454;A\n600;260;23220;B\n650;320;233;A\n"
CURVE = "# stress_MPa: 120\nZeit (h);Dehnung (%);Kanal 7\n0;0;4\n10;0.1;4\n20;0.18;4\n"


def written(folder, **files):
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text, encoding="utf-8")
    return folder


def test_an_answer_decides_how_tests_ended(tmp_path):
    written(tmp_path, rates__csv=TABLE)
    with pytest.raises(Question, match="'Status' says 'A' and 'B': did these tests break") as caught:
        ck.read_histories(tmp_path)
    line = caught.value.entry(caught.value.choices[0])
    assert line == 'ended = {B = "stopped", A = "ruptured"}'  # the one that lasted longest is the likely run-out
    written(tmp_path, tests__toml=f'["rates.csv"]\n{line}\n')
    tests = ck.read_histories(tmp_path)
    assert [one.unruptured for one in tests] == [False, True, False]
    written(tmp_path, tests__toml='["*.csv"]\nended = {a = "label", b = "label"}\n')
    assert [one.unruptured for one in ck.read_histories(tmp_path)] == [False] * 3


def test_conditions_and_columns(tmp_path):
    written(tmp_path, a__csv=CURVE, b__csv=CURVE)
    with pytest.raises(HistoryError, match="Kanal 7") as caught:
        ck.read_histories(tmp_path)
    assert "a.csv:2 (and 1 file more)" in str(caught.value)
    written(
        tmp_path,
        tests__toml='["*.csv"]\ntemperature_C = 600\ncolumns = {"Kanal 7" = "unused"}\n'
        '["b.csv"]\ntemperature_C = 650\n',
    )
    first, second = ck.read_histories(tmp_path)
    assert (first.temperature, second.temperature) == (873.15, 923.15)
    assert ck.read_histories(tmp_path / "b.csv")[0].temperature == 923.15
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == CURVE


def test_a_table_is_found_by_the_answers_alone(tmp_path):
    text = "Pr;Last (MPa);Ofen (°C);Dauer bis Ende (h)\nA;120;600;900\nB;100;600;>5000\n"
    written(tmp_path, x__csv=text)
    columns = '"Last (MPa)" = "stress", "Ofen (°C)" = "temperature_C", "Dauer bis Ende (h)" = "rupture", Pr = "test"'
    written(tmp_path, tests__toml=f'["x.csv"]\ncolumns = {{{columns}}}\n')
    first, second = ck.read_histories(tmp_path)
    assert (first.name, first.rupture_time, second.unruptured) == ("A", 900 * 3600.0, True)


def test_a_step_after_an_interruption_is_taken_off(tmp_path):
    hours = np.concatenate([np.linspace(0, 35, 36), np.linspace(80, 120, 41)])
    strain = 0.002 * (hours / 10) ** 0.4 + 2e-5 * hours
    moved = strain + np.where(hours > 50, 0.0022, 0.0)
    rows = [f"{t!r},{100 * e!r}" for t, e in zip(hours.tolist(), moved.tolist(), strict=True)]
    written(tmp_path, x__csv="\n".join(["# stress_MPa: 120", "# temperature_C: 600", "time_h,strain_pct", *rows]))
    written(tmp_path, tests__toml='["x.csv"]\nsteps_taken_off = "80 h"\n')
    (one,) = ck.read_histories(tmp_path)
    assert one.outputs["strain"] == pytest.approx(strain, abs=2e-4)
    assert "of strain at 80 h taken off" in one.labels["assumed"]
    written(tmp_path, tests__toml='["x.csv"]\nsteps_taken_off = "80"\n')
    with pytest.raises(HistoryError, match="write times such as 36.75 h; 120 h"):
        ck.read_histories(tmp_path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('["a.csv"]\nstres_MPa = 5\n', "stres_MPa: is no key; did you mean 'stress_MPa'?"),
        ('["a.csv"]\ncolums = {x = "y"}\n', "colums: is no key; did you mean 'columns'?"),
        ('["a.csv"]\nwhatever = 1\n', "is no key; allowed are columns, ended, parts, tests, and conditions"),
        ('["a.csv"]\nended = {x = "broke"}\n', "'broke' is no end; allowed: ruptured, stopped, label"),
        ('["a.csv"]\ncolumns = "x"\n', "write {name of a column = what it is}"),
        ("stress_MPa = 5\n", 'stands in no table; begin with the files that it is about, such as ["*.csv"]'),
        ("[a\n", "is no TOML"),
    ],
)
def test_a_wrong_key_is_one_sentence(tmp_path, text, said):
    written(tmp_path, a__csv=CURVE, tests__toml=text)
    with pytest.raises(HistoryError) as caught:
        ck.read_histories(tmp_path)
    assert said in str(caught.value)
    assert "tests.toml" in str(caught.value)


def test_answers_are_added_to_what_is_there(tmp_path):
    text = with_answer("", "a.csv", "temperature_C", 600.0)
    text = with_answer(text, "b.csv", "columns", {"x": "unused"})
    text = with_answer(text, "b.csv", "columns", {"x": "label", "y": "label"})
    text = with_answer(text, "a.csv", "temperature_C", 650.0)
    assert text == '["a.csv"]\ntemperature_C = 650\n\n["b.csv"]\ncolumns = {x = "label", y = "label"}\n'
    written(tmp_path, tests__toml=text)
    assert answers_of(tmp_path / "b.csv").columns == {"x": "label", "y": "label"}


def test_all_errors_of_a_table_come_at_once(tmp_path):
    table = "test,T (C),stress_MPa,tr (h)\nA,600,x,900\nB,600,90,slow pokes\nB2,600,90,5000*\nC,600,-2e5,20\n"
    written(tmp_path, r__csv=table)
    with pytest.raises(SeveralErrors) as caught:
        ck.read_histories(tmp_path)
    lines = [str(one) for one in caught.value.errors]
    assert [next(k for k in "2345" if f"r.csv:{k}" in line) for line in lines] == ["3", "4", "2", "5"]
    assert "ignore" not in "".join(lines)


def test_a_guess_gives_way_to_an_answer(tmp_path):
    """Titles and names of files and sheets are guesses; a column or `# key: value` contradicts an answer."""
    frames = "Time (h);Strain (%)\n0;0\n10;0.1\n"
    written(
        tmp_path, lot_245C__csv=f"joint A 300 C\nStress: 12 MPa\n{frames}", k__csv=f"# temperature_C: 245\n{frames}"
    )
    with pytest.raises(HistoryError, match="states a temperature of 245 C, but .* states 300 C; correct one of them"):
        ck.read_histories(tmp_path / "lot_245C.csv")
    written(tmp_path, tests__toml='["*.csv"]\ntemperature_C = 23\n')
    (one,) = ck.read_histories(tmp_path / "lot_245C.csv")
    assert (one.temperature, one.loading.steps) == (pytest.approx(296.15), ((0.0, 12.0),))
    assert "temperature of tests.toml and not 300 C from 1" in one.labels["assumed"]
    assert "temperature of tests.toml and not 245 C from name of the file" in one.labels["assumed"]
    with pytest.raises(HistoryError, match="temperature_C is '23', and .*k.csv:1 says another one"):
        ck.read_histories(tmp_path / "k.csv")


def test_one_answer_for_tests_whose_titles_differ_is_refused(tmp_path):
    frames = "Time (h);Strain (%)\n0;0\n10;0.1\n"
    frames = f"Température d’essai (°C);245\n{frames}"
    written(tmp_path, two__csv=f"Test A 12 MPa\n{frames}\nTest B 20 MPa\n{frames}")
    found = ck.read_histories(tmp_path / "two.csv")
    assert [(one.temperature, one.loading.steps[0][1]) for one in found] == [(518.15, 12.0), (518.15, 20.0)]
    written(tmp_path, tests__toml='["*.csv"]\nstress_MPa = 15\n')
    with pytest.raises(HistoryError, match="15 would hold for all tests of 'two.csv', which say 12 MPa and 20 MPa"):
        ck.read_histories(tmp_path / "two.csv")


TREATMENTS = (
    *("lot A, reflow 245C", "aged 1000 h at 750 °C", "annealed 980 C", "heat treated 1050 °C", "solution 1180 °C"),
    *("tempered 770 °C", "normalised 1060 °C", "cured 180 C", "HT 1050 °C", "geglüht 900 °C", "ausgelagert 750 °C"),
    *("vieilli 700 °C", "recuit 900 °C", "ageing 750C", "sintered 1400 °C"),
)


def test_temperatures_of_treatments_are_none_of_tests(tmp_path):
    for title in TREATMENTS:
        written(tmp_path, a__csv=f"{title}\nStress (MPa);12\nTime (h);Strain (%)\n0;0\n10;0.1\n")
        with pytest.raises(Question, match="no temperature"):
            ck.read_histories(tmp_path)


@pytest.mark.parametrize(("answer", "hours"), [("time_of_day", [0, 2, 6]), ("elapsed_time", [20, 22, 26])])
def test_a_clock_that_is_asked_for_can_be_answered(tmp_path, answer, hours):
    clock = ("20:00:00", "22:00:00", "02:00:00" if answer == "time_of_day" else "23:59:59")
    rows = "".join(f"{time};0.{k}\n" for k, time in enumerate(clock))
    written(tmp_path, a__csv=f"# stress_MPa: 12\n# temperature_C: 600\nTime;Strain (%)\n{rows}")
    with pytest.raises(Question, match="may be elapsed or of the day") as caught:
        ck.read_histories(tmp_path)
    (line,) = [caught.value.entry(one) for one in caught.value.choices if answer in str(one)]
    assert line == f'columns = {{Time = "{answer}"}}'
    written(tmp_path, tests__toml=f'["a.csv"]\n{line}\n')
    expected = hours if answer == "time_of_day" else [20, 22, 24 - 1 / 3600]
    np.testing.assert_allclose(ck.read_histories(tmp_path)[0].times / 3600, expected)
