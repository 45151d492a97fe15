"""A key that is not known is an error that says what to write; nothing becomes a label that is not called one."""

from pathlib import Path

import pytest

from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV, write_history
from creepkit.readers.indexed_folders import INDEXED_TABLE
from creepkit.readers.vocabulary import HeaderVocabulary, plain_name
from creepkit.records import History
from helpers.misspellings import misspelt_keys

HEAD = "# temperature_C: 850\n# stress_MPa: 60\n"
BODY = "time_s,strain_pct\n0,0\n10,0.1\n"
BULGE = "# specimen: bulge\n# temperature_C: 850\n# pressure_MPa: 8\n{}\ntime_s,amplitude_mm\n10,0.1\n20,0.11\n"
BAR = "# temperature_C: 850\n# stress_MPa: 60\n{}\ntime_s,strain_pct\n0,0\n10,0.1\n"


def spelled(specimen: str) -> dict[str, str]:
    return {plain_name(key): key for key in HeaderVocabulary().terms(specimen).head_keys()}


def read(text: str, path: Path) -> History:
    path.write_text(text, encoding="utf-8")
    (history,) = HISTORY_CSV.read(path)
    return history


@pytest.mark.parametrize(("template", "specimen"), [(BAR, ""), (BULGE, "bulge")], ids=["bar", "dimple"])
def test_none_of_600_misspelt_keys_is_accepted(template: str, specimen: str, tmp_path: Path):
    """300 in each file, of one or two edits or with another unit; each is refused by its own name."""
    spellings = spelled(specimen)
    for key, wrong in misspelt_keys(spellings.values(), 300, 617, spellings):
        value = "7" if "_" in key else "X7"
        with pytest.raises(HistoryError) as caught:
            read(template.format(f"# {wrong}: {value}"), tmp_path / "x.csv")
        named = [plain_name(text) for text in str(caught.value).split("'")[1::2]]
        base = plain_name(wrong.rpartition("_")[0] or wrong)  # a length is named without its unit
        assert {plain_name(wrong), base} & set(named), (key, wrong, str(caught.value))
        assert "\n" not in str(caught.value)


def test_heat_and_laboratory_are_labels_of_their_own(tmp_path: Path):
    history = read(HEAD + "# cast: X7\n# lab: north\n# label furnace: 4\n" + BODY, tmp_path / "x.csv")
    assert {"heat": "X7", "laboratory": "north", "furnace": "4"}.items() <= history.labels.items()
    text = write_history(history, tmp_path / "y.csv").read_text()
    assert "# label heat: X7\n" in text
    assert HISTORY_CSV.read(tmp_path / "y.csv")[0].labels == history.labels


def test_the_names_of_a_laboratory_are_misspelt_as_well(tmp_path: Path):
    """A column `yongs_MPa` was a label, and the test was read without its modulus."""
    (tmp_path / "curves.csv").write_text("key,time_s,strain_pct\na,0,0\na,10,0.1\n")
    (tmp_path / "index.csv").write_text("key,temperature_C,stress_MPa,yongs_MPa\na,850,60,150000\n")
    with pytest.raises(HistoryError, match="unknown key 'yongs_MPa'; did you mean 'youngs_MPa'"):
        INDEXED_TABLE.read(tmp_path)


def test_an_index_refuses_misspelt_columns_too(tmp_path: Path):
    """A column of an index that resembles no key is a label; a misspelt key of seven letters or more is an error."""
    spellings = spelled("")
    keys = [key for key in spelled("uniaxial").values() if len(key) >= 7]
    (tmp_path / "curves.csv").write_text("key,time_s,strain_pct\na,0,0\na,10,0.1\n")
    index = "key,temperature_C,stress_MPa,{}\na,850,60,7\n"
    accepted, refused = [], 0
    for key, wrong in misspelt_keys(keys, 200, 96, spellings):
        (tmp_path / "index.csv").write_text(index.format(f'"{wrong}"'))
        try:
            accepted += [(key, wrong, dict(h.labels)) for h in INDEXED_TABLE.read(tmp_path)]
        except HistoryError as error:
            refused += str(error).startswith(str(tmp_path / "index.csv"))
    assert (accepted, refused) == ([], 200)
    (tmp_path / "index.csv").write_text(index.format("grain_size_um"))
    assert INDEXED_TABLE.read(tmp_path)[0].labels["grain_size_um"] == "7"


def test_capitals_blanks_hyphens_and_brackets_do_not_matter(tmp_path: Path):
    head = (
        "# Temperature [C]: 850\n# STRESS (MPa): 60\n# Strain-Measure: logarithmic\n# includes elastic: no\n"
        "# Control: load\n# Specimen: Uniaxial\n# Modulus, GPa: 150\n"
    )
    history = read(head + BODY, tmp_path / "x.csv")
    plain = "# temperature_C: 850\n# stress_MPa: 60\n# strain_measure: logarithmic\n# includes_elastic: no\n"
    expected = read(plain + "# control: load\n# modulus_GPa: 150\n" + BODY, tmp_path / "x.csv")
    assert (history.temperature, history.loading) == (expected.temperature, expected.loading)
    assert (history.elastic, history.strain_measure, history.specimen) == (expected.elastic, "logarithmic", "uniaxial")
    assert dict(history.labels) == {}


def test_what_was_assumed_stays_known(tmp_path: Path):
    text = HEAD + "# label assumed: modulus of the data sheet\n" + BODY
    assert read(text, tmp_path / "x.csv").labels["assumed"].startswith("modulus of the data sheet, control load")
