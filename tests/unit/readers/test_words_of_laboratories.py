"""What laboratories write in tables: remarks that a test did not break, marks of missing values, German names."""

import pytest

import creepkit as ck
from creepkit.errors import HistoryError

TABLE = "test,stress_MPa,T (C),t_r (h),{name}\nA,200,800,1200,{a}\nB,220,800,800,{b}\n"
HEAD = "# specimen: uniaxial\n# stress_MPa: 100\n# temperature_C: 750\n# control: load\n"


def _read(tmp_path, text, name="t.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return ck.read_histories([tmp_path / name])


@pytest.mark.parametrize("name", ["remark", "Bemerkung", "comment", "note"])
@pytest.mark.parametrize(
    "text", ["run-out", "Run out", "stopped; unbroken", "Läufer", "Durchläufer", "not ruptured", "nicht gebrochen",
             "did not break", "kein Bruch", "running", "censored at 800 h", "no failure yet"],
)  # fmt: skip
def test_a_remark_that_a_test_did_not_break_makes_no_rupture(tmp_path, name, text):
    first, second = _read(tmp_path, TABLE.format(name=name, a="", b=text))
    assert (first.unruptured, second.unruptured, second.rupture_time) == (False, True, None)
    assert "stopped before rupture by its remark" in second.labels["assumed"]
    both = "test,stress_MPa,T (C),t_r (h),remark,status\nA,200,800,1200,,stopped\nB,220,800,800,{},{}\n"
    stopped = _read(tmp_path, both.format(text, "stopped"))[1]
    assert (stopped.unruptured, stopped.rupture_time) == (True, None)
    ruptured = _read(tmp_path, both.format(text, "ruptured"))[1]
    assert (ruptured.unruptured, ruptured.rupture_time) == (False, 800 * 3600.0)


@pytest.mark.parametrize("text", ["test abgebrochen", "interrupted", "furnace failure", "Kopf abgebrochen", "stopped"])
def test_a_remark_that_a_test_was_interrupted_is_asked_about(tmp_path, text):
    with pytest.raises(HistoryError, match=r"t.csv:3: 'remark' says .* did these tests break, .* tests\.toml"):
        _read(tmp_path, TABLE.format(name="remark", a="", b=text))


@pytest.mark.parametrize(
    "text",
    ["ruptured in gauge length", "necking", "breakthrough of oxide", "heat X7", "failure outside gauge", "Bruch"],
)
def test_other_remarks_are_labels(tmp_path, text):
    second = _read(tmp_path, TABLE.format(name="remark", a="", b=text))[1]
    assert (second.labels["remark"], second.rupture_time) == (text, 800 * 3600.0)


@pytest.mark.parametrize("mark", ["n.a.", "n/a", "NA", "n.b.", "-", "--", "k.A.", ""])
def test_marks_of_missing_values_are_empty_where_empty_is_allowed(tmp_path, mark):
    table = f"test,stress_MPa,T (C),min creep rate (1/h),t_r (h)\nA,200,800,1e-6,{mark}\nB,220,800,2e-6,800\n"
    first, second = _read(tmp_path, table)
    assert (first.rupture_time, second.rupture_time) == (None, 800 * 3600.0)
    beside = f"Time (h),A1 strain (%),B1 strain (%)\n1,0.1,0.2\n2,{mark},0.3\n3,0.3,0.4\n"
    head = HEAD + "# strain_measure: engineering\n# includes_elastic: no\n"
    assert [one.times.size for one in _read(tmp_path, head + beside)] == [2, 3]
    with pytest.raises(HistoryError, match="leave the row out"):
        _read(tmp_path, head + f"time_h,strain_pct\n1,0.1\n2,{mark}\n3,0.3\n4,0.4\n")


@pytest.mark.parametrize("text", ["nan", "NaN", "inf", "none"])
def test_numbers_that_were_lost_are_no_missing_values(tmp_path, text):
    with pytest.raises(HistoryError):
        _read(
            tmp_path, f"test,stress_MPa,T (C),min creep rate (1/h),t_r (h)\nA,200,800,1e-6,{text}\nB,220,800,2e-6,8\n"
        )


def test_german_names_and_units(tmp_path):
    german = (
        "# Anfangsdehnung_pct: 0.13\n# includes_loading: yes\n# strain_measure: engineering\n# control: load\n"
        "# specimen: uniaxial\nSpannung (kp/mm²);20\nTemperatur (°C);800\nZeit (h);plastische Dehnung ({unit})\n"
        "1;{a}\n10;{b}\n100;{c}\n"
    )
    (one,) = _read(tmp_path, german.format(unit="Mikrodehnung", a=2000, b=3000, c=4000))
    (other,) = _read(tmp_path, german.format(unit="%", a="0,2", b="0,3", c="0,4"))
    assert one.outputs["strain"] == pytest.approx(other.outputs["strain"], rel=1e-12)
    assert one.loading.program().values[-1] == pytest.approx(20 * 9.80665, rel=1e-12)
    assert not one.includes_elastic
