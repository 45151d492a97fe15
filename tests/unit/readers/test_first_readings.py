"""Files as laboratories keep them, whose first reading went wrong: each is read right, or asked about."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.questions import SeveralErrors
from helpers.command_line import creepkit

SHEET = "Éprouvette;Température (°C);Contrainte (MPa);Déformation (%);Temps (h);Observations\n"
LOGARITHMS = "Specimen,T (C),stress (MPa),log10(t_r/h),lg(minimum rate) (1/h)\nA1,600,200,2.5,-4\nA2,600,160,3,-5\n"
HEAD = "Time (h),Strain (%),Temp (C)\n"
BLOCKS = (
    f"Specimen A,,\nStress 120 MPa,,\n{HEAD}0,0,650\n1,0.1,650\n5,0.3,650\n,,\n"
    f"Specimen B,,\nStress 140 MPa,,\n{HEAD}0,0,650\n1,0.2,650\n5,0.5,650\n"
)
LISTING = """ LAB 3    RUN LISTING   PAGE 1
 TEST NO {}   STRESS {} N/MM2   TEMP 550 C

   DATE    TIME     HOURS    TEMP   STRAIN,%
 03/02/84  09:15      0.00   550.0    0.0000
 03/02/84  19:15     10.00   550.5    0.0200
 LAB 3    RUN LISTING   PAGE 2
 04/02/84  09:15     24.00   550.4    0.0300
 *** END OF TEST - UNLOADED
