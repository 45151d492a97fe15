"""Columns that nobody needs are left out where that is said, and only there; names are told as they were written."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.records import History

HEAD = "# stress_MPa: 60\n# temperature_C: 850\n"
TABLE = "Time (h);Strain (%);load, kN;operator;Date\n0;0;3,1;Ms A;1.3.24\n1;0,112;3,1;Mr B;1.3.24\n2;0,2;3,1;;2.3.24\n"


def read(text: str, path: Path, **options: object) -> list[History]:
    path.write_text(text, encoding="utf-8")
    return ck.read_histories(path, **options)


def test_by_a_key_of_the_head(tmp_path: Path):
    for key in ("ignore: load, kN; operator; Date", "Ignore: load, kN; OPERATOR; date"):
        (history,) = read(f"# {key}\n{HEAD}{TABLE}", tmp_path / "x.csv")
        np.testing.assert_allclose(history.outputs["strain"], [0, 0.00112, 0.002])
        assert set(history.labels) == {"assumed"}


def test_by_the_call_in_every_file_that_has_them(tmp_path: Path):
    (tmp_path / "y.csv").write_text(f"{HEAD}time_h,strain_pct\n0,0\n1,0.1\n")
    (tmp_path / "x.csv").write_text(HEAD + TABLE)
    found = ck.read_histories(tmp_path, ignore=["load, kN", "operator", "Date"])
    assert [history.name for history in found] == ["x", "y"]
    with pytest.raises(HistoryError, match="ignore is 'Date'; give a list of names of columns"):
        ck.read_histories(tmp_path, ignore="Date")


def test_columns_of_a_wide_table_and_of_a_table_of_tests(tmp_path: Path):
    wide = "Stress (MPa),60,,80\nTemperature (C),850,,850\nTime (h),A strain (%),load_kN,B strain (%)\n"
    first, second = read("# ignore: load_kN\n" + wide + "0,0,x,0\n1,0.1,y,0.2\n", tmp_path / "x.csv")
    assert (first.outputs["strain"][1], second.outputs["strain"][1]) == (0.001, 0.002)
    table = "test,stress_MPa,T_C,t_r (h),stress ratio\nA,60,850,120,?\n"
    (history,) = read(table, tmp_path / "y.csv", ignore=["stress ratio"])
    assert "stress ratio" not in history.labels
