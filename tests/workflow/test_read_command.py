"""`creepkit read`: what is shown of tables and spreadsheets, and the files that it writes."""

import json
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

import creepkit as ck
from creepkit.cli.app import app

WIDE = (
    "Creep tests of Monday\nStress (MPa);60;80\nTemperature (°C);850;850\nTime (h);A1 strain (%);A2 strain (%)\n"
    "0;0;0\n1;0,5;0,7\n2;0,9;1,5\n3;1,3;\n"
)


def creepkit(*words: object):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_a_wide_table_as_text_files_and_a_plot(tmp_path: Path):
    path = tmp_path / "wide.csv"
    path.write_bytes(WIDE.encode("utf-16"))
    result = creepkit("read", path, "--to", tmp_path / "out", "--plot", tmp_path / "curves.png")
    assert result.exit_code == 0, result.output
    assert "wide.csv (test A1, semicolons, decimal comma): time_h ('Time (h)'), strain_pct ('strain (%)'); rows 4" in (
        result.stdout
    )
    assert "A2: uniaxial, 80 MPa, 850 °C\n  strain 0 to 0.015\n  3 frames from 0 to 2 h\n" in result.stdout
    assert "assumed: control load, strain_measure engineering, includes_elastic no" in result.stdout
    assert (tmp_path / "curves.png").stat().st_size > 1000
    read, again = ck.read_histories(path), ck.read_histories(tmp_path / "out")
    assert [history.name for history in again] == ["A1", "A2"]
    for one, other in zip(read, again, strict=True):
        np.testing.assert_array_equal(one.outputs["strain"], other.outputs["strain"])
        assert (one.loading, one.temperature) == (other.loading, other.temperature)


def test_as_json(tmp_path: Path):
    (tmp_path / "wide.csv").write_text(WIDE, encoding="utf-8")
    told = json.loads(creepkit("read", tmp_path / "wide.csv", "--json").stdout)
    assert [table["test"] for table in told["tables"]] == ["A1", "A2"]
    assert told["tests"][1]["condition"] == "80 MPa, 850 °C"
    assert told["tests"][1]["outputs"]["strain"]["last"] == 0.015
    assert told["quality"]["tests"] == 2


def test_what_is_ambiguous_is_asked_for_in_one_line(tmp_path: Path):
    (tmp_path / "x.csv").write_text("# T_C: 850\n# stress_MPa: 60\ntime_h,strain\n0,0\n1,0.5\n")
    result = creepkit("read", tmp_path / "x.csv", "--to", tmp_path / "out")
    assert result.exit_code == 1
    assert "x.csv:3: 'strain' has no unit, and values up to 0.5 may be fractions or per cent" in result.output
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_record_of_an_instrument(tmp_path: Path):
    path = tmp_path / "logger.csv"
    rows = [f"18.08.2025;18:51:{22 + k};{k};78{k}" for k in range(8)] + ["18.08.2025;18:53:00;9;OL"]
    path.write_text("\n".join(["Datum;Uhrzeit;Druck [barg];T1 [°C]", *rows]) + "\n", encoding="utf-8")
    result = creepkit("read", path, "--plot", tmp_path / "record.png")
    assert result.exit_code == 0, result.output
    assert "record 'logger': 9 rows every 1 s over 98 s, time zero of unknown date or zone" in result.stdout
    assert "1 gap between rows, the longest of 91 s" in result.stdout
    assert "Druck  gauge pressure, 0 to 0.9 MPa (written in barg)" in result.stdout
    assert "its time zone is not stated" in result.stdout
    assert (tmp_path / "record.png").stat().st_size > 1000
    told = json.loads(creepkit("read", path, "--json").stdout)["records"][0]
    assert [channel["missing"] for channel in told["channels"]] == [0, 1]
    assert "leave --to away" in creepkit("read", path, "--to", tmp_path / "out").output
    plain = tmp_path / "plain.csv"
    plain.write_text("time_s,P_bar\n0,0\n1,5\n2,5\n3,5\n")
    assert "P  pressure, 0 to 0.5 MPa" in creepkit("read", plain, "--reader", "table").stdout
    assert creepkit("read", plain).exit_code != 0
