"""Heads as laboratories write them: German words, titles above tables of conditions, values in merged heads."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from helpers.workbooks import workbook

GERMAN = """# Zeitstandversuch DIN EN ISO 204;;;;
# Prüfer: Müller;;;;
Prüfspannung (MPa);110,0;;;
Prüftemperatur (°C);620;;;
Charge;K7;;;

Datum;Zeit;Dehnung;Last;T1
;h;%;kN;°C
03.03.2024 08:00;0,00;0,0000;8,639;620,4
03.03.2024 21:19;13,33;0,0245;8,639;619,7
04.03.2024 14:51;30,85;0,0400;8,639;619,7

Versuch beendet, planmäßig;;;;
"""


def test_a_german_table(tmp_path: Path) -> None:
    file = tmp_path / "P1.csv"
    file.write_text(GERMAN, encoding="latin-1")
    (test,) = ck.read_histories(file, ignore=["Datum", "Last", "T1"])
    assert test.loading.program().values.tolist() == [110.0]
    assert test.temperature == pytest.approx(893.15)
    np.testing.assert_allclose(test.times, [0, 13.33 * 3600, 30.85 * 3600])
    np.testing.assert_allclose(test.outputs["strain"], [0, 2.45e-4, 4e-4])
    assert (test.labels["heat"], test.labels["operator"], test.operator) == ("K7", "Müller", "")


def test_titles_above_conditions_and_remarks_beside_frames(tmp_path: Path) -> None:
    conditions = [["Program Z, 2024"], [], ["Test", "Stress (MPa)", "Temperature (°C)"], ["Z1", 120, 650]]
    frames = [["Test Z1"], ["Time (h)", "Creep strain (%)", "Remark"], [0, 0.0, "start"], [1, 0.01], [5, 0.02]]
    file = workbook(tmp_path / "program.xlsx", {"Summary": conditions, "Z1": frames})
    (test,) = ck.read_histories(file, ignore=["Remark"])
    assert (test.loading.program().values.tolist(), test.temperature) == ([120.0], 923.15)
    with pytest.raises(HistoryError, match=r"sheet 'Z1', row 2: column 'Remark' is not understood"):
        ck.read_histories(file)


def test_values_with_units_above_pairs_are_conditions(tmp_path: Path) -> None:
    head = ["120 MPa / 650 °C", None, None, "140 MPa / 923.15 K", None]
    names = ["Time (h)", "Creep strain (%)", None, "Time (h)", "Creep strain (%)"]
    rows = [head, names, *([t, 0.01 * t, None, t, 0.02 * t] for t in (0, 1, 2))]
    tests = ck.read_histories(workbook(tmp_path / "wide.xlsx", {"curves": rows}))
    assert [test.loading.program().values.tolist() for test in tests] == [[120.0], [140.0]]
    assert [test.temperature for test in tests] == [923.15, 923.15]
