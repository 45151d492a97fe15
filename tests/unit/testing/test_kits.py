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
from creepkit.errors import ArgumentError, HistoryError
from creepkit.records import typical_history
from creepkit.registry import default_registry, kinds
from creepkit.testing import ConformanceReport
from creepkit.testing.kits import kit_of
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


@dataclass(frozen=True)
class Wrong(Rod):
    """A rod whose prediction is spoilt."""

    spoil: Any = None

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        made = super().predict_batch(law, theta, histories, nuisances, sensitivities)
        return replace(made, **self.spoil(made.values, np.exp(theta[:, 0])[:, None, None, None, None]))


def holes(values, A):
    return {"values": np.where(np.arange(values.shape[2])[:, None] == 3, np.nan, values)}


def ragged(values, A):
    return {"values": values[:, :, :-1]}


def of_its_neighbours(values, A):
    return {"values": values * (1.0 + 0.01 * len(values))}


def random(values, A):
    return {"values": values * np.random.default_rng().uniform(0.9, 1.1)}


def slope_to_a_itself(values, A):
    """In the place of that to its logarithm."""
    return {"jacobian": np.repeat(values[..., None], 2, axis=-1) / A}


def doubled(values, A):
    return {"values": 2.0 * values}


class Deaf(Rod):
    """Follows no length."""

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        return super().predict_batch(law, theta, [h.replace(geometry={}) for h in histories], {}, sensitivities)


class AnyLoad(Rod):
    loads: ClassVar[tuple[ck.Load, ...]] = ()


class PlainNames(Rod):
    outputs: ClassVar[tuple[Any, ...]] = ("elongation",)


class OtherModel(Rod):
    def reduced_order_model(self):
        return Wrong(spoil=doubled)


class Raising(Rod):
    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        return {}["no such key"]


class NoStress(Rod):
    def reference_stress(self, history):
        return np.array([-1.0])


@dataclass(frozen=True)
class Locked(Rod):
    lock: Any = field(default_factory=lambda: open(__file__, encoding="utf-8"))  # noqa: SIM115


WRONG = {
    Wrong(spoil=holes): "and status complete; state how and when it ended",
    Wrong(spoil=ragged): "values of shape",
    Wrong(spoil=of_its_neighbours): "one row must not depend on the others",
    Wrong(spoil=random): "nor on chance",
    Wrong(spoil=slope_to_a_itself): "it is to the internal parameter, the natural logarithm",
    Deaf(): "nuisance diameter: no output depends on this length",
    AnyLoad(): "none is declared; state loads",
    PlainNames(): "write ck.Output('elongation', 'length')",
    OtherModel(): "reduced_order_model(): 1.0e+00 off",
    Raising(): f"raised KeyError: 'no such key' ({__file__}, line",
    NoStress(): "return finite stresses above zero",
}


def test_a_wrong_specimen_is_caught_and_told() -> None:
    reports = {specimen: ck.check_specimen(specimen) for specimen in WRONG}

    assert [(one, str(report)) for one, report in reports.items() if WRONG[one] not in failures(report)] == []
    assert all("\n" not in check.detail for report in reports.values() for check in report.checks)


def test_a_specimen_that_no_other_process_can_have_is_told() -> None:
    specimen = Locked()
    with specimen.lock:
        assert "TypeError: cannot pickle" in failures(ck.check_specimen(specimen))


def test_a_predictor_without_a_record_conforms_with_tests_of_its_own() -> None:
    """A closed form for stress steps; it takes no nuisances."""
    times = np.linspace(0.0, 1e4, 12)
    tests = [ck.History(f"{s:g}", times[:k], {}, ck.constant_stress(s), 1073.0) for s, k in ((80.0, 12), (60.0, 7))]
    report = ck.check_predictor(Steady(), tests, law=ck.law("norton"), values={"A": 1e-14, "n": 4.0})

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


def test_a_reader_conforms_and_a_wrong_one_is_caught_and_told(example: Path) -> None:
    cases = (
        (Careless(), "answer False for what is not understood"),
        (Abrupt(), "raise creepkit.errors.HistoryError with the file, one sentence"),
        (Drifting(), "reading twice: outputs of 'strain' differ"),
        (OfNoSpecimen(), "'no-such' is not registered"),
        (Camera(name="our camera"), "rename it"),
        (Camera(name="csv"), "'csv' is taken"),
        (Camera(title=""), "is not one line of text"),
    )
    report = ck.check_reader(Camera(), example)
    assert report.passed, str(report)
    assert "written as CSV and read back" in {check.name for check in report.checks}
    said = [(failures(ck.check_reader(reader, example)), sentence) for reader, sentence in cases]
    assert [one for one in said if one[1] not in one[0]] == []


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