"""
TUBES = (
    "# specimen: tube\n# includes_elastic: no\n"
    "Specimen,OD (mm),Wall thickness (mm),Pressure (MPa),T (C),Time (h),diameter_growth_mm\n"
    + "".join(f"T1,9.5,0.5,10,400,{time},{time / 1e4}\n" for time in (0, 10, 100))
    + "".join(f"T2,11.2,0.5,10,400,{time},{time / 1e4}\n" for time in (0, 10, 100))
)


@pytest.fixture
def read(tmp_path):
    def one(text, name="x.csv"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return ck.read_histories(tmp_path / name)

    return one


def test_a_strain_and_its_time_in_the_row_of_a_test_are_no_frames(read):
    """They are how far it went; where no remark says whether it broke then, that is asked for."""
    tests = read(SHEET + "E1;600;180;5,2;1200;rompu\nE2;650;120;3,3;900;arrêté avant rupture\n")
    assert [(one.rupture_time, one.unruptured) for one in tests] == [(1200 * 3600.0, False), (None, True)]
    with pytest.raises(HistoryError, match=r"x.csv:2 \(and 1 more\): 'Temps \(h\)' .* ended = \"ruptured\" \(or ended"):
        read(SHEET.replace(";Observations", "") + "E1;600;180;5,2;1200\nE2;650;120;3,3;900\n")


def test_a_clock_that_begins_just_before_zero(read):
    (test,) = read("# temperature_C: 850\n# stress_MPa: 60\ntime_s,strain_pct\n-0.5,0\n100,.1\n900,.3\n")
    assert test.times[0] == 0.0
    assert "times just below zero are zero" in test.labels["assumed"]


def test_numbers_of_frames_and_a_low_temperature_in_a_title(read):
    rows = "".join(f"{k},{k / 4},90,{k / 10}\n" for k in range(1, 7))
    (test,) = read("Kriechversuch bei 30 °C\nFrame,Time (h),Stress (MPa),Strain (%)\n" + rows)
    assert (test.condition, "'Frame' numbers the readings" in test.labels["assumed"]) == ("30 °C, 90 MPa", True)


def test_logarithms(read):
    first, second = read(LOGARITHMS)
    assert (first.rupture_time, second.rupture_time) == (pytest.approx(10**2.5 * 3600), 3.6e6)
    assert first.minimum_rate == pytest.approx(1e-4 / 3600)
    assert "'log10(t_r/h)' is a decimal logarithm" in first.labels["assumed"]
    with pytest.raises(HistoryError, match="is a rate that is not understood; is it a minimum creep rate?"):
        read(LOGARITHMS.replace("minimum rate", "strain rate"))


@pytest.mark.parametrize("head", ["rate/h-1", "rate / h⁻¹", "rate/(1/h)", "Kriechrate / h^-1", "log10(rate/h-1)"])
def test_units_behind_a_stroke_as_din_1313_and_iupac_write_them(read, head):
    rate = -5.0 if head.startswith("log") else 1e-5
    tests = read(f"No.;T/°C;sigma/MPa;{head}\n1;600;80;{rate}\n2;600;90;{rate}\n")
    assert [one.minimum_rate for one in tests] == [pytest.approx(1e-5 / 3600)] * 2
    (test,) = read("Creep at 600 °C and 80 MPa\nt/(h);ε / 10⁻²\n0;0\n1;0.5\n2;0.75\n")
    np.testing.assert_allclose(test.outputs["strain"], [0.0, 0.005, 0.0075])


def test_blocks_below_one_another(read):
    tests = read(BLOCKS)
    assert [f"{one.name}: {one.condition}" for one in tests] == ["A: 650 °C, 120 MPa", "B: 650 °C, 140 MPa"]
    pages = read(LISTING.format(4471, 120) + LISTING.format(4472, 150).replace(" LAB 3    RUN LISTING   PAGE 1\n", ""))
    found = [f"{one.name}: {one.condition}, {one.times[-1] / 3600:g} h" for one in pages]
    assert found == ["4471: 550 °C, 120 MPa, 24 h", "4472: 550 °C, 150 MPa, 24 h"]


def test_one_answer_for_all_files_of_a_folder(tmp_path):
    for name in ("A1.csv", "A2.csv", "B9.csv"):
        (tmp_path / name).write_text("Temp (C),Time (h),Strain (%)\n600,0,0\n600,1,0.1\n600,5,0.2\n")
    with pytest.raises(HistoryError, match=r"A1.csv \(and 2 files more\): no loading .*: \[\"\*.csv\"\] stress_MPa = "):
        ck.read_histories(tmp_path)
    (tmp_path / "tests.toml").write_text('["*.csv"]\nstress_MPa = 120\n')
    assert [one.condition for one in ck.read_histories(tmp_path)] == ["600 °C, 120 MPa"] * 3


def ramp_and_creep(frames_of_ramp, modulus):
    """Frames of a preload of six minutes, a ramp of one minute, and creep under 120 MPa; h, MPa, strain."""
    ramp = np.linspace(0.0, 1.0, frames_of_ramp + 1)[1:]
    after = np.geomspace(0.2, 200.0, 40)
    times = np.concatenate([[0.0, 0.05, 0.1], 0.1 + ramp / 60.0, after])
    stress = np.concatenate([[0.7] * 3, 0.7 + 119.3 * ramp, np.full(after.size, 120.0)])
    creep = 1e-3 * np.maximum(times - 0.1 - 1 / 60, 0.0) ** 0.4
    return times, stress, stress / modulus + creep, creep


@pytest.mark.parametrize("frames_of_ramp", [1, 10])
def test_a_preload_and_a_ramp_are_no_creep(read, frames_of_ramp):
    """Time counts from the end of the preload; the strain of loading is told from creep by the record of the load."""
    times, stress, strain, creep = ramp_and_creep(frames_of_ramp, 150e3)
    rows = "".join(f"{t:.6f},{s:.3f},{e:.9f}\n" for t, s, e in zip(times, stress, strain, strict=True))
    (test,) = read("# temperature_C: 600\nTime (h),Stress (MPa),Strain (1)\n" + rows)
    assert test.times[0] == 0.0
    assert "the end of a preload of 0.7 MPa at 360 s" in test.labels["assumed"]
    elastic = 120.0 / test.elastic.E if test.includes_elastic else 0.0
    assert test.includes_elastic == (frames_of_ramp == 10)
    np.testing.assert_allclose((test.outputs["strain"] - elastic)[test.used][-30:], creep[-30:], atol=2e-6)


def test_tubes_of_several_diameters(read):
    """Growth that was read after unloading gets the elastic part of Lame's thick tube with closed ends."""
    assert "the elastic part in diameter_growth all the same; no modulus" in read(TUBES)[0].labels["assumed"]
    tests = read("# modulus_GPa: 75\n" + TUBES)
    assert [(one.name, one.geometry["outer_diameter"]) for one in tests] == [("T1", 9.5), ("T2", 11.2)]
    for test, outer in zip(tests, (9.5, 11.2), strict=True):
        lame = 10.0 * (outer - 1.0) ** 2 * outer * (2 - 0.3) / (75e3 * (outer**2 - (outer - 1.0) ** 2))
        added = test.outputs["diameter_growth"] - test.times / 3600e4
        np.testing.assert_allclose(added, [0, lame, lame], rtol=0.01)
    with pytest.raises(HistoryError, match='specimen = "tube" \\(or specimen = "open-tube"\\)'):
        read(TUBES.replace("# specimen: tube\n", ""))


