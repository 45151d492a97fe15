"""Rates, ruptures and times to a strain in blocks of one sheet, as laboratories lay them out: the planted is read."""

import itertools

import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from helpers.workbooks import workbook

RATES = {(650, 160): 8.16e-4, (650, 140): 4.32e-4, (700, 120): 2.49e-3, (700, 100): 1.35e-3, (750, 90): 7.26e-3}
"""%/h at °C and MPa."""

RUPTURES = {(650, 160): 8860, (650, 140): 12950, (700, 120): 1394, (700, 100): 5236, (750, 90): 298.2, (750, 75): -945}
"""h at °C and MPa, negative where the test did not break."""


def rates(heads=("T (°C)", "Stress (MPa)", "min. creep rate (%/h)")):
    body = [[t, s, rate] for (t, s), rate in RATES.items()]
    once = [[t if k == 0 or body[k - 1][0] != t else None, *rest] for k, (t, *rest) in enumerate(body)]
    return [list(heads), *once]


def ruptures(temperature, heads=("Stress (MPa)", "Rupture time (h)"), mark=">"):
    of_it = ((s, h) for (t, s), h in RUPTURES.items() if t == temperature)
    return [list(heads), *([s, h if h > 0 else f"{mark}{-h}"] for s, h in of_it)]


def titled(title, block):
    return [[title], *block]


def beside(*blocks, gap=1):
    """The rows of blocks side by side."""
    widths = [max(map(len, block)) + gap for block in blocks]
    lines = itertools.zip_longest(*blocks, fillvalue=[])
    return [
        [c for row, w in zip(line, widths, strict=True) for c in [*row, *[None] * (w - len(row))]] for line in lines
    ]


def all_ruptures(title="Rupture {} °C", heads=("Stress (MPa)", "Rupture time (h)")):
    return [titled(title.format(t), ruptures(t, heads)) for t in (650, 700, 750)]


def blocks(gap=1, of_rates="Minimum creep rate", **of_ruptures):
    return beside(titled(of_rates, rates()), *all_ruptures(**of_ruptures), gap=gap)


IN_GERMAN = ("Temperatur (°C)", "Spannung (MPa)", "min. Kriechgeschw. (%/h)")


def is_planted(path):
    tests = ck.read_histories(path)
    assert len(tests) == len({test.name for test in tests}) == len(RATES) + len(RUPTURES)
    at = [(round(test.temperature - 273.15), round(test.loading.steps[0][1])) for test in tests]
    found = {key: test for key, test in zip(at, tests, strict=True) if test.minimum_rate is not None}
    assert {key: test.minimum_rate for key, test in found.items()} == pytest.approx(
        {key: rate / 100 / 3600 for key, rate in RATES.items()}
    )
    ends = {
        key: -test.times[-1] / 3600 if test.unruptured else test.rupture_time / 3600
        for key, test in zip(at, tests, strict=True)
        if test.minimum_rate is None
    }
    assert ends == pytest.approx(RUPTURES)
    return tests


