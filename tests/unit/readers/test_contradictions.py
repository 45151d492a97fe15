"""What a file says twice, or cannot mean, is refused: units, durations beside rupture times, marks of frames."""

from pathlib import Path

import pytest

from creepkit.errors import HistoryError
from creepkit.quality import check_data_quality
from creepkit.readers.history_csv import HISTORY_CSV, write_history
from creepkit.readers.tests_in_rows import TEST_TABLE
from creepkit.records import History

HEAD = "# stress_MPa: 100\n# temperature_C: 800\n"


def read(path: Path, text: str) -> list[History]:
    path.write_text(text)
    return HISTORY_CSV.read(path)


def test_a_strain_without_unit_above_100_is_asked_for(tmp_path: Path):
    body = "time_h,strain\n0,0\n1,500\n2,1200\n"
    with pytest.raises(HistoryError, match="bar.csv:3: 'strain' has no unit, and values up to 1200 .*microstrain"):
        read(tmp_path / "bar.csv", HEAD + body)
    (history,) = read(tmp_path / "bar.csv", HEAD + "# strain_unit: microstrain\n" + body)
    assert history.outputs["strain"][-1] == pytest.approx(1.2e-3)


def test_a_strain_above_one_is_flagged(tmp_path: Path):
    (history,) = read(tmp_path / "bar.csv", HEAD + "time_h,strain_1\n0,0\n1,0.5\n2,1.2\n")
    (flag,) = [one for one in check_data_quality([history]) if one.kind == "unit"]
    assert "the strain reaches 120 %" in str(flag)
    write_history(history, tmp_path / "again.csv")
    (again,) = HISTORY_CSV.read(tmp_path / "again.csv")
    assert again.labels == history.labels


def test_a_unit_behind_a_value_that_is_not_that_of_its_name(tmp_path: Path):
    body = "Stress (MPa);100;{}\nTemperature (C);800;{}\nTime (h);Strain (%)\n0;0\n1;0,5\n2;0,9\n"
    (history,) = read(tmp_path / "bar.csv", body.format("MPa", "°C"))
    assert history.condition == "800 °C, 100 MPa"
    for units in (("ksi", "C"), ("MPa", "K")):
        with pytest.raises(HistoryError, match=r"bar.csv:[12]: '(Stress|Temp).* behind its value; keep one"):
            read(tmp_path / "bar.csv", body.format(*units))


def test_a_mark_that_is_neither_0_nor_1(tmp_path: Path):
    with pytest.raises(HistoryError, match=r"bar.csv:5: 'used' is 0.5; allowed: 1 for a frame"):
        read(tmp_path / "bar.csv", HEAD + "time_h,strain_pct,used\n0,0,1\n1,.5,.5\n2,.9,1\n")


@pytest.mark.parametrize(("duration", "is_refused"), [("9.5", False), ("9.52", False), ("100", True), ("5", True)])
def test_a_duration_beside_a_rupture_time(tmp_path: Path, duration: str, is_refused: bool):
    path = tmp_path / "table.csv"
    path.write_text(f"no,Stress (MPa),T (C),tr (h),duration (h)\n1,120,750,9.5,{duration}\n")
    if is_refused:
        with pytest.raises(HistoryError, match=rf"table.csv:2: 'tr \(h\)' is 9.5, and 'duration \(h\)' is {duration}"):
            TEST_TABLE.read(path)
    else:
        assert TEST_TABLE.read(path)[0].rupture_time == pytest.approx(9.5 * 3600)
