"""Exports of testing machines: load and extension from the first second on, with the ramp in sight."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from helpers.command_line import creepkit

MODULUS, STRESS, RAMP = 155e3, 120.0, 60.0
AREA, LENGTH = 0.25 * math.pi * 8.0**2, 50.0
TIMES = np.concatenate([np.linspace(0.0, RAMP, 7), np.geomspace(90.0, 1.08e6, 40)])
LOAD = AREA * STRESS * np.minimum(TIMES / RAMP, 1.0)
CREEP = 2e-5 * np.maximum(TIMES - RAMP, 0.0) ** 0.4

ZWICK = (
    '"Prüfnorm";"DIN EN ISO 204"\n"Proben-Nr.";"ZK1"\n"Probendurchmesser d0";8,00;"mm"\n'
    '"Anfangsmesslänge Le";50,00;"mm"\n'
    '"Prüftemperatur";600;"°C"\n"Prüfkraft";6031,9;"N"\n\n"Prüfzeit";"Standardkraft";"Dehnung";"Probentemperatur"\n'
    '"s";"N";"mm";"°C"\n'
)
INSTRON = (
    '"Results Table 1"\n"Specimen label","BH1"\n"Diameter","8.00","mm"\n"Gauge length","50.00","mm"\n\n'
    '"Time","Load","Tensile extension","Temperature 1"\n"(sec)","(N)","(mm)","(C)"\n'
)
MTS = (
    "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n\nStation Name: Frame3\n\n"
    "Time\tAxial Force\tAxial Extensometer\tTemp Ctrl\nSec\tkN\tmm/mm\tdegC\n"
)


def _rows(columns: Sequence[np.ndarray], form: Callable[[float], str], separator: str) -> str:
    return "".join(separator.join(map(form, row)) + "\n" for row in zip(*columns, strict=True))


def _zwick(folder: Path, strain: np.ndarray) -> Path:
    columns = (TIMES, LOAD, LENGTH * strain, np.full(TIMES.size, 600.0))
    path = folder / "ZK1.TRA"
    path.write_text(ZWICK + _rows(columns, lambda x: f"{x:.6f}".replace(".", ","), ";"), encoding="latin-1")
    return path


def _instron(folder: Path, strain: np.ndarray) -> Path:
    columns = (TIMES, LOAD, LENGTH * strain, np.full(TIMES.size, 600.0))
    path = folder / "BH1.csv"
    path.write_text(INSTRON + _rows(columns, lambda x: f'"{x:.6f}"', ","))
    return path


def _mts(folder: Path, strain: np.ndarray) -> Path:
    columns = (TIMES, 1e-3 * LOAD, strain, np.full(TIMES.size, 600.0))
    path = folder / "bar_120MPa.txt"
    path.write_text(MTS + _rows(columns, lambda x: f"{x:.9f}", "\t"))
    return path


@pytest.mark.parametrize("export", [_zwick, _instron, _mts])
def test_the_elastic_strain_of_a_ramp_is_no_creep(tmp_path: Path, export: Callable[[Path, np.ndarray], Path]) -> None:
    noise = 1e-6 * np.random.default_rng(1).standard_normal(TIMES.size)
    (history,) = ck.read_histories(export(tmp_path, LOAD / AREA / MODULUS + CREEP + noise))
    assert history.includes_elastic
    assert history.elastic is not None
    assert history.elastic.E == pytest.approx(MODULUS, rel=0.02)
    assert history.loading.program().at(np.array([30.0, 1e5])) == pytest.approx([60.0, STRESS], rel=2e-3)
    assert history.temperature == pytest.approx(873.15)
    assert not history.used[TIMES < RAMP].any()
    assert history.used[TIMES >= RAMP].all()


def test_what_loading_left_beside_elastic_strain_is_subtracted(tmp_path: Path) -> None:
    ratio = LOAD / LOAD[-1]
    loading = LOAD / AREA / MODULUS + 2e-3 * np.maximum(ratio - 0.6, 0.0) ** 1.5
    (history,) = ck.read_histories(_zwick(tmp_path, loading + CREEP))
    assert not history.includes_elastic
    assert history.outputs["strain"][history.used] == pytest.approx(CREEP[TIMES >= RAMP], abs=1e-7)


def test_a_creep_strain_that_does_not_rise_with_the_load_is_left_as_it_is(tmp_path: Path) -> None:
    (history,) = ck.read_histories(_instron(tmp_path, CREEP))
    assert not history.includes_elastic
    assert history.used.all()
    assert history.outputs["strain"] == pytest.approx(CREEP, abs=1e-7)


TWO_BARS = {"Weg 1": "elongation (mm)", "Weg 2": "elongation (mm)"}


def _frame_with_a_pause(folder: Path, *, cold: int, lost: Sequence[int] = ()) -> ck.History:
    """P1, whose two transducers are tilted by 8 um, and whose furnace failed during `cold` readings from 100 h on."""
    times = np.sort(np.concatenate([TIMES, 360000.0 + 3600.0 * np.arange(1, cold + 1)]))
    off = (times > 360000.0) & (times <= 360000.0 + 3600.0 * cold)
    load = np.where(off, 0.0, AREA * STRESS * np.minimum(times / RAMP, 1.0))
    strain = load / AREA / MODULUS + 2e-5 * np.maximum(times - RAMP, 0.0) ** 0.4
    columns = (times, load, LENGTH * strain + 8e-3, LENGTH * strain - 8e-3, np.where(off, 180.0, 600.0))
    head = "Probendurchmesser;8.00;mm\nAnfangsmesslänge;50.00;mm\n\nZeit;Kraft;Weg 1;Weg 2;Temperatur\ns;N;mm;mm;°C\n"
    rows = _rows(columns, lambda x: f"{x:.6f}", ";").splitlines()
    rows = [
        ";".join([*row.split(";")[:2], "----", *row.split(";")[3:]]) if k in lost else row for k, row in enumerate(rows)
    ]
    (folder / "P1.csv").write_text(head + "\n".join(rows) + "\n")
    answers = ", ".join(f'"{name} (mm)" = "{what}"' for name, what in TWO_BARS.items())
    (folder / "tests.toml").write_text(f'["P1.csv"]\ncolumns = {{{answers}}}\n')
    return ck.read_histories(folder / "P1.csv")[0]


def test_two_transducers_are_asked_about_with_their_mean_first(tmp_path: Path) -> None:
    history = _frame_with_a_pause(tmp_path, cold=0)
    assert history.outputs["strain"] == pytest.approx(LOAD / AREA / MODULUS + CREEP, abs=1e-8)
    assert "mean of 'Weg 1 (mm)' and 'Weg 2 (mm)' (within 0.016 mm)" in history.labels["assumed"]
    (tmp_path / "tests.toml").unlink()
    with pytest.raises(ck.errors.HistoryError, match="does their mean count, or one") as asked:
        ck.read_histories(tmp_path / "P1.csv")
    assert list(asked.value.choices[0].values()) == [*TWO_BARS.values()]  # type: ignore[attr-defined]


def test_one_cold_reading_without_load_is_left_out_and_several_are_a_pause(tmp_path: Path) -> None:
    """No condition of the test is that of a furnace that failed, and when it cooled down needs no answer."""
    one, three = (_frame_with_a_pause(tmp_path, cold=cold) for cold in (1, 3))
    assert (one.temperature, one.times.size) == (pytest.approx(873.15), TIMES.size)
    assert "the reading without load at 101 h left out" in one.labels["assumed"]
    assert three.loading.program().at(np.array([3.65e5]))[0] == pytest.approx(0.0, abs=1.0)
    assert three.temperature.at(np.array([1e5, 3.68e5, 1e6])) == pytest.approx([873.15, 453.15, 873.15])  # type: ignore[union-attr]


def test_readings_without_a_value_are_left_out_and_listed(tmp_path: Path) -> None:
    history = _frame_with_a_pause(tmp_path, cold=0, lost=(20, 40))
    assert history.times.tolist() == np.delete(np.round(TIMES, 6), (20, 40)).tolist()
    assert "2 readings without a value of 'Weg 1 (mm)' left out (line 26; 46)" in history.labels["assumed"]


@pytest.mark.parametrize(("title", "included"), [("TOTAL STRAIN, PCT", True), ("CREEP STRAIN, PCT", False)])
def test_a_printout_has_its_units_under_their_names_and_says_in_its_title_which_strain(
    tmp_path: Path, title: str, included: bool
) -> None:
    rows = "".join(f"{k:4d}     {k * 10.0:.4E}   {0.1 + 0.01 * k:.4E}    600.8\n" for k in range(1, 9))
    text = f" SPECIMEN 7C   STRESS 190.0 MPA   {title}\n\n  NO       TIME         STRAIN     TEMP\n"
    (tmp_path / "RUN.dat").write_text(text + "          (HRS)        (PCT)      (C)\n" + rows)
    (history,) = ck.read_histories(tmp_path / "RUN.dat")
    assert history.times.tolist() == [36000.0 * k for k in range(1, 9)]
    assert history.outputs["strain"] == pytest.approx(1e-3 + 1e-4 * np.arange(1, 9))
    assert history.includes_elastic is included


def test_times_to_strains_under_bare_heads_of_a_french_table_and_an_end_in_a_word(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(
        "Tableau 4 : temps en heures pour un allongement de fluage;;;;;\nRepère;T (°C);σ (MPa);0,2 %;1 %;Rupture\n"
        "E1;600;200;110,5;1988,5;4971\nE3;600;165;262,7;>1500;non rompue à 1500 h\nE5;625;170;67,3;349,4;arrêt\n"
    )
    first, second, third = ck.read_histories(tmp_path / "t.csv")
    assert first.times.tolist() == pytest.approx([110.5 * 3600, 1988.5 * 3600])
    assert first.rupture_time == pytest.approx(4971 * 3600)
    assert [one.rupture_time for one in (second, third)] == [None, None]
    assert second.unruptured
    assert third.unruptured


def test_a_text_table_without_a_time_is_told_what_lacks_and_a_log_of_transducers_is_a_test(tmp_path: Path) -> None:
    """Not which readers there are, and not the record of an instrument."""
    (tmp_path / "b.txt").write_text("Creep of bar 3\nload  strain_pct stress_MPa\n1 0.0 100\n2 0.1 100\n")
    with pytest.raises(ck.errors.HistoryError, match="b.txt:2: missing column: no time among load, strain_pct, stress"):
        ck.read_histories(tmp_path / "b.txt")
    head = "Width,0.5,in\n\nElapsed (hh:mm:ss),Load (lbf),Ext A (in),Ext B (in)\n"
    (tmp_path / "SR-4.csv").write_text(head + "0:00:00,0,0,0\n0:00:01,9,1,1\n0:01:00,9,2,2\n")
    assert "'Ext A (in)' and 'Ext B (in)' seem to be sensors" in creepkit("read", tmp_path / "SR-4.csv").output


def test_a_run_out_whose_time_stands_in_a_remark_that_was_answered(tmp_path: Path) -> None:
    (tmp_path / "z.csv").write_text(
        "Probe;Prüftemp. in °C;σ in MPa;Bruchzeit in h;Bem.\nZ1;600;330;9783;\nZ4;600;200;n.b.;Laufzeit 40215 h\n"
    )
    (tmp_path / "tests.toml").write_text('["z.csv"]\nended = {"Laufzeit 40215 h" = "stopped"}\n')
    first, second = ck.read_histories(tmp_path / "z.csv")
    assert (first.temperature, first.rupture_time) == (pytest.approx(873.15), pytest.approx(9783 * 3600))
    assert second.unruptured
    assert second.times[-1] == pytest.approx(40215 * 3600)


HOURS = np.array([0.0, 1, 3, 10, 30, 100, 300])
CREPT = 1e-3 * (1.0 - np.exp(-HOURS / 20.0)) + 1e-5 * HOURS
REPORTS = {
    "symbols behind names": (
        '"Prüfkraft F";"6031,9";"N"\n"Durchmesser d0";"8,00";"mm"\n"Messlänge L0";"40,00";"mm"\n'
        '"Prüftemperatur T";"600";"°C"\n\n"Prüfzeit";"Extensometerweg"\n"h";"µm"\n',
        lambda t, e: f'"{t:.1f}";"{4e4 * e:.4f}"'.replace(".", ","),
    ),
    "names above values": (
        "Results 1\n,Specimen label,Creep stress (MPa),Temperature (C)\n1,B7,120.0,600\n\nTime,Strain\n(hr),(%)\n",
        lambda t, e: f"{t},{100 * e:.6f}",
    ),
    "keys behind the title of their line": (
        "Header:\t\tTime:\t0.51953\tSec\nStress:\t120\tMPa\nTemperature:\t600\tC\nTime\tAxial Strain\nSec\tmm/mm\n",
        lambda t, e: f"{3600 * t:.3f}\t{e:.9f}",
    ),
    "divisions of a dial gauge": (
        "Stress (MPa);120\nTemperature (C);600\nGauge length (mm);25\nTime (h);Extension (0.001 mm)\n",
        lambda t, e: f"{t};{25e3 * e:.5f}",
    ),
}


@pytest.mark.parametrize("kind", REPORTS)
def test_heads_of_reports(tmp_path: Path, kind: str) -> None:
    head, row = REPORTS[kind]
    rows = [row(float(t), float(e)) for t, e in zip(HOURS, CREPT, strict=True)]
    (tmp_path / "report.txt").write_text(head + "\n".join(rows) + "\n", encoding="utf-8")
    (history,) = ck.read_histories(tmp_path / "report.txt")
    assert history.times / 3600 == pytest.approx(HOURS)
    assert history.outputs["strain"] == pytest.approx(CREPT, abs=2e-8)
    assert history.temperature == pytest.approx(873.15)
    assert history.loading.program().values[-1] == pytest.approx(120.0, rel=1e-3)


def test_a_sheet_of_the_european_creep_committee(tmp_path: Path) -> None:
    """Symbols of ISO 204 for times to strains, codes of ends behind the name of their column, durations."""
    head = "Cast;Temp. (°C);Stress (MPa);Test duration (h);Status B / UB / I;tp0.2 (h);tf1 (h)\n"
    rows = "E1;600;180;1254;B;125;564\nE1;600;120;31044;UB;3104;\nE2;600;110;22345;I;2234;9000\n"
    (tmp_path / "E.csv").write_text(head + rows, encoding="utf-8")
    with pytest.raises(HistoryError, match="says 'I': did these tests break") as error:
        ck.read_histories(tmp_path / "E.csv")
    assert 'ended = {I = "stopped"}' in str(error.value)
    (tmp_path / "tests.toml").write_text('["E.csv"]\nended = {I = "stopped"}\n')
    tests = ck.read_histories(tmp_path / "E.csv")
    assert tests[0].rupture_time == 1254 * 3600
    assert [test.unruptured for test in tests] == [False, True, True]
    assert [test.times[-1] / 3600 for test in tests] == [564, 31044, 22345]
    assert tests[0].outputs["strain"] == pytest.approx([0.002, 0.01])
    (tmp_path / "E.csv").write_text((head + rows).replace("Status B / UB / I", "Column 5"), encoding="utf-8")
    (tmp_path / "tests.toml").unlink()
    with pytest.raises(HistoryError, match="says how long the test lasted, and nothing whether it broke"):
        ck.read_histories(tmp_path / "E.csv")


def test_rates_over_reciprocal_temperatures(tmp_path: Path) -> None:
    """The digitised points of an Arrhenius plot."""
    kelvin, rates = (823.15, 873.15, 923.15), (1e-10, 2e-9, 3e-8)
    rows = "".join(f"{1e4 / T:.6f},100,{math.log10(rate):.6f}\n" for T, rate in zip(kelvin, rates, strict=True))
    (tmp_path / "p.csv").write_text(f"10^4/T (1/K),Stress (MPa),log10 creep rate (1/s)\n{rows}")
    tests = ck.read_histories(tmp_path / "p.csv")
    assert [test.temperature for test in tests] == pytest.approx(kelvin, abs=1e-3)
    assert [test.minimum_rate for test in tests] == pytest.approx(rates, rel=1e-5)


@pytest.mark.parametrize(
    "title", ["Creep test 7, 120 MPa, 600 C", "Alloy 617, 600 °C, 120 MPa", "[Inconel 625], 600 C, 120 MPa"]
)
def test_the_number_of_a_test_or_an_alloy_is_no_range(tmp_path: Path, title: str) -> None:
    rows = "".join(f"{t};{100 * e:.6f};{100 * e + 0.1:.6f}\n" for t, e in zip(HOURS, CREPT, strict=True))
    (tmp_path / "a.csv").write_text(
        f"[Data]\n{title}\nTime (h);Creep strain (%);Total strain (%)\n{rows}", encoding="utf-8"
    )
    (history,) = ck.read_histories(tmp_path / "a.csv")
    assert (history.temperature, history.loading.program().values[-1]) == (873.15, 120.0)
    assert history.outputs["strain"] == pytest.approx(CREPT, abs=1e-8)
    assert "'Creep strain (%)' counts and not 'Total strain (%)'" in history.labels["assumed"]


def test_readings_behind_a_rupture_are_asked_of(tmp_path: Path) -> None:
    said = {2: "broke", 6: ""}
    rows = "".join(f"{t};{100 * e:.4f};{said.get(k, '')}\n" for k, (t, e) in enumerate(zip(HOURS, CREPT, strict=True)))
    (tmp_path / "a.csv").write_text(f"Stress (MPa);120\nTemperature (C);600\nTime (h);Strain (%);Remarks\n{rows}")
    with pytest.raises(HistoryError, match="'broke' in line 6 says that the test broke, and readings follow"):
        ck.read_histories(tmp_path / "a.csv")
    (tmp_path / "tests.toml").write_text('["a.csv"]\nended = {broke = "label"}\n')
    (history,) = ck.read_histories(tmp_path / "a.csv")
    assert history.rupture_time is None