LAYOUTS = {
    "a blank column between": blocks(),
    "none": blocks(gap=0),
    "a title of the sheet": [["Alloy 800H, rates and rupture, heat H4"], [], *blocks()],
    "temperatures alone": blocks(title="{} °C", of_rates=None),
    "times of the title": blocks(heads=("Stress (MPa)", "time (h)")),
    "below one another": [*rates(), [], *beside(*all_ruptures("{} °C"))],
    "other head rows": beside(titled("Rates", rates()), *([[], [], *block] for block in all_ruptures())),
    "the rates last": beside(*all_ruptures(), titled("Rates", rates()), gap=0),
    "German, with notes below": [
        *beside(
            titled("Minimale Kriechgeschwindigkeit", rates(IN_GERMAN)),
            *all_ruptures("Zeitstandversuche {} °C", ("Spannung (MPa)", "Bruchzeit (h)")),
        ),
        [],
        ["Bemerkung: > nicht gebrochen"],
    ],
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_blocks_of_a_sheet(tmp_path, layout):
    is_planted(workbook(tmp_path / "800H.xlsx", {"Creep": LAYOUTS[layout]}))


def test_merged_titles_and_a_text(tmp_path):
    sheet = blocks()

    def merged(cells):
        for titles in ("E1:G1", "H1:I1"):
            cells.merge_cells(titles)

    path = workbook(tmp_path / "800H.xlsx", {"Creep": sheet}, merged)
    is_planted(path)
    lines = [";".join("" if c is None else str(c) for c in row) for row in sheet]
    (tmp_path / "800H.csv").write_text("\n".join(lines), encoding="utf-8")
    is_planted(tmp_path / "800H.csv")


def test_names_tell_title_temperature_and_stress(tmp_path):
    tests = is_planted(workbook(tmp_path / "800H.xlsx", {"Creep": blocks()}))
    assert {"Minimum creep rate 700 °C 120 MPa", "Rupture 700 °C 120 MPa"} <= {test.name for test in tests}


def test_times_that_nothing_names_are_asked_of(tmp_path):
    """A time behind a stress under `650 °C` is that of tests; the question settles whether they broke."""
    sheet = beside(*all_ruptures("{} °C", ("Stress (MPa)", "time (h)")), gap=0)
    path = workbook(tmp_path / "x.xlsx", {"S": [*rates(), [], *sheet]})
    with pytest.raises(HistoryError, match=r'nothing whether it broke then.*ended = "ruptured"'):
        ck.read_histories(path)
    (tmp_path / "tests.toml").write_text('["x.xlsx"]\nended = "ruptured"\n')
    is_planted(path)


def test_blocks_in_ksi_and_of_times_to_a_strain(tmp_path):
    of_rupture = [["Stress", "Rupture life"], ["ksi", "h"], [23, 8860], [20, "12950+"]]
    to_strain = [["Stress", "t1%"], ["ksi", "h"], [23, 1500], [20, 4000]]
    sheet = beside(titled("Rupture 1200 °F", of_rupture), titled("Time to 1 %, 1200 °F", to_strain))
    tests = ck.read_histories(workbook(tmp_path / "x.xlsx", {"S": sheet}))
    assert [round(test.temperature - 273.15) for test in tests] == [649] * 4
    assert [test.loading.steps[0][1] for test in tests] == pytest.approx([158.58, 137.90] * 2, abs=0.01)
    assert (tests[0].rupture_time, tests[1].times[-1]) == (8860 * 3600, 12950 * 3600)
    assert tests[1].unruptured
    assert [test.times[-1] / 3600 for test in tests[2:]] == [1500, 4000]
    assert [test.outputs["strain"][-1] for test in tests[2:]] == [0.01, 0.01]


def test_a_legend_is_of_the_tests_with_its_sign(tmp_path):
    """`> not broken` below a table of rates does not end its tests; a remark on one test is of that."""
    sheet = beside(
        titled("Rates", rates()), titled("Rupture 700 °C", [["Test", "Stress (MPa)", "t_r (h)"], ["R1", 99, 5]])
    )
    sheet += [[], ["Remarks: > not broken"], ["R1 broke in the thread"]]
    tests = ck.read_histories(workbook(tmp_path / "x.xlsx", {"S": sheet}))
    assert [test.unruptured for test in tests] == [False] * 6
    assert [any("thread" in text for text in test.labels.values()) for test in tests] == [False] * 5 + [True]


def test_columns_of_one_table_are_not_parted(tmp_path):
    """A blank column within a table, and a result that stands there twice, part no table."""
    sheet = [["Stress (MPa)", "T (°C)", None, "Rupture time (h)", "Remarks"], [120, 600, None, 800, None]]
    sheet += [[100, 600, None, 2500, "necked"]]
    tests = ck.read_histories(workbook(tmp_path / "x.xlsx", {"S": sheet}))
    assert [test.rupture_time / 3600 for test in tests] == [800, 2500]
    twice = [["T (°C)", "Stress (MPa)", "t_r (h)", "t_r (h)"], [600, 120, 800, 810]]
    with pytest.raises(HistoryError, match="mean the same"):
        ck.read_histories(workbook(tmp_path / "y.xlsx", {"S": twice}))


@pytest.mark.parametrize("in_sheets", [False, True])
def test_a_test_with_its_rate_and_its_rupture_in_two_tables_is_one(tmp_path, in_sheets):
    of_rates = [
        ["Test", "T (°C)", "Stress (MPa)", "min. creep rate (1/h)"],
        ["A1", 600, 120, 1e-5],
        ["A2", 600, 99, 4e-6],
    ]
    of_ends = [["Test", "T (°C)", "Stress (MPa)", "t_r (h)"], ["A1", 600, 120, 800], ["A3", 600, 80, ">9000"]]
    sheets = {"1": of_rates, "2": of_ends} if in_sheets else {"1": beside(of_rates, of_ends)}
    tests = {test.name: test for test in ck.read_histories(workbook(tmp_path / "x.xlsx", sheets))}
    assert [*tests] == ["A1", "A2", "A3"]
    assert (tests["A1"].minimum_rate, tests["A1"].rupture_time) == (pytest.approx(1e-5 / 3600), 800 * 3600)
    of_ends[1][2] = 140
    sheets = {"1": of_rates, "2": of_ends} if in_sheets else {"1": beside(of_rates, of_ends)}
    with pytest.raises(HistoryError, match="test 'A1' already stands in"):
        ck.read_histories(workbook(tmp_path / "y.xlsx", sheets))


def test_tests_in_columns(tmp_path):
    """A sheet of results turned by a quarter: each test stands in a column, as places tell."""
    text = "Test piece;A1;A2\nTemperature (°C);600;650\nStress (MPa);140;120\nRupture time (h);812;>5000\n"
    text += "Minimum creep rate (1/h);1.2e-4;1.6e-5\nElongation after fracture (%);22;\n"
    (tmp_path / "x.csv").write_text(text, encoding="utf-8")
    one, two = ck.read_histories(tmp_path / "x.csv")
    assert (one.name, one.rupture_time, two.unruptured, two.times[-1]) == ("A1", 812 * 3600, True, 5000 * 3600)
    assert [test.minimum_rate for test in (one, two)] == pytest.approx([1.2e-4 / 3600, 1.6e-5 / 3600])
    assert [round(test.temperature - 273.15) for test in (one, two)] == [600, 650]
    (tmp_path / "x.csv").write_text(text.replace("140", "many"), encoding="utf-8")
    with pytest.raises(HistoryError, match=r"x\.csv, sheet '\(columns as rows\)', row 2"):
        ck.read_histories(tmp_path / "x.csv")


@pytest.mark.parametrize("column", ["Type;smooth;notched", "Kt;1;3.6"])
def test_a_notched_bar_is_no_plain_one(tmp_path, column):
    name, *cells = column.split(";")
    rows = "".join(f"R{k};650;700;{100 * k};{cell}\n" for k, cell in enumerate(cells, 1))
    (tmp_path / "n.csv").write_text(f"Test;T (°C);Stress (MPa);t_r (h);{name}\n{rows}", encoding="utf-8")
    with pytest.raises(
        HistoryError, match=f"'{name}' is '{cells[1]}', and the stress of a notched bar is no plain one"
    ):
        ck.read_histories(tmp_path / "n.csv")
    (tmp_path / "tests.toml").write_text('["n.csv".tests.R2]\nexclude = "notched"\n')
    (test,) = ck.read_histories(tmp_path / "n.csv")
    assert test.rupture_time == 100 * 3600


def test_points_between_thousands_and_hours_of_a_title(tmp_path):
    """One number has both signs, so that the others are decided; a title has the unit of all times."""
    (tmp_path / "g.csv").write_text("T [°C];Spannung [MPa];Bruchzeit [h]\n550;180;1.234,5\n550;140;> 30.000\n")
    one, two = ck.read_histories(tmp_path / "g.csv")
    assert (one.rupture_time, two.times[-1], two.unruptured) == (1234.5 * 3600, 30000 * 3600, True)
    text = "Hours to produce a creep strain at 1500 F\nStress psi,0.1%,1.0%,Rupture\n15000,12,240,610\n"
    (tmp_path / "h.csv").write_text(text)
    (test,) = ck.read_histories(tmp_path / "h.csv")
    assert [*(test.times / 3600), test.rupture_time / 3600] == [12, 240, 610]
    assert test.temperature == pytest.approx(1088.71, abs=0.01)
