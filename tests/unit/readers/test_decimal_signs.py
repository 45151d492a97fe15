"""The decimal sign of a table holds for all that stands in it: run-outs, steps and correlations too."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV
from creepkit.readers.tests_in_rows import TEST_TABLE
from helpers.workbooks import workbook

FRAMES = "# temperature_C: 800\n# control: load\n{}\ntime_h;strain_pct\n0;0\n100;0,5\n900;0,9\n"


@pytest.mark.parametrize("cell", [">10.000", "10.000", ">=10.000"])
def test_a_run_out_with_a_point_of_thousands_is_refused(tmp_path: Path, cell: str):
    path = tmp_path / "table.csv"
    path.write_text(f"test;stress_MPa;temperature_C;rupture (h)\nA1;120,5;750;8200,5\nA2;100,5;750;{cell}\n")
    with pytest.raises(HistoryError, match=r"table.csv:3: 'rupture \(h\)' is '10.000' with a point"):
        TEST_TABLE.read(path)
    path.write_text(path.read_text().replace(cell, cell.replace(".", ",")))
    duration = TEST_TABLE.read(path)[1].times[-1]
    assert duration == pytest.approx(36000.0)


@pytest.mark.parametrize(
    "line",
    [
        "# stress_steps: 0 s 100 MPa; 1.500 h 120 MPa",
        "# stress_steps: 0 s 1.000 MPa; 1 h 120 MPa",
        "# stress_program: 0 s 100 MPa; 1.500 h 120 MPa",
    ],
)
def test_steps_with_a_point_of_thousands_are_refused(tmp_path: Path, line: str):
    path = tmp_path / "bar.csv"
    path.write_text(FRAMES.format(line))
    with pytest.raises(HistoryError, match=r"bar.csv:3: .* with a point, while the table has decimal commas"):
        HISTORY_CSV.read(path)


def test_steps_with_decimal_commas_or_a_plain_point(tmp_path: Path):
    path = tmp_path / "bar.csv"
    for word in ("1,5", "1.5"):
        path.write_text(FRAMES.format(f"# stress_steps: 0 s 100 MPa; {word} h 120 MPa"))
        (history,) = HISTORY_CSV.read(path)
        np.testing.assert_allclose(history.loading.steps, [(0.0, 100.0), (5400.0, 120.0)])


def test_a_large_table_of_several_tests_keeps_its_decimal_commas(tmp_path: Path):
    path, times = tmp_path / "wide.csv", np.arange(6000) + 0.125
    rows = [f"{t:.3f};{t / 1e3:.4f};{t / 2e3:.4f}".replace(".", ",") for t in times]
    head = "# stress_MPa: 100\n# temperature_C: 800\ntime_h;A1 strain (%);A2 strain (%)\n"
    path.write_text(head + "\n".join(rows) + "\n")
    first, second = HISTORY_CSV.read(path)
    np.testing.assert_allclose(first.times, 3600 * times)
    np.testing.assert_allclose(second.outputs["strain"] * 100, times / 2e3, atol=6e-5)


def test_exponents_of_fortran_are_numbers(tmp_path: Path):
    path, times = tmp_path / "dip.dat", [0.0, 20.0, 24.1251, 137.5]
    for letter in "DdE":
        rows = [f" {t:.5E}  6.00000E+01  {1e-4 + 1e-6 * t:.5E}".replace("E", letter) for t in times]
        path.write_text(
            "# temperature_K: 673\n# control: stress\ntime_s stress_MPa strain_1\n" + "\n".join(rows) + "\n"
        )
        (history,) = HISTORY_CSV.read(path)
        np.testing.assert_array_equal(history.times, times)
        np.testing.assert_allclose(history.outputs["strain"], 1e-4 + 1e-6 * np.array(times), atol=1e-9)
        assert history.loading.steps == ((0.0, 60.0),)
    path.write_text("test;T (C);stress (MPa);min rate (1/h)\nA;600;1.2D+02;1.0d-05\n")
    (row,) = TEST_TABLE.read(path)
    assert row.minimum_rate == pytest.approx(1e-5 / 3600)
    assert row.loading.steps == ((0.0, 120.0),)


def test_texts_of_a_sheet_decide_about_their_decimal_sign(tmp_path: Path):
    head = [["Prüftemperatur", "540,5 °C"], ["E-Modul", "172,25 GPa"], ["Gesamtdehnung", "0,10 %"], ["Los", "3,004 kg"]]
    sheet = [*head, [], ["Zeit (h)", "Restspannung (MPa)"], [0, 170.5], [100.25, "151,5"], [1000, 128.5]]
    (history,) = ck.read_histories(workbook(tmp_path / "r.xlsx", {"Schraube": sheet}))
    assert history.temperature == pytest.approx(813.65)
    assert history.loading.program().values.tolist() == pytest.approx([0.001])
    assert history.elastic.at(history.temperature).E == pytest.approx(172250.0)
    assert history.outputs["stress"].tolist() == [170.5, 151.5, 128.5]
    np.testing.assert_allclose(history.times, [0.0, 360900.0, 3600000.0])