@pytest.mark.parametrize(("column", "first"), [("Tube", "T"), ("Joint", "J-"), ("Probe Nr.", ""), ("Bar", "B")])
def test_names_of_tests_whatever_they_are_called(read, tmp_path, column, first):
    """Their cells change where time falls; in the order of time, and in rows of tests, an answer or the words tell."""
    rows = [f"{first}{k};600;{100 + 10 * k};{t};{k * t / 1e3}\n" for k in (1, 2) for t in (0, 10, 100)]
    head, names = f"{column};T (C);Stress (MPa);Time (h);Strain (%)\n", [f"{first}1", f"{first}2"]
    assert [one.name for one in read(head + "".join(rows))] == names
    if first:
        assert [
            one.name for one in read(head.split("Time")[0] + f"Rupture (h)\n{rows[1][:-6]}\n{rows[5][:-5]}\n")
        ] == names
    (tmp_path / "tests.toml").write_text(f'["*.csv"]\ncolumns = {{"{column}" = "test"}}\n')
    assert [one.name for one in read(head + "".join(sorted(rows, key=lambda row: float(row.split(";")[3]))))] == names


def test_points_of_a_plot(tmp_path):
    """Sets side by side, in the order of the clicks, the first left of the axis."""
    text = "650C 100MPa,,650C 120MPa,\nX,Y,X,Y\n-0.5,0,-0.5,0\n60,0.4,90,0.9\n30,0.2,40,0.5\n"
    (tmp_path / "fig7.csv").write_text(text)
    with pytest.raises(HistoryError, match="'X' and 'Y' are columns of a plot") as caught:
        ck.read_histories(tmp_path)
    (tmp_path / "tests.toml").write_text(f'["*.csv"]\n{caught.value.entry(caught.value.choices[0])}\n')
    first, second = ck.read_histories(tmp_path)
    assert (first.condition, second.condition) == ("650 °C, 100 MPa", "650 °C, 120 MPa")
    np.testing.assert_allclose(second.outputs["strain"], [0.0, 0.005, 0.009])


READINGS = "0,{0}9.502\n100,{0}9.521\n1000,{0}9.564\n"
TUBE = "# pressure_MPa: 12\n# temperature_C: 400\n# thickness_mm: 0.57\n# specimen: tube\n"


@pytest.mark.parametrize("name", ["D1 (mm)", "Diameter (mm)", "OD (mm)", "mittlerer Durchmesser (mm)"])
def test_diameters_of_a_tube_are_its_growth(read, name):
    """From the first reading on, at time zero; what begins far from the stated diameter is asked about."""
    stated, rows = TUBE + "# outer_diameter_mm: 9.5\n", f"Time (h),{name}\n" + READINGS
    (test,) = read(stated + rows.format(""))
    np.testing.assert_allclose(test.outputs["diameter_growth"], [0.0, 0.019, 0.062], atol=1e-12)
    with pytest.raises(HistoryError, match=r'begins at 29.502 mm, which is no outer_diameter; .* "diameter_growth'):
        read(stated + rows.format(2))
    (alone,) = read(TUBE + rows.format(""))
    assert alone.geometry["outer_diameter"] == 9.502
    with pytest.raises(HistoryError, match=r"before the test, which is not stated.*outer_diameter_mm = 9.502"):
        read(TUBE + rows.format("").replace("\n0,", "\n10,"))


def test_relative_growths_and_diameters_of_bars(read):
    """Of a bar at constant volume (1 + strain) d^2 = d0^2; two columns under two pressures are two tubes."""
    (tube,) = read(TUBE + "# outer_diameter_mm: 9.5\nTime (h),Hoop strain (%)\n0,0\n100,0.2\n")
    assert tube.outputs["diameter_growth"][-1] == pytest.approx(0.019)
    with pytest.raises(HistoryError, match="of a tube under internal pressure, not of a bar; which specimen"):
        read("# stress_MPa: 60\n# temperature_C: 400\nTime (h),Hoop strain (%)\n0,0\n100,0.2\n")
    with pytest.raises(HistoryError, match="is of shear.*Internal pressure .* = .pressure"):
        read("# temperature_C: 400\nTime (h),Shear strain (-),Internal pressure (MPa)\n0,0,12\n100,0.2,12\n")
    bar = "# stress_MPa: 60\n# temperature_C: 700\n# specimen: uniaxial\n# diameter_mm: 10\nTime (h),Diameter (mm)\n"
    (test,) = read(bar + "0,10.01\n9,9.91\n")
    assert test.outputs["strain"][-1] == pytest.approx((10.01 / 9.91) ** 2 - 1.0)
    tubes = "OD (mm),9.5,9.5\nWall (mm),1,1\nTemp (C),400,400\nPressure (MPa),12,{}\nTime (h),D1 (mm),D2 (mm)\n"
    tubes = TUBE.splitlines()[-1] + "\n" + tubes + "0,9.5,9.5\n9,9.52,9.51\n"
    said = [f"{one.condition}: {one.outputs['diameter_growth'][-1]:.3g}" for one in read(tubes.format(10))]
    assert said == ["400 °C, 12 MPa: 0.02", "400 °C, 10 MPa: 0.01"]
    with pytest.raises(HistoryError, match="no conditions above each, may be tests or sensors of one"):
        read(tubes.format(12))


