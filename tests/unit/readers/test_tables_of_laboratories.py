"""Tables with one row a test as laboratories write them: groups, heads, times to strains, marks of run-outs."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.quality import remark_flags
from creepkit.readers.questions import Question
from helpers.workbooks import workbook

HOUR = 3600.0


def read(tmp_path, text, encoding="utf-8", name="t.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return ck.read_histories(path)


def celsius(tests):
    return [round(float(one.temperature) - 273.15) for one in tests]


GROUPS = [
    (
        "Temp. (°C)\tStress (MPa)\ttr (h)\n600\t320\t4454\n\t260\t23220\n650\t320\t233\n\t260\t1112\n",
        [600, 600, 650, 650],
    ),
    ("T (C);Stress (MPa);tr (h)\n600;320;4454\n;260;23220\n;;\n650;320;233\n;260;1112\n", [600, 600, 650, 650]),
    ("Stress (MPa);tr (h);A (%)\n600 °C;;\n320;4454;21\n260;23220;21\n650 °C;;\n320;233;21\n", [600, 600, 650]),
    ("Creep rupture of X at 600 °C\n\nStress (MPa),tr (h)\n320,4454\n260,23220\n", [600, 600]),
    ("T (C);Stress (MPa);tr (h)\n600;320;4454\n″;260;23220\n650;320;233\n″;260;1112\n", [600, 600, 650, 650]),
    ("F,ksi,hr\nTemp,Stress,Rupture time\n1112,60,32190\n1202,45,312.9\n", [600, 650]),
    ("# Temp (F), Stress (ksi), Rupture time (hr)\n1112, 60, 32190\n1202, 45, 312.9\n", [600, 650]),
]


@pytest.mark.parametrize(("text", "temperatures"), GROUPS)
def test_temperatures_that_stand_once(tmp_path, text, temperatures):
    assert celsius(read(tmp_path, text)) == temperatures


def test_merged_cells_hold_for_their_rows(tmp_path):
    rows = [("T (C)", "Stress (MPa)", "tr (h)"), (600, 320, 4454), (None, 260, 23220), (650, 320, 233), (700, 260, 12)]
    path = workbook(tmp_path / "x.xlsx", {"r": rows}, lambda sheet: sheet.merge_cells("A2:A3"))
    tests = ck.read_histories(path)
    assert celsius(tests) == [600, 600, 650, 700]
    assert "temperature of the row above (empty cell)" in tests[1].labels["assumed"]


@pytest.mark.parametrize(
    "rows", ["600,320,44\n600,260,99\n,220,900\n", ",320,44\n600,260,99\n", "600,320,44\n600,,99\n"]
)
def test_a_lost_value_is_asked_for_with_its_cell(tmp_path, rows):
    with pytest.raises(Question, match=r"t\.csv:[234]: the cell of '.*' is empty; which (temperature|stress) is it\?"):
        read(tmp_path, f"T (C),Stress (MPa),tr (h)\n{rows}650,320,233\n650,300,433\n")


COLUMNS = [
    "t0.2% (h),t1% (h),tr (h)",
    "t(0.2%) h,t(1%) h,Life (hrs)",
    "Time to 0.2 % creep strain [h],Time to 1 % creep strain [h],Rupture time [h]",
    "Hours to 0.2%,Hours to 1%,Hours to rupture",
    "Zeit bis 0.2 % Dehnung (h),Zeit bis 1 % Dehnung (h),Bruchzeit (h)",
    "Temps à 0.2 % (h),Temps à 1 % (h),Temps à rupture (h)",
]


@pytest.mark.parametrize("names", COLUMNS)
def test_times_to_strains_are_frames(tmp_path, names):
    first, second = read(tmp_path, f"Temp (C),Stress (MPa),{names}\n550,200,120,1900,5200\n550,170,410,,>9000\n")
    assert first.outputs["strain"] == pytest.approx([0.002, 0.01])
    assert first.times == pytest.approx([120 * HOUR, 1900 * HOUR])
    assert (first.rupture_time, second.unruptured, second.times[-1]) == (5200 * HOUR, True, 9000 * HOUR)
    assert list(second.used) == [True, True, False]  # a creep strain of zero, 0.2 %, and the end


def test_a_name_above_several_columns(tmp_path):
    head = "Temp;Stress;Time to strain;;Rupture\n°C;MPa;0.2 %;1 %;time\n;;h;h;h\n"
    (one,) = read(tmp_path, f"{head}550;200;120;1900;5200\n")
    assert (list(one.times), one.rupture_time) == ([120 * HOUR, 1900 * HOUR], 5200 * HOUR)


def test_times_that_are_no_times_to_strains_are_asked_for_or_refused(tmp_path):
    with pytest.raises(
        HistoryError, match=r"'t0.2 \(h\)' is a time that is not understood; is it a time to a strain\?"
    ):
        read(tmp_path, "T (C),Stress (MPa),t0.2 (h),tr (h)\n550,200,120,5200\n")
    with pytest.raises(HistoryError, match="the larger strain is reached first; correct one of them"):
        read(tmp_path, "T (C),Stress (MPa),t0.2% (h),t0.5% (h),tr (h)\n550,200,420,300,5200\n")


@pytest.mark.parametrize(
    ("mark", "hours"),
    [(">23220", 23220), ("≥23220", 23220), ("23220+", 23220), ("23220 →", 23220), ("> 23.220,5", 23220.5),
     ("23220 (run-out)", 23220), ("23220 läuft", 23220), ("plus de 23220", 23220), ("über 23220", 23220)],
)  # fmt: skip
def test_marks_of_run_outs(tmp_path, mark, hours):
    tests = read(tmp_path, f"T (C);Stress (MPa);tr (h)\n600;320;4454\n600;260;{mark}\n")
    assert (tests[1].unruptured, tests[1].times[-1]) == (True, pytest.approx(hours * HOUR))


@pytest.mark.parametrize("cell", ["23220*", "(23220)", "23220†", "23220 abgestellt"])
def test_marks_are_asked_about_unless_a_note_explains_them(tmp_path, cell):
    table = f"T (C);Stress (MPa);tr (h)\n600;320;4454\n600;260;{cell}\n"
    with pytest.raises(Question, match="did this test break then"):
        read(tmp_path, table)
    sign = cell.replace("23220", "").strip()
    assert read(tmp_path, f"{table}\n{sign} = run-out\n")[1].unruptured


def test_a_note_of_tests_that_run_is_asked_about(tmp_path):
    with pytest.raises(Question, match="the note 'The last test is still running' may speak of tests"):
        read(tmp_path, "T (C),Stress (MPa),tr (h)\n600,320,4454\n600,260,23220\n\nThe last test is still running\n")


def test_a_title_an_encoding_and_decimal_commas(tmp_path):
    text = "Prüfprotokoll\n\nProbe;Temp. [°C];Spannung [MPa];min. Kriechrate [%/h];Bruchzeit [h];Bemerkung\n" \
           "K1;600;120,5;1,5e-04;900;\nK2;600;100;2,5e-05;>5000;läuft noch\n"  # fmt: skip
    first, second = read(tmp_path, text, "cp1252")
    assert (first.name, first.minimum_rate) == ("K1", pytest.approx(1.5e-6 / HOUR))
    assert (second.unruptured, second.labels["Bemerkung"]) == (True, "läuft noch")


def test_a_constant_rate_of_strain_is_recognised(tmp_path):
    """Strain in proportion to time with a stress that rises is imposed; negative ones are magnitudes of compression."""
    times = np.concatenate([np.arange(15) / 7, np.linspace(3, 70, 40)])
    stress = np.minimum(40e3 * 1e-2 * times, 112.0 * (1 + 0.01 * np.sin(40 * times)))
    for sign in (1, -1):
        rows = [f"{t:.2f};{sign * 1e-2 * t:.4f};{sign * s:.2f}" for t, s in zip(times, stress, strict=True)]
        head = "# temperature_C: 1000\n# strain_unit: 1\n# modulus_GPa: 40\ntime_s;True strain;stress_MPa\n"
        (tmp_path / "c.csv").write_text(head + "\n".join(rows))
        (one,) = ck.read_histories(tmp_path / "c.csv")
        assert (one.specimen, one.loading.quantity) == ("relaxation", "strain")
        np.testing.assert_allclose(one.loading.program().at(one.times), 1e-2 * times, atol=3e-3)
        np.testing.assert_allclose(one.outputs["stress"], stress, atol=0.01)
        assert "strain imposed, for its rate is constant" in one.labels["assumed"]
        assert ("magnitudes of negative stress and strain" in one.labels["assumed"]) == (sign < 0)
    creep = [f"{t:.2f};{1e-4 * t:.6f};{112.0 * (t > 0):.1f}" for t in times]
    (tmp_path / "c.csv").write_text(head + "\n".join(creep))
    assert ck.read_histories(tmp_path / "c.csv")[0].loading.quantity == "stress"


def test_remarks_of_tests_that_do_not_count(tmp_path):
    """Both with frames and without; pores and other voids are none."""
    excluded = ("voided joint (x-ray) - do not use", "void", "invalid test", "ungültig", "nicht verwenden", "à exclure")
    for remark in (*excluded, "void at the fracture surface", "failed in IMC", "used twice"):
        (tmp_path / "t.csv").write_text(
            f"test;T (C);stress_MPa;min rate (1/h);remarks\nA1;23;8;1e-6;\nA3;23;12;1e-5;{remark}\n"
        )
        tests = ck.read_histories(tmp_path / "t.csv")
        flags = list(remark_flags(tests))
        assert [flag.tests for flag in flags] == [("A3",)] * (remark in excluded), remark
        assert all('[[exclude]] test = "A3"' in str(flag) for flag in flags)
    framed = "# stress_MPa: 12\n# temperature_C: 600\n# label note: do not use\ntime_h;strain_pct\n0;0\n1;0.1\n2;0.15\n"
    (tmp_path / "f.csv").write_text(framed)
    assert [flag.kind for flag in ck.check_data_quality(ck.read_histories(tmp_path / "f.csv"))] == ["remark"]
