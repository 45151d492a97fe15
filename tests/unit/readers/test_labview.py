"""LabVIEW measurement files: one head or several, one clock or one a channel, or none; as tests and as records."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.testing.reader_checks import history_difference
from helpers.creep_schema import LIS, SERIES_NAME, document, value

HEAD = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\t{multi}
X_Columns\t{columns}
Time_Pref\tRelative
Operator\trig2
Date\t2026/03/02
Time\t08:00:00.0000000000000000000
***End_of_Header***\t
\t
"""
SEGMENT = """Channels\t3\t\t\t
Samples\t3\t3\t3\t
Date\t2026/03/02\t2026/03/02\t2026/03/02\t
Time\t{start}\t{start}\t{start}\t
Y_Unit_Label\t{units}\t
X_Dimension\tTime\tTime\tTime\t
X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t0.0000000000000000E+0\t
Delta_X\t3600.000000\t3600.000000\t3600.000000\t
***End_of_Header***\t\t\t\t
"""
NAMES = "X_Value\tStress\tTemperature\tStrain\tComment\n"
ROWS = "0.0\t120.0\t600.0\t0.000\t\n3600.0\t120.0\t600.0\t0.012\tdoor open\n7200.0\t120.0\t600.0\t0.018\t\n"


def segment(rows: str = ROWS, names: str = NAMES, start: str = "08:00:00.00", units: str = "MPa\tdegC\t%") -> str:
    return SEGMENT.format(start=start, units=units) + names + rows


def head(multi: str = "No", columns: str = "One", decimal: str = ".") -> str:
    return HEAD.format(multi=multi, columns=columns, decimal=decimal)


MULTI = "X_Value\tStress\tX_Value\tTemperature\tX_Value\tStrain\tComment\n"
READINGS = ((0, 0.0), (3600, 0.012), (7200, 0.018))
MULTI_ROWS = "".join(f"{t}\t120.0\t{t}\t600.0\t{t - 1800}\t{e}\t\n" for t, e in READINGS)
ALIKE_ROWS = "".join(f"{t}\t120.0\t{t}\t600.0\t{t}\t{e}\t\n" for t, e in READINGS)
FILES = {
    "one head": head() + segment(),
    "decimal commas": head(decimal=",") + segment(ROWS.replace(".", ",")),
    "no clock": head(columns="No") + segment("".join("\t" + row.split("\t", 1)[1] for row in ROWS.splitlines(True))),
    "a clock a channel": head(columns="Multi") + segment(MULTI_ROWS, MULTI),
    "clocks that are alike": head(columns="Multi") + segment(ALIKE_ROWS, MULTI),
    "several heads": head("Yes")
    + segment("".join(ROWS.splitlines(True)[:1]))
    + "\n"
    + segment("0.0\t120.0\t600.0\t0.012\t\n3600.0\t120.0\t600.0\t0.018\t\n", start="09:00:00.00"),
}


@pytest.mark.parametrize("suffix", ["lvm", "txt"])
@pytest.mark.parametrize("kind", FILES)
def test_a_test_of_three_channels(tmp_path: Path, kind: str, suffix: str) -> None:
    (tmp_path / f"x.{suffix}").write_text(FILES[kind])
    (test,) = ck.read_histories(tmp_path / f"x.{suffix}")
    np.testing.assert_allclose(test.times, [0.0, 3600.0, 7200.0])
    assert test.condition == "600 °C, 120 MPa"
    expected = [6e-5, 1.5e-4, 1.8e-4] if kind == "a clock a channel" else [0.0, 1.2e-4, 1.8e-4]
    np.testing.assert_allclose(test.outputs["strain"], expected, rtol=1e-6)
    assert (test.labels["operator"], test.labels["format"]) == ("rig2", "LabVIEW measurement")


