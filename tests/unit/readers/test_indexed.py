"""Folders with an index: frames of all tests in one file, or one file a test."""

from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import HistoryError
from creepkit.readers.indexed_folders import INDEXED_FILES, INDEXED_TABLE, IndexedFolderReader
from creepkit.readers.vocabulary import HeaderVocabulary

INDEX = "key,temperature_C,stress_MPa,youngs_MPa,state\na/1,900,25,149000,Ruptured\na/2,950,20,144000,\n"
CURVES = (
    "key,temperature_C,stress_MPa,time_s,strain\na/1,900,25,0,0\na/2,950,20,0,0\na/1,900,25,10,0.1\na/2,950,20,9,0.2\n"
)


def folder(tmp_path: Path, files: dict[str, str]) -> Path:
    made = tmp_path / "alloy9"
    made.mkdir()
    for name, text in files.items():
        (made / name).write_text(text, encoding="utf-8")
    return made


def files(index: str = "", frames: str = "") -> dict[str, str]:
    index = index or "test,temperature_C,stress_MPa,rupture_h\nB,980,230,78.7\nA,980,140,Not applicable\n"
    frames = frames or "time_h,creep_extension_pct,T_top_C,T_mid_C,T_bot_C\n0,0,980,981,982\n2,0.5,980,981,988\n"
    return {"index.csv": index, "A_creep.csv": frames, "B_creep.csv": frames}


def test_one_table_for_all_tests(tmp_path):
    first, second = INDEXED_TABLE.read(folder(tmp_path, {"index.csv": INDEX, "curves.csv": CURVES}))
    assert (first.name, second.name) == ("a/1", "a/2")
    assert first.outputs["strain"].tolist() == [0.0, 0.1]
    assert second.times.tolist() == [0.0, 9.0]
    assert first.elastic.E == 149000.0
    assert first.temperature == 1173.15
    assert (first.rupture_time, first.labels["assumed"].split(", ")[-1]) == (10.0, "rupture at the last frame")
    assert (second.rupture_time, second.unruptured, second.end_known) == (None, False, False)
    assert first.alloy == "alloy9"
    assert first.source.endswith("curves.csv (a/1)")


def test_one_file_a_test_in_the_order_of_the_index(tmp_path):
    made = folder(tmp_path, files())
    first, second = INDEXED_FILES.read(made)
    assert (first.name, second.name) == ("B", "A")
    np.testing.assert_allclose(first.times, [0, 7200])
    np.testing.assert_allclose(first.outputs["strain"], [0, 0.005])
    assert first.loading.steps == ((0.0, 230.0),)
    assert first.temperature == pytest.approx(1253.15)
    assert first.labels["measured_temperature_C"] == "982.00"  # (980 + 981 + 982 + 980 + 981 + 988) / 6
    assert (first.rupture_time, first.unruptured) == (pytest.approx(78.7 * 3600), False)
    assert (second.rupture_time, second.unruptured) == (None, True)
    assert first.source == str(made / "B_creep.csv")


def test_another_laboratory_is_a_declaration(tmp_path):
    layout = IndexedFolderReader(
        name="lab",
        title="our laboratory",
        key_column="Probe",
        frames_file="{key}.csv",
        index_file="Liste.csv",
        vocabulary=HeaderVocabulary(
            synonyms={"T_C": "temperature_C", "Spannung_MPa": "stress_MPa", "Dehnung_pct": "strain_pct"}
        ),
    )
    made = folder(
        tmp_path, {"Liste.csv": "Probe,T_C,Spannung_MPa\nx,600,90\n", "x.csv": "time_h,Dehnung_pct\n0,0\n1,2\n"}
    )
    assert layout.accepts(made)
    (history,) = layout.read(made)
    assert (history.name, history.condition) == ("x", "600 °C, 90 MPa")
    np.testing.assert_allclose(history.outputs["strain"], [0, 0.02])


def test_key_cannot_lead_out_of_the_folder(tmp_path):
    (tmp_path / "A_creep.csv").write_text("secret")
    index = "test,temperature_C,stress_MPa\nA,980,230\nB,980,140\n../A,980,1\n"
    with pytest.raises(HistoryError, match=r"index.csv:4: test '../A' has no file"):
        INDEXED_FILES.read(folder(tmp_path, files(index)))


def test_what_an_empty_cell_of_the_index_leaves_unknown_is_said(tmp_path):
    index = "key,temperature_C,stress_MPa,youngs_MPa,state,product\na/1,900,25,,Ruptured,\na/2,950,20,144000,,Base\n"
    first, second = INDEXED_TABLE.read(folder(tmp_path, {"index.csv": index, "curves.csv": CURVES}))
    assert "youngs_MPa unknown (empty cell)" in first.labels["assumed"].split(", ")
    assert "state unknown (empty cell)" in second.labels["assumed"].split(", ")
    assert "product" not in first.labels["assumed"]


def test_any_file_of_the_folder_leads_to_it(tmp_path):
    made = folder(tmp_path, files())
    assert all(INDEXED_FILES.accepts(made / name) for name in ("", "index.csv", "A_creep.csv"))
    assert [history.name for history in INDEXED_FILES.read(made / "index.csv")] == ["B", "A"]
    assert [history.name for history in INDEXED_FILES.read(made / "A_creep.csv")] == ["A"]
    assert not INDEXED_TABLE.accepts(made)
    (made / "notes.csv").write_text("x\n1\n")
    assert not INDEXED_FILES.accepts(made / "notes.csv")


def test_alloy_from_the_index(tmp_path):
    index = "test,temperature_C,stress_MPa,alloy\nA,980,230,CMSX-6\nB,980,140,CMSX-6\n"
    assert {history.alloy for history in INDEXED_FILES.read(folder(tmp_path, files(index)))} == {"CMSX-6"}