def test_an_exporter_conforms_and_a_wrong_one_is_caught_and_told() -> None:
    cases = (
        (Breaking(), "put the comment sign before each line"),
        (Failing(), "raised KeyError: 'A'"),
        (Table(suffix="csv"), "write one such as '.inp'"),
        (Table(name="latex"), "'latex' is taken"),
    )
    assert failures(ck.check_exporter(Table())) == ""
    said = [(failures(ck.check_exporter(exporter)), sentence) for exporter, sentence in cases]
    assert [one for one in said if one[1] not in one[0]] == []


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


# ---- specimen behaviour ----------------------------------------------------------------------------------------------

# Specimens that hear nothing of steps of their load or of the law, or that can be changed, do not conform.


class SteadyBar(ck.PerTest):
    """Strain = rate x time, of Norton's law at the largest stress, whatever the test and the law are."""

    name, title = "steady-bar", "Bar in steady creep"
    outputs: ClassVar[Any] = (ck.Output("strain", "strain"),)
    loads: ClassVar[Any] = (ck.Load("stress", "stress"),)

    def stress(self, history):
        return history.loading.program().values.max()

    def rate(self, law, values, stress):
        return values["A"] * stress ** values["n"]

    def one(self, law, values, history, nuisances):
        return {"strain": self.rate(law, values, self.stress(history)) * history.times}


class OfEveryLaw(SteadyBar):
    def rate(self, law, values, stress):
        return ck.lower(law, "numpy").rate(values, stress=stress, temperature=1073.15)


class First(OfEveryLaw):
    def stress(self, history):
        return history.loading.program().values[0]


class Last(OfEveryLaw):
    def stress(self, history):
        return history.loading.program().values[-1]


class Mean(OfEveryLaw):
    """Of the whole test: so that a step changes what came before it."""

    def stress(self, history):
        return history.loading.program().at(history.times).mean()


class Following(OfEveryLaw):
    """The integral of the rate over time, by the rule of trapezoids."""

    def one(self, law, values, history, nuisances):
        program = history.loading.program()
        times = np.union1d(np.linspace(0.0, history.times[-1], 2001), program.times)
        rates = np.broadcast_to(self.rate(law, values, program.at(times)), times.shape)
        strain = np.append(0.0, np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times)))
        return {"strain": np.interp(history.times, times, strain)}


class FollowingNortonAlone(Following):
    rate = SteadyBar.rate


class Refusing(SteadyBar):
    def one(self, law, values, history, nuisances):
        stress = history.loading.program().values
        if law != ck.law("norton") or stress.min() != stress.max():
            raise ck.errors.SolveError("Norton's law at one stress alone")
        return super().one(law, values, history, nuisances)


@dataclass(unsafe_hash=True)
class Changeable(Refusing):
    factor: float = 1.0


@dataclass(frozen=True)
class OfList(Refusing):
    levels: Any = None

    def __post_init__(self):
        object.__setattr__(self, "levels", [1.0])


def failed(report: ConformanceReport) -> dict[str, str]:
    return {check.name: check.detail for check in report.failures}


@pytest.mark.parametrize("kind", [Following, Refusing])
def test_what_follows_and_what_refuses_conforms(kind: type[SteadyBar]) -> None:
    report = ck.check_specimen(kind())
    assert report.passed, str(report)
    said = [one.detail for one in (*report.checks, *ck.check_specimen(ck.specimen("uniaxial")).checks)]
    assert [one for one in said if "a held load counts as" in one] == [
        said[[c.name for c in report.checks].index(LOAD)]
    ]


LOAD = "load stress"
ONE_LEVEL = "simulated as one of {} MPa held"
STEPS = (
    (OfEveryLaw, ONE_LEVEL.format(100)),
    (First, ONE_LEVEL.format(80)),
    (Last, ONE_LEVEL.format(85)),
    (Mean, "what is seen before a step must not depend on it"),
)


@pytest.mark.parametrize(("kind", "said"), STEPS)
def test_a_specimen_that_takes_one_level_of_a_load_is_told_which(kind: type[SteadyBar], said: str) -> None:
    found = failed(ck.check_specimen(kind()))
    assert said in found.pop("steps of load stress")
    assert not found


def test_a_specimen_of_one_law_refuses_the_others() -> None:
    found = failed(ck.check_specimen(FollowingNortonAlone()))
    assert "KeyError: 'A'" in found.pop("a law with other parameters")
    assert "5.0e-01 off; use the rate of the law that is given" in found.pop("another law with the same parameters")
    assert not found


def test_a_specimen_that_can_be_changed_is_told() -> None:
    assert "write @dataclass(frozen=True)" in failed(ck.check_specimen(Changeable()))["frozen"]
    assert "unhashable type: 'list'; a specimen is a key" in failed(ck.check_specimen(OfList()))["frozen"]


def test_a_kind_without_a_kit_is_checked_by_name_and_title() -> None:
    check = kit_of(replace(kinds.LAWS, label="furnace"))
    assert check(ck.law("norton")).passed
    assert not check(replace(ck.law("norton"), name="No Name")).passed