def test_a_record_of_an_instrument(tmp_path: Path) -> None:
    names = "X_Value\tP1 [bar]\tT1 [°C]\tLVDT [mm]\tComment\n"
    (tmp_path / "press.lvm").write_text(head() + segment(names=names, units="bar\tdegC\tmm"))
    record = ck.read_record(tmp_path / "press.lvm")
    assert [str(name) for name in record.channels] == ["P1", "T1", "LVDT"]
    np.testing.assert_allclose(record.channels["P1"].values, 12.0)


# ---- creep schema ----------------------------------------------------------------------------------------------------

# Documents and series after the NFDI-MatWerk data schema for creep tests; the files are made up after it.


def write(folder: Path, content: Any, series: str | None = LIS, encoding: str = "utf-8") -> Path:
    path = folder / "Q7.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    if series is not None:
        (folder / SERIES_NAME).write_text(series, encoding=encoding)
    return path


def test_document_with_its_series(tmp_path: Path):
    (test,) = ck.read_histories(write(tmp_path, document()))
    assert (test.name, test.alloy, test.condition) == ("Q7", "ALLOY-X", "950 °C, 152.5 MPa")
    np.testing.assert_allclose(test.times, [0.0, 900.0, 37800.0, 218700.0])
    np.testing.assert_allclose(test.outputs["strain"], [0.0, 1.25e-4, 2.125e-3, 0.025125])
    assert test.rupture_time == 61.5 * 3600
    assert (test.strain_measure, test.includes_elastic, test.loading.control) == ("engineering", False, "load")
    assert test.labels == {"loading_strain": "0.00251"}


def test_a_folder_gives_each_test_once_and_the_series_alone_says_the_same(tmp_path: Path):
    path = write(tmp_path, document())
    (test,) = ck.read_histories(tmp_path)
    path.unlink()
    (alone,) = ck.read_histories(tmp_path)
    assert history_difference(test.replace(labels={}), alone.replace(labels={})) == ""
    assert alone.labels["assumed"] == "control load"


@pytest.mark.parametrize(
    ("name", "at_start"), [("Percentage plastic extension", 0.07), ("Percentage extension", 0.251)]
)
def test_extensions_that_hold_the_loading_strain(tmp_path: Path, name: str, at_start: float):
    """ISO 204: plastic extension = initial plastic + creep extension; extension = initial total + creep extension."""
    head, _, rows = LIS.partition("\nh\t%\t°C\t°C\t\t\n")
    lines = [line.split("\t") for line in rows.splitlines()]
    moved = ["\t".join([line[0], f"{float(line[1]) + at_start:.6f}", *line[2:]]) for line in lines]
    series = "".join([head, "\nh\t%\t°C\t°C\t\t\n", "\n".join(moved), "\n"])
    (test,) = ck.read_histories(write(tmp_path, document(), series.replace("Percentage creep extension", name)))
    np.testing.assert_allclose(test.outputs["strain"], [0.0, 1.25e-4, 2.125e-3, 0.025125], atol=1e-12)
    assert "subtracted" in test.labels["assumed"]


ENDS = {"Specimen rupture": 218700.0, "test piece break": 218700.0, "Time limit": None, "no rupture": None}


@pytest.mark.parametrize(("end", "rupture"), ENDS.items())
def test_how_a_test_ended(tmp_path: Path, end: str, rupture: float | None):
    changes = {"endOfTestCriterium": {"endOfTestCriteriumOptions": end}}
    (test,) = ck.read_histories(write(tmp_path, document(rupture=value("Not applicable", "h"), **changes)))
    assert (test.rupture_time, test.unruptured) == (rupture, rupture is None)


def test_a_rupture_time_without_a_series(tmp_path: Path):
    (test,) = ck.read_histories(write(tmp_path, document(link="Not applicable"), series=None))
    assert (test.times.tolist(), dict(test.outputs)) == ([61.5 * 3600], {})
    assert (test.rupture_time, test.condition) == (61.5 * 3600, "950 °C, 152.5 MPa")


