"""The verbs, with plugins and predictors made for the occasion."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import ArgumentError, ExportError, HistoryError, LawError, SolveError
from creepkit.records import History, LawWithValues, Prediction, Status
from creepkit.registry import default_registry
from helpers.written_files import names_in

READERS = """
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from creepkit.language import hookimpl
from creepkit.records import History, constant_stress


@dataclass(frozen=True)
class OneNumber:
    name: str
    suffix: str
    title: str = "A file with one strain in it"

    def accepts(self, path):
        return path.suffix == self.suffix

    def read(self, path):
        strain = np.array([float(path.read_text())])
        return [History(path.stem, np.ones(1), {{"strain": strain}}, constant_stress(10.0), 1000.0, source=self.name)]


@hookimpl
def creepkit_readers():
    return [OneNumber("first", ".one"), OneNumber("second", "{suffix}")]
"""


class Steady(ck.Predictor):
    """Closed form of steady creep, A s^n t, that ends as it is told to."""

    name = "steady"

    def __init__(self, status: Status = Status.COMPLETE, end: float = np.inf) -> None:
        self.status, self.end = status, end

    def predict_batch(self, law, theta, histories, nuisances, sensitivities) -> Prediction:
        times, values = histories[0].times, law.from_internal(theta[0])
        stress = histories[0].loading.program().at(times)
        strain = np.where(times <= self.end, values["A"] * stress ** values["n"] * times, np.nan)
        return Prediction(
            values=strain[None, None, :, None],
            outputs=("strain",),
            lengths=np.array([times.size]),
            status=np.array([[self.status]]),
            end_times=np.array([[min(self.end, times[-1])]]),
        )


@pytest.fixture
def _own_registry() -> Iterator[None]:
    default_registry.cache_clear()
    yield
    default_registry.cache_clear()


def simulate(using: Steady, times: Sequence[float] = (1.0, 2.0, 4.0)) -> History:
    values = {"A": 1e-10, "n": 3.0}
    return ck.simulate(ck.law("norton"), using, values, loading=ck.constant_stress(100.0), times=times)


def test_text_is_never_evaluated_as_a_law() -> None:
    with pytest.raises(LawError, match="there is no law"):
        ck.law("A*stress**n")


def test_a_simulation_is_a_history_of_what_a_perfect_test_would_measure() -> None:
    run = simulate(Steady())

    np.testing.assert_allclose(run.outputs["strain"], [1e-4, 2e-4, 4e-4], rtol=1e-12)
    assert run.condition.endswith("100 MPa")


def test_a_simulation_that_bursts_ends_there() -> None:
    run = simulate(Steady(Status.RUPTURED, end=3.0))

    assert run.times.tolist() == [1.0, 2.0]
    assert (run.status, run.end_time, run.reason) == (Status.RUPTURED, 3.0, "burst")
    assert (run.labels, run.rupture_time) == ({"ended": "burst"}, 3.0)
    assert str(run) == "simulated: ended at 3 s (burst); 2 frames to 2 s, where strain 0.0002"


@pytest.mark.parametrize("times", [(1.0, 2.0), (0.0, 1.0)])
def test_a_simulation_without_any_of_its_times_is_an_error(times: tuple[float, ...]) -> None:
    with pytest.raises(SolveError) as said:
        simulate(Steady(Status.RUPTURED, end=0.5), times)
    assert str(said.value) == (
        "simulation of law 'norton' ended at 0.5 s, before any of the times asked for: burst; "
        "check values, loading and times"
    )


@pytest.mark.usefixtures("_own_registry")
def test_histories_are_read_by_name_by_pattern_and_by_folder(tmp_path: Path) -> None:
    plugin = tmp_path / "readers.py"
    plugin.write_text(READERS.format(suffix=".two"))
    default_registry().load_file(plugin)
    for name, strain in [("b.one", 0.2), ("a.one", 0.1), ("c.two", 0.3)]:
        (tmp_path / name).write_text(str(strain))

    assert [h.name for h in ck.read_histories(str(tmp_path / "*.one"))] == ["a", "b"]
    read = ck.read_histories([tmp_path / "c.two", tmp_path / "b.one"])
    assert [(h.name, h.outputs["strain"][0], h.source) for h in read] == [("c", 0.3, "second"), ("b", 0.2, "first")]
    assert ck.read_histories(tmp_path / "c.two", reader="first")[0].source == "first"


@pytest.mark.usefixtures("_own_registry")
def test_what_cannot_be_read_is_one_sentence(tmp_path: Path) -> None:
    plugin = tmp_path / "readers.py"
    plugin.write_text(READERS.format(suffix=".one"))
    default_registry().load_file(plugin)
    (tmp_path / "a.one").write_text("0.1")

    with pytest.raises(HistoryError, match="nothing.one"):
        ck.read_histories(tmp_path / "nothing.one")
    with pytest.raises(HistoryError, match=r"first.*second"):
        ck.read_histories(tmp_path / "a.one")
    with pytest.raises(HistoryError, match="frist.*first"):
        ck.read_histories(tmp_path / "a.one", reader="frist")


def test_values_set_by_hand_are_told_beside_the_notes_that_they_contradict() -> None:
    found = LawWithValues(ck.law("norton"), {"A": 1e-16, "n": 5.25}, ("n = 5.25, 95 % interval 5 to 5.5",))

    text = ck.export(found, "c", {"A": 1e-16, "n": 4.0})

    assert "n = 4 was set by hand, in place of 5.25" in text
    assert "A = 1e-16 was" not in text
    assert "by hand" not in ck.export(found, "c")
    with pytest.raises(LawError, match="needs a value for A"):
        ck.export(found, "c", {"n": 4.0})


def test_a_valued_law_keeps_its_own_units_moduli_and_name() -> None:
    found = LawWithValues(
        ck.law("norton"), {"A": 1e-16, "n": 5}, units=ck.Units("Pa", "h"), elastic=ck.Elastic(E=150e3), name="blade"
    )

    text = ck.export(found, "ansys")

    assert "Numbers below are in Pa and h" in text
    assert "MP,EX,1,150000000000" in text
    assert "Material number 1 is blade." in text
    assert "Numbers below are in MPa and s" in ck.export(found, "ansys", units=ck.Units())


def test_export_writes_the_text_it_returns(tmp_path: Path) -> None:
    law, values = ck.law("norton"), {"A": 1.2e-16, "n": 5.2}

    text = ck.export(law, "latex", values, to=tmp_path / "law.tex")

    assert (tmp_path / "law.tex").read_text() == text
    assert names_in(tmp_path) == ["law.tex"]
    with pytest.raises(ExportError, match="there is no exporter 'latx': did you mean 'latex'"):
        ck.export(law, "latx", values)
    with pytest.raises(LawError, match="needs a value for n"):
        ck.export(law, "latex", {"A": 1e-16})


def test_a_predictor_to_search_through_is_auto_or_an_object() -> None:
    run = ck.simulate(
        "norton", "uniaxial", {"A": 1e-16, "n": 4.0}, loading=ck.constant_stress(80.0), times=np.linspace(0.0, 1e4, 9)
    )
    with pytest.raises(ArgumentError, match="'rom'; allowed is a predictor such as .*, 'auto' or None"):
        ck.identify("norton", [run], through="rom")
