"""What a plugin's object raises while a verb runs becomes one sentence with the plugin's file and line."""

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import ExportError, HistoryError, SolveError
from creepkit.exporters.exporting import exported_text
from creepkit.readers.reading import read_histories

TIMES = np.linspace(100.0, 5000.0, 8)
VALUES = {"A": 1e-14, "n": 4.0}


class Broken:
    """A specimen, reader and exporter whose code is wrong."""

    name, title, suffix, outputs, nuisances = "broken", "Broken", ".txt", ("strain",), ()

    def predict(self, law, theta, histories, *, nuisances=None, sensitivities=False):
        return np.zeros(3)[7]

    def accepts(self, path):
        return True

    def read(self, path):
        return {}["no such column"]

    def text(self, source):
        return 1.0 / 0.0 + "text"


def line_of(method: str, within: str) -> int:
    source, start = inspect.getsourcelines(getattr(Broken, method))
    return start + next(k for k, line in enumerate(source) if within in line)


def said(error: pytest.ExceptionInfo[Exception], method: str, within: str) -> str:
    message = str(error.value)
    assert "\n" not in message
    assert f"({__file__}, line {line_of(method, within)})" in message
    return message


def test_a_specimen_that_raises_in_simulate() -> None:
    with pytest.raises(SolveError) as error:
        ck.simulate("norton", Broken(), VALUES, loading=ck.constant_stress(80.0), times=TIMES)

    assert "predictor 'broken': predict() raised IndexError: index 7" in said(error, "predict", "np.zeros")


def test_a_run_that_raises() -> None:
    class WithRun(Broken):
        def run(self, law, values, plan):
            raise OSError("the other program is not there")

    with pytest.raises(SolveError, match=r"specimen 'broken': run\(\) raised OSError: the other program"):
        ck.simulate("norton", WithRun(), VALUES, loading=ck.constant_stress(80.0), times=TIMES)


def test_a_reader_that_raises(tmp_path: Path) -> None:
    (tmp_path / "test.txt").write_text("0 0\n")

    with pytest.raises(HistoryError) as error:
        read_histories(tmp_path / "test.txt", [Broken()])

    assert "read() of reader 'broken' raised KeyError" in said(error, "read", "no such column")


def test_a_reader_that_raises_when_it_is_asked(tmp_path: Path) -> None:
    class Asked(Broken):
        def accepts(self, path):
            return path.read_text()[99]

    (tmp_path / "test.txt").write_text("0 0\n")

    with pytest.raises(HistoryError, match=r"accepts\(\) of reader 'broken' raised IndexError.*line \d+\)$"):
        read_histories(tmp_path / "test.txt", [Asked(), Broken()])


@pytest.mark.parametrize(
    ("returned", "found"), [(None, "a NoneType; it must return a list"), ([3], "a int in its list")]
)
def test_a_reader_that_returns_something_else(returned: object, found: str, tmp_path: Path) -> None:
    class Other(Broken):
        def read(self, path):
            return returned

    (tmp_path / "test.txt").write_text("0 0\n")

    with pytest.raises(HistoryError, match=re.escape(found)):
        read_histories(tmp_path / "test.txt", [Other()])


def test_an_exporter_that_raises() -> None:
    with pytest.raises(ExportError) as error:
        exported_text(Broken(), ck.LawWithValues(ck.law("norton"), VALUES))

    assert "exporter 'broken': text() raised ZeroDivisionError" in said(error, "text", "1.0 / 0.0")


def test_what_creepkit_itself_does_wrong_is_not_put_down_to_a_plugin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("creepkit.specimens.uniaxial.Uniaxial.point_test", None)

    with pytest.raises(TypeError):
        ck.identify(
            "norton",
            [ck.History("a", TIMES, {"strain": 1e-6 * TIMES}, ck.constant_stress(80.0), 1000.0)],
            starts=1,
            nuisances=[],
        )