def test_entries_are_known_by_their_whole_name(tmp_path: Path):
    """An uncertainty, a tolerance, an expected time or an earlier test is not the quantity that its name ends with."""
    others = (
        "Uncertainty of initial stress\tu\tMPa\t2\t\t\t\nTolerance of specified temperature\tdT\t°C\t3\t\t\t\n"
        "Expected creep rupture time\ttu\th\t5000\t\t\t\nPrevious test ID\t\t\tQ1\t\t\t\n"
    )
    (tmp_path / SERIES_NAME).write_text(LIS.replace("Date of test start", f"{others}Date of test start"))
    (test,) = ck.read_histories(tmp_path)
    assert (test.name, test.condition, test.rupture_time) == ("Q7", "950 °C, 152.5 MPa", 61.5 * 3600)


def test_a_rupture_time_without_load_control_says_what_was_assumed(tmp_path: Path):
    (test,) = ck.read_histories(write(tmp_path, document(link="", loadControlType=""), series=None))
    assert (test.loading.control, test.labels) == ("load", {"assumed": "control load"})


def test_the_first_files_are_in_the_code_page_of_windows(tmp_path: Path):
    (test,) = ck.read_histories(write(tmp_path, document(), encoding="cp1252"))
    assert test.times.size == 4


# One test in several files.


def parts(folder: Path, names: list[str], head: str, starts: tuple[float, ...]) -> list[Any]:
    """The tests of files of a creep at 0.001 % an hour, whose clocks and strains begin at these times."""
    for k, (name, start) in enumerate(zip(names, starts, strict=True), 1):
        rows = "".join(f"{start + h:g},{(start + h) / 1000 + 0.01:g}\n" for h in range(11))
        first = f"{head.format(k)}\n" if head else ""
        (folder / name).write_text(f"{first}Stress (MPa),120\nTemperature (C),700\nTime (h),Strain (%)\n{rows}")
    return ck.read_histories(folder)


def test_parts_keep_the_gap_between_them(tmp_path: Path) -> None:
    for name, text in (("tests.toml", '["*"]\nparts = "joined"\n'), ("R1_part1.lvm", FILES["one head"])):
        (tmp_path / name).write_text(text)
    (tmp_path / "R1_part2.lvm").write_text(head() + segment(start="14:00:00.00"))
    assert (ck.read_histories(tmp_path)[0].times / 3600.0).tolist() == [0.0, 1.0, 2.0, 7.0, 8.0]


def test_parts_of_a_test_are_joined_or_asked_about(tmp_path: Path) -> None:
    cases = (
        (["R1_part1.csv", "R1_part2.csv"], ""),
        (["R1_1of2.csv", "R1_2of2.csv"], ""),
        (["R1_1.csv", "R1_2.csv"], "Creep test R1, part {} of 2"),
        (["a.csv", "b.csv"], "Versuch R1, Teil {} von 2"),
        (["R1-1.csv", "R1-2.csv"], "Essai R1, partie {}/2"),
    )
    for k, (names, head) in enumerate(cases):
        (folder := tmp_path / str(k)).mkdir()
        (test,) = parts(folder, names, head, (0.0, 12.0))  # times go on
        assert test.times[-1] == 22 * 3600.0, names
        assert test.times.size == 22
        assert f"parts joined whose times go on: {names[0]}; {names[1]}" in test.labels["assumed"]
        with pytest.raises(HistoryError, match='its clock begins anew: are the parts one test.*parts = "joined"'):
            parts(folder, names, head, (0.0, 0.0))
        for answer, ends in (("joined", [20.0]), ("separate", [10.0, 10.0])):
            (folder / "tests.toml").write_text(f'["*.csv"]\nparts = "{answer}"\n')
            tests = ck.read_histories(folder)
            assert [one.times[-1] / 3600.0 for one in tests] == ends, names
            for one, hours in zip(tests, ends, strict=True):
                assert np.ptp(one.outputs["strain"]) == pytest.approx(hours * 1e-5), names
        (folder / "tests.toml").unlink()
        (folder / names[0]).unlink()
        with pytest.raises(HistoryError, match="is part 2 of a test, and part 1 is not beside it"):
            ck.read_histories(folder)