def test_thermal_expansion_at_steps_of_temperature(read, tmp_path):
    """Steps of 20 K multiply rates by 2.5, and 14e-6/K is planted: told, and taken off; a step of rate alone is not."""
    hours, rng = np.arange(0.0, 300.1, 5.0), np.random.default_rng(2)
    levels = np.minimum(hours // 100, 2)
    creep = np.interp(hours, [0, 100, 200, 300], 1e-4 * np.cumsum([0, 1, 2.5, 6.25]))
    rows = [creep + 14e-6 * 20 * part * levels + 2e-6 * rng.standard_normal(hours.size) for part in (0, 1)]
    texts = (
        "".join(f"{t},{600 + 20 * k},{100 * max(e, 0)}\n" for t, k, e in zip(hours, levels, one, strict=True))
        for one in rows
    )
    plain, expanded = (read("# stress_MPa: 90\nTime (h),Temp (C),Strain (%)\n" + text, "a.csv") for text in texts)
    assert ck.check_data_quality(plain).flags == ()
    (flag,) = ck.check_data_quality(expanded)
    assert "at 100 h; 200 h, as the temperature does by +20 K, +20 K: thermal expansion of about 1.4e-05/K" in str(flag)
    for line in ('thermal_expansion = "14e-6 1/K"', "thermal_expansion = 14e-6", 'steps_taken_off = "100 h; 200 h"'):
        (tmp_path / "tests.toml").write_text(f'["a.csv"]\n{line}\n')
        (test,) = ck.read_histories(tmp_path / "a.csv")
        np.testing.assert_allclose(test.outputs["strain"], creep, atol=2e-5)
    (tmp_path / "tests.toml").write_text('["a.csv"]\nthermal_expansion = "14 K"\n')
    with pytest.raises(HistoryError, match="is '14 K'; write it per kelvin, such as 14e-6 1/K"):
        ck.read_histories(tmp_path / "a.csv")


TABLES = {
    "Instron": (
        "Test temperature,1200,(F)\nTime,Extension,Tensile strain (Extensometer),Tensile stress\n(s),(mm),(%),(MPa)\n"
        "0,0,0,690\n60,0.1,0.4,690\n3600,0.2,0.5,690\n",
        "649 °C, 690 MPa",
    ),
    "thesis": (
        "sample,,A3 (750C 200MPa),,B1 (750C 250MPa)\n,t [h],ε [%],t [h],ε [%]\n,0,0,0,0\n,1,0.05,1,0.11\n",
        "750 °C, 200 MPa",
    ),
    "Japan": (
        "試験片番号,N-12\n試験温度(℃),650\n応力(MPa),120\n時間(h),クリープひずみ(%)\n0,0\n9,0.1\n",
        "650 °C, 120 MPa",
    ),
    "Denison": ("Temp (C),565\nStress,12 tsi\nHours,Strain %\n0,0\n9,0.1\n", "565 °C, 185.331 MPa"),
}
"""{laboratory: a file as it writes them, and the conditions of its first test}."""


@pytest.mark.parametrize(("text", "condition"), TABLES.values(), ids=TABLES)
def test_tables_of_further_laboratories(read, text, condition):
    assert read(text)[0].condition == condition


def test_three_thermocouples_are_one_question(read):
    names = ('"Temperatur oben (°C)"', '"Temperatur Mitte (°C)"', '"Temperatur unten (°C)"')
    head = f'"Prüfspannung";"120";"MPa"\n"Zeit (h)";"Dehnung (%)";{";".join(names)}\n'
    with pytest.raises(
        HistoryError, match="csv:2: 'Temperatur oben .* and 'Temperatur Mitte .* seem to be sensors"
    ) as said:
        read(head + "0,0;0,0;600,1;600,2;599,8\n1,0;0,1;600,1;600,1;599,9\n")
    assert not isinstance(said.value, SeveralErrors)


def test_what_is_not_there_and_what_is_no_record_are_told(tmp_path):
    """A strain beside times of a clock is a test, and no record of an instrument whose columns nobody asks about."""
    assert "no such file or folder" in creepkit("read", tmp_path / "no.csv").output
    (tmp_path / "d.csv").write_text("Date,Time,Hours,Strain % x 10^-3\n12/01/1998,09:30,0,0\n13/01/1998,09:30,24,64\n")
    assert creepkit("read", tmp_path / "d.csv").exit_code == 1


C, MPA, STRAIN = "Temperature;550;°C\n", "Stress;140;MPa\n", "Time (h);Strain (%)\n"
BAR = C + "Diameter;8;mm\nGauge length;50;mm\n"
RAMP = "Time (s);Stress (MPa);Strain (%)\n0;0;0\n10;28;0,017\n20;56;0,034\n30;84;0,051\n40;112;0,069\n50;140;0,1\n"
FEW = f"E;170;GPa\n{MPA}{STRAIN}0;0,085\n24;0,12\n100;0,2\n250;0,32\n500;0,5\n1000;0,85\n2000;1,6\n"
TOTAL = f"{MPA}E;170;GPa\nLoading strain (%);0,1\nTime (h);Total strain (%)\n0;0,1\n1;0,13\n10;0,28\n100;1,3\n"


CREEP = [
    (FEW, 0.00085, 0.016, True),
    (RAMP + "60;140;0,11\n3600;140;0,15\n36000;140;0,3\n360000;140;1\n", -0.001, 0.009, False),
    (f"{MPA}{STRAIN}0;-0,3\n1;-0,25\n10;-0,1\n100;0,6\n", 0.0, 0.009, False),  # a transducer that was not zeroed
    (f"{MPA}{STRAIN}0;0\n0;0,08\n1;0,13\n10;0,28\n100;0,98\n", 0.0008, 0.0098, False),  # before and after loading
    (TOTAL, 0.0, 0.012, False),
]


def test_what_of_a_strain_is_creep(read):
    for text, first, last, is_elastic in CREEP:
        (test,) = read(C + text)
        strain = test.outputs["strain"]
        assert (test.includes_elastic, strain[0], strain[-1]) == pytest.approx((is_elastic, first, last))


ASKED = {
    f"{BAR}Load;7037;N\nStress;120;MPa\nTime (h);Extension (mm)\n0;0\n1;0,05\n": r"makes 140 MPa .* says 120 MPa",
    f"{BAR}Load;12;kg\nLever ratio;10\nTime (h);Extension (mm)\n0;0\n1;0,05\n": "'Lever ratio' leaves open whether",
    f"{BAR}Compliance;0,02\nTime (h);Load (N);Extension (mm)\n0;70;0\n1;70;0,2\n": "'Compliance' leaves open whether",
    "Test;Stress (MPa);T (C);t_r (h);Specimen\nA;140;550;800;smooth\nB;140;550;900;notched Kt=3\n": "'notched Kt=3'",
    f"{C}{MPA}Test type;constant stress\n{STRAIN}0;0\n9;0,2\n": "true stress held, or the load",
    "Test;Stress (MPa);T (C);t_r (h)\nA;140;550;123\nB;120;550;12.345\nC;110;550;23.456\n": "may be 12.345 or 12345",
    f"{C}E;160;GPa\nTime (h);Remaining stress (MPa)\n0;200\n1;180\n": "strain was held, .* strain_pct = 0.125",
    f"{C}{MPA}Part;{STRAIN}1;0;0\n1;9;0,2\n2;0;0,2\n2;9;0,3\n": "'Part' numbers parts whose clock begins anew",
}


def test_what_a_file_leaves_open_is_asked(read):
    for text, asked in ASKED.items():
        with pytest.raises(HistoryError, match=asked):
            read(text)


CLOCKS = {"(dd:hh:mm)": ("0:00:00", "4:04:00", 100), "(hh:mm)": ("00:30", "100:30", 100), "(s)": (17e8, 17e8 + 3600, 1)}


def test_times_of_clocks_and_calendars(read):
    for unit, (start, end, hours) in CLOCKS.items():
        (test,) = read(f"{MPA}{C}Time {unit};Strain (%)\n{start};0\n{end};0.1\n")
        assert test.times[-1] - test.times[0] == pytest.approx(3600.0 * hours)


def test_lost_readings_pauses_and_extrapolated_points(read):
    rows = "".join(f"{10 * k};{k / 60};{550.3 - 0.5 * (k % 2) if k != 17 else 0}\n" for k in range(60))
    (test,) = read(f"{MPA}Time (h);Strain (%);Temperature (°C)\n{rows}")
    assert test.mean_temperature == pytest.approx(823.2, abs=0.1)
    pause = "0;140;0\n1;140;0.05\n10;140;0.2\n10;0;0.11\n20;0;0.1\n20;140;0.19\n30;140;0.3\n100;140;0.9\n"
    (test,) = read(f"{C}Time (h);Stress (MPa);Strain (%)\n{pause}")
    assert test.loading.steps == ((0.0, 140.0), (36000.0, 0.0), (72000.0, 140.0))
    (test,) = read(f"{C}{MPA}Time (h);Strain (%);Remark\n0;0;\n9;0.2;\n99;0.9;\n999;4;extrapolated\n")
    assert test.used.tolist() == [True, True, True, False]


@pytest.mark.parametrize("footers", ["Mean;0,3\nMin rate;1e-5", "Bruch nach;105 h", "REMOVED UNBROKEN"])
def test_rows_below_the_readings_that_begin_with_words_are_remarks(read, footers):
    (test,) = read(f"Stress (MPa);80\nTemperature (°C);600\nTime (h);Strain (%)\n0;0\n1;0,5\n100;0,75\n{footers}\n")
    assert (test.times[-1], test.outputs["strain"][-1]) == (360000.0, 0.0075)
    assert (test.rupture_time, test.unruptured) == (105 * 3600.0 if "105" in footers else None, "UN" in footers)


LOADED = "Time (h);Stress (MPa);Strain (%);Note\n0;140;0;\n1;140;0,05;\n10;140;0,2;\n50;140;0,5;\n99;140;3;\n"


@pytest.mark.parametrize(
    ("head", "after", "hours"),
    [
        ("Bemerkung;Probe gebrochen\n", "100;0,5;25;rompue\n101;0,4;25;\n102;0,5;25;\n", 99),
        ("Remark;broken\n", "99;0;25;\n100;0;25;\n", 99),
        ("Rupture time (h);99,5\n", "100;0;25;\n101;0;25;\n", 99.5),
    ],
)
def test_what_a_logger_took_after_fracture_is_left_out(read, head, after, hours):
    (test,) = read(C + head + LOADED + after)
    assert (test.loading.steps, test.rupture_time) == (((0.0, 140.0),), hours * 3600.0)
    assert test.times[-1] <= 99 * 3600.0


def test_a_load_that_is_lost_is_asked_about_where_the_strain_jumps_and_is_a_step_where_it_falls(read):
    with pytest.raises(HistoryError, match=r"the load is lost at 100 h and the strain jumps; .* ended = \"ruptured\""):
        read(f"{C}{LOADED}100;0;25;\n101;0;25;\n")
    (test,) = read(f"{C}{LOADED}99;0;2,9;\n100;0;2,8;\n")
    assert test.loading.steps[-1] == (99 * 3600.0, 0.0)


def test_the_initial_stress_of_a_relaxation_may_stand_beside_its_strain(read):
    text = f"{C}Initial stress (MPa);200\nE (GPa);160\n%sTime (h);Remaining stress (MPa)\n0;200\n1;180\n10;150\n"
    (test,) = read(text % "strain_pct;0.125\n")
    assert (test.specimen, test.outputs["stress"].tolist()) == ("relaxation", [200.0, 180.0, 150.0])


def test_a_remark_on_a_change_that_the_test_never_has_is_flagged(read):
    told = {"stress increased to 160 MPa": "160 MPa", "Temperatur auf 570 °C erhöht": "570 °C", "raised to 140 MPa": ""}
    for remark, level in told.items():
        tests = read(f"{C}{MPA}Remark;{remark}\n{STRAIN}0;0\n1;0,05\n10;0,2\n100;0,9\n")
        reasons = [one.reason for one in ck.check_data_quality(tests).flags if one.kind == "remark"]
        assert reasons == [f"'Remark' tells of a change to {level}, which the test never has"] * bool(level)
