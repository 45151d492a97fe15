"""What is written is read back to the last digit, or not written at all."""

from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import HistoryError
from creepkit.language import Elastic, wachtman
from creepkit.readers.history_csv import HISTORY_CSV, history_text, write_history
from creepkit.records import History, PressureJump, Program, RecordedLoading, StressSteps, constant_stress
from helpers.written_files import names_in

TIMES = np.array([0.1, 1 / 3, 7e5])
BULGE = {"amplitude": [0.1, 0.2, 1 / 7], "width": [3.6, 3.5, 3.4], "shape": [2.0, 1.9, 2.1]}

HISTORIES = [
    History("a", TIMES, {"strain": [0.0, 1e-17, -np.pi]}, constant_stress(1 / 3), 1123.15),
    History(
        "b c",
        TIMES,
        {"strain": [0, 1e-3, 0.1]},
        StressSteps(((0, 100.1), (3600.7, 1e-3)), "stress"),
        Program([0, 10, 10], [900.1, 901, 950]),
        elastic=Elastic(153e3 / 7, 0.31),
        strain_measure="engineering",
        includes_elastic=True,
        standard_deviation={"strain": [1e-5, 2e-5, 1 / 3e5]},
        used=[True, False, True],
        geometry={"gauge": 25.0, "slit_mm": 0.1},
        operator="window 0.8",
        alloy="Alloy 617",
        labels={"heat": "X7: hot", "specimen": "Round, 6 mm", "empty": "", "stress_MPa": "about 100"},
    ),
    History("d", TIMES, BULGE, PressureJump(8.0, 1e1 / 3, 14580.3, 4.9), 1075.6, specimen="bulge"),
    History(
        "e", TIMES, BULGE, RecordedLoading(Program([0, 5], [0, 8.1]), "pressure"), 1075.6, specimen="bulge-of-mine"
    ),
    History("g", TIMES, {"strain": [0, 1, 2]}, constant_stress(100.0), 900.0, rupture_time=7.1e5 / 1.01),
    History("h", TIMES, {"strain": [0, 1, 2]}, constant_stress(100.0), 900.0, unruptured=True),
    History("f", TIMES, {"strain": [0, 1, 2]}, RecordedLoading(Program([0, 5], [0, 8]), "stress", "stress"), 900.0),
]


def assert_same(one: History, two: History) -> None:
    for name in ("name", "loading", "temperature", "specimen", "elastic", "strain_measure", "includes_elastic"):
        assert getattr(one, name) == getattr(two, name), name
    for name in ("geometry", "operator", "alloy", "labels", "rupture_time", "unruptured"):
        assert getattr(one, name) == getattr(two, name), name
    np.testing.assert_array_equal(one.times, two.times, strict=True)
    np.testing.assert_array_equal(one.used, two.used, strict=True)
    for name in ("outputs", "standard_deviation"):
        assert getattr(one, name).keys() == getattr(two, name).keys()
        for key, values in getattr(one, name).items():
            np.testing.assert_array_equal(values, getattr(two, name)[key], strict=True)


@pytest.mark.parametrize("history", HISTORIES, ids=lambda history: history.name)
def test_round_trip(history: History, tmp_path: Path):
    path = write_history(history, tmp_path / "x.csv")
    (back,) = HISTORY_CSV.read(path)
    assert_same(history, back)
    assert back.source == str(path)
    assert history_text(back) == path.read_text()
    assert names_in(tmp_path) == ["x.csv"]


def test_modulus_of_temperature_is_written_at_the_temperature_of_the_test(tmp_path):
    elastic = Elastic(wachtman(210e3, 80.0, 300.0))
    history = HISTORIES[0].replace(elastic=elastic)
    (back,) = HISTORY_CSV.read(write_history(history, tmp_path / "x.csv"))
    assert back.elastic.E == pytest.approx(210e3 - 80.0 * 1123.15 * np.exp(-300.0 / 1123.15), rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"labels": {"a": "two\nlines"}}, r"history 'a': 'two\\nlines' cannot be written in one line"),
        ({"labels": {"a:b": ""}}, "history 'a': 'a:b' cannot name a line; use words without a colon"),
        ({"labels": {"": "x"}}, "history 'a': '' cannot name a line"),
        ({"geometry": {" gauge": 1.0}}, "history 'a': ' gauge' cannot be written in one line"),
        ({"alloy": " 617"}, "history 'a': ' 617' cannot be written in one line"),
        ({"specimen": "Round Bar"}, "history 'a': specimen 'Round Bar' is not a name in small letters"),
        ({"outputs": {"strain": [0, np.nan, 1]}}, "history 'a': 'strain_1' holds a number that is not finite"),
        ({"outputs": {"sag": [0, 1, 1]}}, "history 'a': no unit is known for 'sag', for no registered specimen"),
        (
            {"elastic": Elastic(wachtman(2e5, 80.0, 300.0)), "temperature": Program([0, 1], [900, 910])},
            "history 'a': elastic data that change with the temperature",
        ),
    ],
)
def test_what_would_not_survive_is_refused_and_nothing_is_written(changes, message, tmp_path):
    with pytest.raises(HistoryError, match=message):
        write_history(HISTORIES[0].replace(**changes), tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []
