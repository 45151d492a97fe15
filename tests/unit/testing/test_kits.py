"""The kits of specimens, predictors, readers and exporters: each kind of fault is caught and told."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import ArgumentError, HistoryError, SolveError
from creepkit.records import typical_history
from creepkit.registry import default_registry
from creepkit.testing import ConformanceReport
from helpers.command_line import creepkit, one_line
from helpers.steady_rate_predictor import Steady


@dataclass(frozen=True)
class Rod(ck.PerTest):
    """A rod under a force in steady creep: its elongation is rate x time x length."""

    length: float = ck.dimension(50.0, (10.0, 200.0))
    diameter: float = ck.dimension(6.0, (2.0, 20.0))
    name: ClassVar[str] = "rod"
    title: ClassVar[str] = "Rod under a force"
    outputs: ClassVar[tuple[Any, ...]] = (ck.Output("elongation", "length"),)
    loads: ClassVar[tuple[ck.Load, ...]] = (ck.Load("force", "force"),)

    def stress(self, history: ck.History) -> np.ndarray:
        return history.loading.program().at(history.times) / (np.pi / 4 * self.diameter**2)

    def reference_stress(self, history: ck.History) -> np.ndarray:
        diameter = history.geometry.get("diameter", self.diameter)
        return history.loading.program().values[-1:] / (np.pi / 4 * diameter**2)

    def one(self, law: Any, values: Any, history: ck.History, nuisances: Any) -> dict[str, np.ndarray]:
        rate = ck.lower(law, "numpy").rate(
            values, stress=self.stress(history), temperature=history.temperature_program().at(history.times)
        )
        return {"elongation": self.length * rate * history.times}


def failures(report: ConformanceReport) -> str:
    return " ".join(f"{check.name}: {check.detail}" for check in report.failures)


def test_a_specimen_of_a_few_lines_conforms() -> None:
    report = ck.check_specimen(Rod())

    assert report.passed, str(report)
    assert {"length length", "load force", "pickles"} <= {c.name for c in report.checks}


def test_a_typical_test_of_any_specimen_has_a_reference_stress_of_100_mpa() -> None:
    """Where the record says no more than how stress follows from the load: F = s pi d^2/4 = 2827 N."""
    plan = typical_history(Rod())

    assert plan.loading.quantity == "force"
    assert plan.loading.program().values[-1] == pytest.approx(100.0 * np.pi / 4 * 36.0, rel=1e-5)
    assert typical_history(ck.specimen("bulge")).loading.program().values[-1] == pytest.approx(np.sqrt(3.0 * 25.0))


class Wrong(Rod):
    """A rod whose prediction is spoilt."""

    def predict(self, law, theta, histories, *, nuisances=None, sensitivities=False):
        made = super().predict(law, theta, histories, nuisances=nuisances, sensitivities=sensitivities)
        return self.spoilt(made, law, theta, histories)

    def spoilt(self, made, law, theta, histories):
        return made


class Holes(Wrong):
    def spoilt(self, made, law, theta, histories):
        values = made.values.copy()
        values[:, :, 3] = np.nan
        return replace(made, values=values)


class Ragged(Wrong):
    def spoilt(self, made, law, theta, histories):
        return replace(made, values=made.values[:, :, :-1])


class OfItsNeighbours(Wrong):
    def spoilt(self, made, law, theta, histories):
        return replace(made, values=made.values * (1.0 + 0.01 * len(theta)))


class Random(Wrong):
    def spoilt(self, made, law, theta, histories):
        return replace(made, values=made.values * np.random.default_rng().uniform(0.9, 1.1))


class WrongSlope(Wrong):
    def spoilt(self, made, law, theta, histories):
        """Derivatives to A itself in the place of those to its logarithm."""
        slopes = np.repeat(made.values[..., None], len(law.names), axis=-1)
        return replace(made, jacobian=slopes / np.exp(theta[:, 0])[:, None, None, None, None])


class Deaf(Rod):
    """Takes any nuisance, and follows no length."""

    def predict(self, law, theta, histories, *, nuisances=None, sensitivities=False):
        plain = [h.replace(geometry={}) for h in histories]
        return super().predict(law, theta, plain, sensitivities=sensitivities)


class AnyLoad(Rod):
    loads: ClassVar[tuple[ck.Load, ...]] = ()


class PlainNames(Rod):
    outputs: ClassVar[tuple[Any, ...]] = ("elongation",)


class OtherModel(Rod):
    def reduced_order_model(self):
        return Doubled()


class Doubled(Wrong):
    def spoilt(self, made, law, theta, histories):
        return replace(made, values=2.0 * made.values)


class Raising(Rod):
    def predict(self, law, theta, histories, *, nuisances=None, sensitivities=False):
        return {}["no such key"]


class NoStress(Rod):
    def reference_stress(self, history):
        return np.array([-1.0])


@dataclass(frozen=True)
class Locked(Rod):
    lock: Any = field(default_factory=lambda: open(__file__, encoding="utf-8"))  # noqa: SIM115


WRONG = {
    Holes: "and status complete; state how and when it ended",
    Ragged: "values of shape",
    OfItsNeighbours: "one row must not depend on the others",
    Random: "two calls differ",
    WrongSlope: "it is to the internal parameter, the natural logarithm",
    Deaf: "is taken in silence",
    AnyLoad: "none is declared; state loads",
    PlainNames: "write ck.Output('elongation', 'length')",
    OtherModel: "reduced_order_model(): 1.0e+00 off",
    Raising: f"raised KeyError: 'no such key' ({__file__}, line",
    NoStress: "return finite stresses above zero",
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_specimen_is_caught_and_told(kind: type[Rod]) -> None:
    report = ck.check_specimen(kind())

    assert WRONG[kind] in failures(report)
    assert all("\n" not in check.detail for check in report.checks)


def test_a_length_that_is_not_followed_is_told() -> None:
    said = failures(ck.check_specimen(Deaf()))

    assert "nuisance diameter: no output depends on this length" in said
    assert "a test that states" in said


def test_a_specimen_that_no_other_process_can_have_is_told() -> None:
    specimen = Locked()
    with specimen.lock:
        assert "TypeError: cannot pickle" in failures(ck.check_specimen(specimen))


def test_a_predictor_without_a_record_conforms_with_tests_of_its_own() -> None:
    """A closed form for stress steps; it takes no nuisances, so that one is refused by its signature."""

    class Closed(Steady):
        def predict(self, law, theta, histories, *, nuisances=None, sensitivities=False):
            if nuisances:
                raise SolveError(f"a closed form knows no nuisance, found {next(iter(nuisances))}")
            return super().predict(law, theta, histories, sensitivities=sensitivities)

    globals()["Closed"] = Closed
    Closed.__qualname__ = "Closed"
    times = np.linspace(0.0, 1e4, 12)
    tests = [ck.History(f"{s:g}", times[:k], {}, ck.constant_stress(s), 1073.0) for s, k in ((80.0, 12), (60.0, 7))]
    report = ck.check_predictor(Closed(), tests, law=ck.law("norton"), values={"A": 1e-14, "n": 4.0})

    assert report.passed, str(report)


def test_another_object_is_refused_with_what_is_allowed() -> None:
    for check, given, allowed in (
        (ck.check_specimen, Rod, "a Specimen"),
        (ck.check_reader, Rod(), "a Reader"),
        (ck.check_exporter, Rod(), "an Exporter"),
    ):
        with pytest.raises(ArgumentError, match=f"of {check.__name__}.*allowed is {allowed}"):
            check(given)


# ---- readers -------------------------------------------------------------------------------------------------------


@dataclass
class Camera:
    """A reader of two numbers a line after the word of its maker."""

    name: str = "camera"
    title: str = "text files of a camera"

    def accepts(self, path: Path) -> bool:
        return path.is_file() and path.suffix == ".cam"

    def read(self, path: Path) -> list[ck.History]:
        try:
            lines = path.read_text(encoding="utf-8").splitlines()[1:]
            rows = np.array([[float(word) for word in line.split()] for line in lines])
        except (ValueError, OSError) as error:
            raise HistoryError(f"{path}: is no file of the camera ({' '.join(str(error).split())})") from None
        if rows.ndim != 2 or rows.shape[1] != 2 or len(rows) < 2:
            raise HistoryError(f"{path}: two numbers a line are wanted")
        return [ck.History(path.stem, rows[:, 0], {"strain": rows[:, 1]}, ck.constant_stress(80.0), 1000.0)]


class Careless(Camera):
    def accepts(self, path: Path) -> bool:
        return "camera" in path.read_text(encoding="utf-8")


class Abrupt(Camera):
    def read(self, path: Path) -> list[ck.History]:
        return [float(path.read_text(encoding="utf-8").split()[0])]


class Drifting(Camera):
    def read(self, path: Path) -> list[ck.History]:
        (history,) = super().read(path)
        return [history.replace(outputs={"strain": history.outputs["strain"] + np.random.default_rng().uniform()})]


class OfNoSpecimen(Camera):
    def read(self, path: Path) -> list[ck.History]:
        return [h.replace(specimen="no-such") for h in super().read(path)]


@pytest.fixture
def example(tmp_path: Path) -> Path:
    file = tmp_path / "example.cam"
    file.write_text("camera 7\n0 0\n3600 0.001\n7200 0.0015\n")
    return file


def test_a_reader_of_a_few_lines_conforms(example: Path) -> None:
    report = ck.check_reader(Camera(), example)

    assert report.passed, str(report)
    assert "written as CSV and read back" in {check.name for check in report.checks}


@pytest.mark.parametrize(
    ("reader", "said"),
    [
        (Careless(), "answer False for what is not understood"),
        (Abrupt(), "raise creepkit.errors.HistoryError with the file, one sentence"),
        (Drifting(), "reading twice: outputs of 'strain' differ"),
        (OfNoSpecimen(), "'no-such' is not registered"),
        (Camera(name="our camera"), "rename it"),
        (Camera(name="csv"), "'csv' is taken"),
        (Camera(title=""), "is not one line of text"),
    ],
)
def test_a_wrong_reader_is_caught_and_told(reader: Camera, said: str, example: Path) -> None:
    assert said in failures(ck.check_reader(reader, example))


# ---- exporters -----------------------------------------------------------------------------------------------------


@dataclass
class Table:
    """A table of parameters, as the page on exporters has it."""

    name: str = "parameter-table"
    title: str = "table of parameters"
    suffix: str = ".csv"

    def text(self, source: ck.LawWithValues) -> str:
        lines = [f"# {line}" for note in source.notes for line in note.replace("\x00", "").splitlines()]
        lines += [f"{name},{value!r}" for name, value in source.values.items()]
        return "\n".join(lines) + "\n"


class Breaking(Table):
    def text(self, source: ck.LawWithValues) -> str:
        return "".join(f"# {note}\n" for note in source.notes) + "end\n"


class Failing(Table):
    def text(self, source: ck.LawWithValues) -> str:
        return f"{source.values['A']}\n"


class Dated(Table):
    def text(self, source: ck.LawWithValues) -> str:
        return f"{np.random.default_rng().integers(1 << 60)}\n"


class Named(Table):
    def text(self, source: ck.LawWithValues) -> str:
        return f"{source.name}\n{super().text(source)}"


def test_an_exporter_of_a_few_lines_conforms() -> None:
    report = ck.check_exporter(Table())

    assert report.passed, str(report)


@pytest.mark.parametrize(
    ("exporter", "said"),
    [
        (Breaking(), "put the comment sign before each line"),
        (Failing(), "raised KeyError: 'A'"),
        (Dated(), "two texts of one law differ"),
        (Named(), "breaks a line; refuse it"),
        (Table(suffix="csv"), "write one such as '.inp'"),
        (Table(name="latex"), "'latex' is taken"),
    ],
)
def test_a_wrong_exporter_is_caught_and_told(exporter: Table, said: str) -> None:
    assert said in failures(ck.check_exporter(exporter))


def test_a_reader_of_a_loaded_file_is_itself_and_its_examples_are_read(tmp_path: Path) -> None:
    file = tmp_path / "krp_format.py"
    file.write_text(
        "import creepkit as ck\n\n\nclass Krp:\n    name, title = 'krp', 'one history, not in a list'\n\n"
        "    def accepts(self, path):\n        return path.suffix == '.krp'\n\n"
        "    def read(self, path):\n"
        "        return ck.History('h', [0.0, 1.0], {'strain': [0.0, 1.0]}, ck.constant_stress(100.0), 1073.0)\n\n\n"
        "@ck.hookimpl\ndef creepkit_readers():\n    return [Krp()]\n"
    )
    (tmp_path / "test.krp").write_text("x")
    specification = importlib.util.spec_from_file_location("krp_by_hand", file)
    module = importlib.util.module_from_spec(specification)
    sys.modules["krp_by_hand"] = module
    specification.loader.exec_module(module)
    ck.load_plugin(file)

    assert "is taken" not in str(ck.check_reader(module.Krp()))
    assert "ok   example file: not checked: no example file" in str(ck.check_reader(module.Krp()))
    told = creepkit("check", str(file), "--example", str(tmp_path / "test.krp"))
    assert told.exit_code == 1
    assert "returned a History; it must return a list of histories" in told.stdout
    file.write_text(file.read_text().replace("ck.History(", "[ck.History(").replace("1073.0)", "1073.0)]"))
    default_registry.cache_clear()
    assert creepkit("check", str(file), "--example", str(tmp_path / "test.krp")).exit_code == 0
    file.write_text(file.read_text().replace("{'strain'", "{'strian'"))
    default_registry.cache_clear()
    told = creepkit("check", str(file), "--example", str(tmp_path / "test.krp"))
    assert "a uniaxial specimen shows no 'strian'; did you mean 'strain'?" in told.stdout
    default_registry.cache_clear()
    assert "--example is for readers" in one_line(creepkit("check", "norton", "--example", str(file)))
