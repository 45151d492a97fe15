"""LabVIEW measurement files: one head or several, one clock or one a channel, or none; as tests and as records."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError

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


def test_what_is_not_understood_names_the_format(tmp_path: Path) -> None:
    (tmp_path / "x.lvm").write_text(head() + segment(units="MPa\tdegC\tmm"))
    with pytest.raises(HistoryError, match=r"x.lvm:22: the unit 'mm' of 'Strain .mm.*LabVIEW.*Y_Unit_Label"):
        ck.read_histories(tmp_path / "x.lvm")
