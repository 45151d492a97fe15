"""`creepkit read --ask`: questions one after another, answers beside the data, nothing changed in the files."""

from functools import partial

import pytest

import creepkit as ck
from creepkit.cli.asking import put_questions
from creepkit.errors import HistoryError

TABLE = "Temp (C);Stress (MPa);tr (h);Status\n600;320;4454;A\n600;260;23220;B\n650;320;233;A\n"
CURVE = "# stress_MPa: 120\n# temperature_C: 600\nZeit (h);Dehnung (%);Kanal 7;W\n0;0;4;1\n10;0.1;4;1\n20;0.18;4;2\n"


def typing(*answers):
    left = list(answers)
    return lambda prompt: left.pop(0), left


def test_questions_are_answered_one_after_another(tmp_path, capsys):
    (tmp_path / "a.csv").write_text(CURVE, encoding="utf-8")
    (tmp_path / "rates.csv").write_text(TABLE, encoding="utf-8")
    answer, left = typing("1", "unused", "9", "")
    (file,) = put_questions(partial(ck.read_histories, tmp_path), answer)
    assert (file.name, left) == ("tests.toml", [])
    assert "'9' is none of these" in capsys.readouterr().out
    tests = {one.name: one for one in ck.read_histories(tmp_path)}
    assert [tests[name].unruptured for name in ("rates 2", "rates 3", "rates 4")] == [False, True, False]
    assert tests["a"].outputs["strain"][-1] == pytest.approx(0.0018)
    assert (tmp_path / "rates.csv").read_text(encoding="utf-8") == TABLE


def test_the_same_question_of_several_files_is_put_once(tmp_path):
    head = "Stress (MPa);120\nTemperature (C);600\nTime (h);Extension (mm)\n"
    for name in ("RX1.csv", "RX2.csv"):
        (tmp_path / name).write_text(f"{head}0;0,01\n10;0,05\n50;0,1\n100;0,16\n", encoding="utf-8")
    answer, left = typing("40")
    put_questions(partial(ck.read_histories, tmp_path), answer)
    assert left == []
    assert (tmp_path / "tests.toml").read_text(encoding="utf-8") == '["RX*.csv"]\ngauge_length_mm = 40\n'
    assert [one.outputs["strain"][-1] for one in ck.read_histories(tmp_path)] == pytest.approx([0.004, 0.004])


def test_a_question_may_stay_open(tmp_path):
    (tmp_path / "rates.csv").write_text(TABLE, encoding="utf-8")
    answer, _ = typing("?")
    assert put_questions(partial(ck.read_histories, tmp_path), answer) == []
    assert not (tmp_path / "tests.toml").exists()


def test_without_a_terminal_each_question_is_a_line(tmp_path, capsys):
    (tmp_path / "a.csv").write_text(CURVE, encoding="utf-8")
    (tmp_path / "rates.csv").write_text(TABLE, encoding="utf-8")
    with pytest.raises(HistoryError, match=r"3 questions open; answer them in tests.toml"):
        put_questions(partial(ck.read_histories, tmp_path), None)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert 'tests.toml beside it: ["rates.csv"] ended = {B = "stopped", A = "ruptured"}' in lines[2]


def test_a_specimen_and_lengths_that_nobody_stated_are_asked_for(tmp_path):
    head = "# pressure_MPa: 8\n# temperature_C: 800\ntime_s,amplitude_mm\n"
    (tmp_path / "d.csv").write_text(f"{head}60,0.08\n300,0.09\n900,0.1\n", encoding="utf-8")
    answer, left = typing("", "0.48", "", "", "", "", "")
    put_questions(partial(ck.read_histories, tmp_path), answer)
    (test,) = ck.read_histories(tmp_path)
    assert (test.specimen, test.geometry["apex_thickness"], test.geometry["cavity_radius"]) == ("bulge", 0.48, 7.5)
    assert (left, "by default" in test.labels.get("assumed", "")) == ([], False)
