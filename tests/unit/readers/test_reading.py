"""Which reader gets which file, and what tests are called when they come together."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from creepkit.errors import HistoryError
from creepkit.quality.copies import duplicate_tests
from creepkit.readers.reading import creepkit_readers, read_histories
from creepkit.records import History, Program, constant_stress

READERS = creepkit_readers()
TEST = "# temperature_C: 850\n# stress_MPa: 60\ntime_s,strain_1\n0,0\n1,0.1\n"


@dataclass(frozen=True)
class Always:
    """A reader that wants every file."""

    name: str
    title: str = "wants everything"

    def accepts(self, path: Path) -> bool:
        return path.is_file()

    def read(self, path: Path) -> list[History]:
        return [History(f"{self.name} {path.stem}", [0, 1], {"strain": [0, 1]}, constant_stress(1), 900.0)]


@pytest.fixture
def tests_in_folders(tmp_path: Path) -> Path:
    for name in ("one/b.csv", "one/a.csv", "two/a.csv"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(TEST)
    return tmp_path


def names(*args: object, **kwargs: object) -> list[str]:
    return [history.name for history in read_histories(*args, **kwargs)]


def test_files_folders_and_patterns(tests_in_folders):
    """In the order given, each once; equal names get their folder in front, and a bad file among good ones is named."""
    one = tests_in_folders / "one"
    for paths, found in (
        (one / "b.csv", ["b"]),
        (str(one), ["a", "b"]),
        (f"{one}/*.csv", ["a", "b"]),
        ([one / "b.csv", one / "a.csv"], ["b", "a"]),
        ([one, one / "a.csv", f"{one}/*"], ["a", "b"]),
        (f"{tests_in_folders}/*/*.csv", ["one/a", "b", "two/a"]),
    ):
        assert names(paths, READERS) == found, paths
    (one / "c.csv").write_text("")
    with pytest.raises(HistoryError, match=r"c.csv: the file is empty"):
        read_histories(one, READERS)


def test_indexed_folder_reached_by_a_pattern_over_its_files(tmp_path):
    (tmp_path / "index.csv").write_text("test,temperature_C,stress_MPa\nA,980,230\nB,980,140\n")
    for name in "AB":
        text = "time_h,creep_extension_pct,T_top_C,T_mid_C,T_bot_C\n0,0,980,980,980\n2,0.5,980,980,980\n"
        (tmp_path / f"{name}_creep.csv").write_text(text)
    assert names(f"{tmp_path}/*", READERS) == ["A", "B"]
    assert names(f"{tmp_path}/B*", READERS) == ["B"]


def test_general_reader_yields_to_another_one(tests_in_folders):
    assert names(tests_in_folders / "two", [*READERS, Always("lab")]) == ["lab a"]


def planned(name: str, end: float = 1e6, strain: float = 0.4, stress: float = 25.0, temperature: object = 1173.15):
    return History(name, [0, end], {"strain": [0, strain]}, constant_stress(stress), temperature)


def test_test_published_twice_is_found():
    records = [planned("a"), planned("b", stress=26.0), planned("c", end=1e6 + 0.7), planned("d", strain=0.40001)]
    assert duplicate_tests(records) == [("a", "c"), ("a", "d"), ("c", "d")]


def test_like_tests_are_no_duplicates():
    others = ({"end": 1.001e6}, {"strain": 0.41}, {"stress": 26.0}, {"temperature": 1223.15})
    for other in (*others, {"temperature": Program([0, 1], [1173.15, 1174])}):
        assert duplicate_tests([planned("a"), planned("b", **other)]) == [], other
