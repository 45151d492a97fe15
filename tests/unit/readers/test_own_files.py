"""Files of laboratories that a new user brought, and others of their kinds: read right, or asked about."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.quality import remark_flags
from helpers.workbooks import workbook

C, MPA, STRAIN = "Temperature (C);600\n", "Stress (MPa);120\n", "Time (h);Strain (%)\n"


@pytest.fixture
def read(tmp_path):
    def one(text, name="x.csv", answers=""):
        (tmp_path / name).write_text(text, encoding="utf-8")
        (tmp_path / "tests.toml").write_text(answers, encoding="utf-8")
        return ck.read_histories(tmp_path / name)

    return one


def ends(tests):
    return [(one.temperature - 273.15, one.loading.steps[0][1], one.times[-1] / 3600, one.unruptured) for one in tests]


MATRIX = [(550, 235, 20.3, False), (550, 196, 132.3, False), (600, 196, 11.9, False), (550, 177, 6e4, True)]


def test_a_matrix_of_rupture_times_with_stresses_down_the_rows(read, tmp_path):
    """As the corner, the units of the cells or the heads above say; never stress for temperature."""
    rows = "235;20,3;-\n196;132,3;11,9\n177;(60000);-\n"
    for head in (
        "Time to rupture (h)\nStress (MPa) / Temperature (°C);550;600\n",
        "Bruchzeit in h\nSpannung in MPa;550 °C;600 °C\n",
        "Tempo a rottura (h)\nSforzo (MPa);Temperatura (°C);\n;550;600\n",
    ):
        np.testing.assert_allclose(ends(read(head + rows)), MATRIX)
    sheet = [["Rupture time, h"], ["σ (MPa) \\ T (°C)", 550, 600], [235, 20.3, None], [196, 132.3, 11.9]]
    tests = ck.read_histories(workbook(tmp_path / "m.xlsx", {"M": sheet}))
    np.testing.assert_allclose(ends(tests), MATRIX[:3])


PAUSED = "0;0\n10;0.1\n20;0.15\n{}0;0.15\n10;0.2\n15;0.22\n"
BETWEEN = ("", f"{STRAIN}", "restarted after a power cut;\n")


@pytest.mark.parametrize("between", BETWEEN)
def test_a_clock_that_begins_anew_is_asked_about(read, between):
    """Between two rows, in a block below another one, behind a remark: no reading vanishes."""
    text = C + MPA + STRAIN + PAUSED.format(between)
    with pytest.raises(HistoryError, match=r'its clock begins anew: .* parts = "joined" \(or parts = "separate"\)'):
        read(text)
    (test,) = read(text, answers='["*.csv"]\nparts = "joined"\n')
    np.testing.assert_allclose(test.times / 3600, [0, 10, 20, 30, 35])
    np.testing.assert_allclose(test.outputs["strain"], [0, 0.001, 0.0015, 0.002, 0.0022])
    tests = read(text, answers='["*.csv"]\nparts = "separate"\n')
    assert [(one.name, one.times.size) for one in tests] == [("x (1)", 3), ("x (2)", 3)]


def test_blocks_without_names_are_tests_of_their_own(read):
    block = "Stress {} MPa\nTime (h),Strain (%),Temp (C)\n0,0,650\n1,0.1,650\n5,0.3,650\n,,\n"
    tests = read(block.format(120) + block.format(140))
    assert [f"{one.name}: {one.condition}" for one in tests] == ["x (1): 650 °C, 120 MPa", "x (2): 650 °C, 140 MPa"]


RATES = "Test;T (C);Stress (MPa);min rate (1/h)\nC1;600;120;4e-5\nC2;600;110;2e-5\nC3;600;100;1e-5\nC4;600;90;5e-6\n"
CURVES = "C1 100 MPa;;C3 120 MPa;\nTime (h);Strain (%);Time (h);Strain (%)\n0;0;0;0\n1;.1;1;.2\n2;.15;2;.3\n"


def test_a_remark_that_names_a_test_is_of_that_test(read):
    for text in (
        f"Creep of P91 (do not use C3)\n{RATES}",
        f"{RATES}Note: C4 in vacuum; do not use C3.\n",
        f"{RATES}* do not use\n".replace("1e-5", "1e-5*"),
        f"Creep at 600 °C (C3 invalid: grip slipped)\n{CURVES}",
    ):
        assert [flag.tests[0].split(" ")[0] for flag in remark_flags(read(text))] == ["C3"], text
    assert not [*remark_flags(read(f"{RATES}\nC3 of another furnace\n"))]


def test_answers_to_single_tests(read):
    """By their names, in tables of both kinds; what is left out is listed with its reason."""
    for text, name in ((RATES, "C3"), (f"Creep at 600 °C\n{CURVES}", '"C3 120 MPa"')):
        of_test = f'["x.csv".tests.{name}]\n'
        tests = read(text, answers=f'{of_test}exclude = "grip slipped"\n')
        assert "C3" not in " ".join(one.name for one in tests)
        assert all(f"without {name.strip(chr(34))} (grip slipped)" in one.labels["assumed"] for one in tests)
        tests = {one.name[:2]: one for one in read(text, answers=f"{of_test}temperature_C = 605\n")}
        assert (tests["C1"].temperature, tests["C3"].temperature) == pytest.approx((873.15, 878.15))
        assert "temperature_C 605 of tests.toml" in tests["C3"].labels["assumed"]
    with pytest.raises(HistoryError, match=r"tests: tempreature_C is no key; did you mean 'temperature_C'\?"):
        read(RATES, answers='["x.csv".tests.C3]\ntempreature_C = 605\n')


@pytest.mark.parametrize("mark", ["n.d.", "buckled", "n/a", "nicht gemessen"])
def test_a_row_without_a_number_is_left_out_with_its_reason(read, mark):
    for text in (RATES.replace("1e-5", mark), RATES.replace("100", mark)):
        tests = read(text)
        assert [one.name for one in tests] == ["C1", "C2", "C4"]
        assert f"without C3 ('{mark}' in '" in tests[0].labels["assumed"]
    with pytest.raises(HistoryError):
        read(RATES.replace("1e-5", mark).replace("2e-5", mark).replace("4e-5", mark))


def test_cells_with_units_of_their_own(read):
    table = "Test;T (C);Stress (MPa);Rupture time\nA;600;120;1020 h\nB;600;130;3 days\nC;600;140;>45 min\n"
    np.testing.assert_allclose([one[2] for one in ends(read(table))], [1020, 72, 0.75])
    assert [one.unruptured for one in read(table)] == [False, False, True]
    (test,) = read(f"{C}{MPA}Time;Strain (%)\n30 s;0\n10 min;0,1\n2 h;0,2\n3 d;0,3\n")
    np.testing.assert_allclose(test.times, [30, 600, 7200, 259200])
    mixed = "Test;Temp;Stress;Rupture time (h)\nA;600 °C;120 MPa;1020\nB;873.15 K;15 ksi;72\nC;1112 °F;100 MPa;7 d\n"
    expected = [(600, 120, 1020, False), (600, 103.42, 72, False), (600, 100, 168, False)]
    np.testing.assert_allclose(ends(read(mixed)), expected, rtol=1e-4)
    for text in (table.replace("3 days", "72"), f"{C}{MPA}Time;Strain (%)\n30 s;0\n10 min;0,1\n2;0,2\n3 d;0,3\n"):
        with pytest.raises(HistoryError, match=r"is '\d+' without the unit of others; which is it\? .* columns = {"):
            read(text)


HEAD_OF_BAR = "{};CP12\n{} (mm);8,0\n{} (mm);40\n{} (°C);600\n{} (N);5026,55\n{};{}\n(h);(mm)\n0;0\n1;0,1\n10;0,2\n"
WORDS = {
    "Italian": ("Provino", "Diametro", "Lunghezza utile", "Temperatura", "Carico", "Tempo", "Allungamento"),
    "Spanish": ("Probeta", "Diámetro", "Longitud calibrada", "Temperatura", "Carga", "Tiempo", "Alargamiento"),
    "French": ("Éprouvette", "Diamètre", "Longueur utile", "Température", "Effort", "Temps", "Allongement"),
}


@pytest.mark.parametrize("language", WORDS)
def test_names_in_romance_languages_above_a_row_of_units(read, language):
    (test,) = read(HEAD_OF_BAR.format(*WORDS[language]))
    assert (test.name, test.temperature) == ("CP12", pytest.approx(873.15))
    assert test.loading.steps[0][1] == pytest.approx(100.0, rel=1e-5)
    np.testing.assert_allclose(test.outputs["strain"], [0, 0.0025, 0.005])


def test_tables_in_italian_and_spanish(read):
    tests = read("Sigla;Temp. (°C);Carico (MPa);Durata (h);Rottura\nA1;600;120;1200;sì\nA2;600;100;3000;no\n")
    assert ends(tests) == [(600, 120, 1200, False), (600, 100, 3000, True)]
    (test,) = read("Probeta;Temperatura (°C);Tensión (MPa);Velocidad mínima de fluencia (%/h)\nP1;600;120;1e-3\n")
    assert test.minimum_rate == pytest.approx(1e-5 / 3600)
    treated = "Acciaio rinvenuto a 730 °C\nSforzo (MPa);120\nTempo (h);Deformazione (%)\n0;0\n1;0,1\n"
    with pytest.raises(HistoryError, match="no temperature"):
        read(treated)


RELAXING = "Time (h);Residual stress (MPa);Residual stress (MPa)\n;500 °C;600 °C\n0;250;200\n1;220;150\n10;200;120\n"


def test_moduli_at_temperatures(read):
    """Each test has that of its temperature, in the head of one test as of several."""
    moduli = "E (500 °C);172 GPa\nYoung's modulus at 600 °C;160;GPa\n"
    for head, expected in (("Temperature;500 °C\n", 172e3), ("Temperature;550 °C\n", 166e3)):
        (test,) = read(f"{head}{moduli}{MPA}{STRAIN}0;0\n1;0,1\n2;0,15\n")
        assert test.elastic.E == pytest.approx(expected)
    tests = read(f"# E (500 °C): 172 GPa\n# E (600 °C): 160 GPa\n# strain_pct: 0.15\n{RELAXING}")
    assert [one.elastic.E for one in tests] == pytest.approx([172e3, 160e3])
    with pytest.raises(
        HistoryError, match=r"modulus is stated at 500 °C; how many GPa is it at 700 °C\? .*modulus_GPa"
    ):
        read(f"Temperature;700 °C\nE (500 °C);172 GPa\n{MPA}{STRAIN}0;0\n1;0,1\n")


def test_two_columns_of_one_stress_that_the_row_below_tells_apart(read):
    tests = read(f"Strain 0.15 %; E = 170 GPa\n{RELAXING}", answers='["x.csv"]\nstrain_pct = 0.15\n')
    assert [(one.specimen, round(one.temperature - 273.15)) for one in tests] == [
        ("relaxation", 500),
        ("relaxation", 600),
    ]
    assert [one.outputs["stress"][-1] for one in tests] == [200, 120]


def test_a_stress_that_alone_was_recorded_relaxed_under_a_strain_that_is_asked_for(read):
    """It was taken for a creep test under a stress that falls."""
    curve = "Time (h);Stress (MPa)\n0;250\n1;220\n10;180\n"
    with pytest.raises(HistoryError, match="a test whose strain was held, which is not stated"):
        read(C + curve)
    (test,) = read(f"{C}Hold strain;0,15 %\n{curve}")
    assert test.loading.quantity == "strain"


def test_digitised_points_a_click_out_of_order(read):
    points = f"{C}{MPA}{STRAIN}0;0\n1;0,1\n5,03;0,16\n{{}};0,15\n20;0,2\n100;0,4\n"
    (test,) = read(points.format("5,01"))
    np.testing.assert_allclose(test.times / 3600, [0, 1, 5.01, 5.03, 20, 100])
    np.testing.assert_allclose(test.outputs["strain"][2:4], [0.0015, 0.0016])
    assert "in order of time" in test.labels["assumed"]
    with pytest.raises(HistoryError, match="time falls"):
        read(points.format("3"))


@pytest.mark.parametrize(
    "comment", ["Fig. 4: 650 °C, 120 MPa", "P91 at 650 °C and 120 MPa", "Abb. 2: 650 °C\n# 120 MPa"]
)
def test_comments_above_a_table_state_conditions(read, comment):
    (test,) = read(f"# {comment}\n{STRAIN}0;0\n1;0,1\n")
    assert test.condition == "650 °C, 120 MPa"
    with pytest.raises(HistoryError, match="no temperature"):
        read(f"# tempered at 750 °C\n{MPA}{STRAIN}0;0\n1;0,1\n")


def test_footnotes_below_a_sheet_are_shown(tmp_path):
    sheet = [
        ["試験片番号", "試験温度 (°C)", "応力 (MPa)", "破断時間 (h)"],
        ["A1", 600, 120, 900],
        ["A2", 600, 100, 3000],
    ]
    notes = [["※ 大気中"], ["注) A2 は再試験"]]
    tests = ck.read_histories(workbook(tmp_path / "j.xlsx", {"S": [*sheet, *notes]}))
    assert "※ 大気中" in tests[0].labels.values()
    assert ["注) A2 は再試験" in one.labels.values() for one in tests] == [False, True]


def test_numbers_under_a_head_that_is_nearly_a_known_name_are_no_label(tmp_path):
    (tmp_path / "b1_creep.csv").write_text("time_h,deflection_mm\n0,0\n1,.1\n10,.3\n")
    for head, near in (("span_furlong", "span_mm"), ("widht_mm", "'width'")):
        (tmp_path / "index.csv").write_text(
            f"test,specimen,{head},load_N,temperature_C\nb1,three-point-bend,40,9,600\n"
        )
        with pytest.raises(HistoryError, match=near):
            ck.read_histories(tmp_path)


def test_compositions_in_another_sheet_are_labels_of_the_tests(tmp_path):
    """By alloy or by heat, below a title; what is of no test stays aside, and says so."""
    for key in ("Alloy", "Heat"):
        rates = [[key, "T (C)", "Stress (MPa)", "min rate (1/h)"], ["N1", 750, 200, 2e-4], ["N2", 750, 200, 6e-4]]
        contents = [["Chemical composition, wt.%"], [key, "Cr", "Ni"], ["N1", 15, "bal"], ["N2", 18, "bal"]]
        book = workbook(tmp_path / f"{key}.xlsx", {"Rates": rates, "Comp": contents, "Plan": [["to do"], ["next"]]})
        tests = ck.read_histories(book)
        assert [(one.labels["Cr"], one.labels["Ni"]) for one in tests] == [("15", "bal"), ("18", "bal")]
        assert f"sheet 'Comp' by its column '{key}'" in tests[0].labels["assumed"]
        assert "sheet 'Plan' not read" in tests[0].labels["assumed"]
